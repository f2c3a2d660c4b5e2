"""What docs/results/ says of sweeps, and that its sweeps are of this version's keys."""

import shutil
import sys
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import yaml

from berteam_cli.command.replay import players
from berteam_cli.compose import check, prepare
from berteam_cli.config import checked
from berteam_cli.sweep.folder import Sweep
from mctf.observe import observation_size
from mctf.rules import BLUE, make_rules
from mctf.scripted import NAMES
from mctf.start import reset
from mctf.state import CAPTURES, GRABS, empty
from tests.command.conftest import SMALL_BERTEAM, TINY
from tests.docs.pages import ROOT
from tests.test_config import composed

RESULTS = ROOT / "docs" / "results"
SCRIPTS = ("tables", "selection", "roles", "levers", "curves", "grabs", "course", "whole", "lure")


@pytest.fixture
def scripts(monkeypatch):
    monkeypatch.syspath_prepend(str(RESULTS))
    yield SimpleNamespace(**{name: __import__(name) for name in SCRIPTS})
    for name in SCRIPTS:
        sys.modules.pop(name)


def test_an_interval_is_student_s(scripts):
    # Mean 2, deviation 1, t of 2 degrees of freedom 4.303: 4.303 / √3 = 2.484.
    assert scripts.tables.spoken(np.array([1.0, 2.0, 3.0]), 2) == "2.00 ± 2.48"
    assert scripts.tables.spoken(np.array([7.0, np.nan])) == "7"
    assert scripts.tables.spoken(np.array([np.nan])) == ""


def swept(folder, lists):
    """Makes the folder of a sweep that says each of ``lists`` with two seeds."""
    Sweep(folder, "train", dict(enumerate([*words, f"seed={k}"] for words in lists for k in range(2)))).keep()


def test_a_variant_is_named_by_what_most_jobs_do_not_say(scripts, tmp_path):
    lists = [["epochs=9"], ["epochs=9", "x=1"], ["epochs=4"]]
    swept(tmp_path, lists)
    assert list(scripts.tables.variants(tmp_path)) == ["as it is", "x=1", "epochs=4"]
    assert scripts.tables.of_sweep(tmp_path)["seeds"].to_list() == ["0", "0", "0"]


def test_variants_that_would_share_a_name_stay_apart(scripts, tmp_path):
    lists = [["x=0"], ["x=1"], ["x=1", "y=1"], ["x=1", "z=1"]]
    swept(tmp_path, lists)
    assert list(scripts.tables.variants(tmp_path)) == ["x=0", "as it is", "y=1", "z=1"]
    lists = [["x=1"], [], ["x=1", "y=1"]]
    swept(tmp_path, lists)
    assert list(scripts.tables.variants(tmp_path)) == ["as it is", "nothing said", "y=1"]


def test_it_is_told_how_many_seeds_have_a_figure(scripts, monkeypatch):
    figures = pd.DataFrame({name: [1.0, 3.0] for name in scripts.tables.HEAD[2:]})
    figures["best team"], figures["first capture"] = [np.nan, 1200.0], np.nan
    monkeypatch.setattr(scripts.tables, "variants", lambda folder: {"x=1": figures})
    (row,) = scripts.tables.of_sweep(None).to_dict("records")
    assert (row["best team"], row["first capture"]) == ("1200 (1 of 2)", "")
    assert row["expected Elo"] == "2 ± 13"


def test_a_best_team_is_that_of_an_evaluation_after_the_last_epoch(scripts, tmp_path):
    (tmp_path / "evaluation").mkdir()
    figures = {"epoch": [5, 5], "quantity": ["regret", "best_elo_replayed"], "value": [20.0, 1100.5]}
    pd.DataFrame(figures).to_csv(tmp_path / "evaluation" / "figures.csv", index=False)
    assert scripts.tables.replayed(tmp_path, 5) == 1100.5
    assert np.isnan(scripts.tables.replayed(tmp_path, 6))


def test_selectors_are_compared_population_by_population(scripts):
    elos = pd.DataFrame({"berteam": [1010.0, 1110.0], "uniform": [1000.0, 1100.0]}, index=["a", "b"])
    elos.index.name = "population"
    assert "| berteam - uniform | 2 | 10 ± 0 |" in scripts.selection.compared(elos)


def test_grabs_end_at_home_at_a_tag_or_with_the_time(scripts):
    rules = SimpleNamespace(blue_size=2, tagging_cooldown_s=30.0)
    pos = np.zeros((9, 4, 2))
    pos[:, 2], pos[:, 3] = (12.0, 0.0), (0.0, 40.0)  # apart from blue, which stays at the origin
    cooldown = np.full((9, 4), 30.0)
    cooldown[5:, 2] = np.arange(4.0)  # it tags in frame 5
    pos[7:, 2] = (3.0, 4.0)
    happened = [
        (1, "grab", 0),
        (1, "grab", 2),
        (5, "lost_by_tag", 0),
        (5, "grab", 1),
        (6, "capture", 1),
        (7, "grab", 0),
    ]
    events = [SimpleNamespace(frame=frame, kind=kind, vehicle=v) for frame, kind, v in happened]
    film = SimpleNamespace(rules=rules, pos=pos, cooldown=cooldown, events=events, time=2.0 * np.arange(9))
    lost, home, kept = scripts.grabs.grabs(film)
    assert lost == (12.0, False, False, 8.0)
    assert home[:3] == (12.0, False, True)  # it could have tagged this one in the step in which it tagged the other
    assert kept[:3] == (5.0, True, False)
    assert np.isnan([home.lost_s, kept.lost_s]).all()
    row = scripts.grabs.table([lost, home, kept]).loc[12.0]
    assert row.iloc[:3].to_list() == [2, 1, 8.0]
    assert row.iloc[3] == 0
    assert "| [12.0, 13.0) | 2 | 1 | 8.0 | 0 | 0 |  |" in scripts.grabs.shown(scripts.grabs.table([lost, home, kept]))


def test_grabs_are_those_of_the_game(scripts):
    match = players(checked(composed("blue=2-2", "red=3-5", command="replay")))
    for film in scripts.grabs.films(match, 3):
        found = scripts.grabs.grabs(film)
        assert len(found) == film.score[-1, BLUE, GRABS] > 0
        assert sum(grab.home for grab in found) == film.score[-1, BLUE, CAPTURES]


@pytest.mark.parametrize(
    ("to", "action"), [((-9, 0), 4), ((0, 9), 2), ((0, -9), 6), ((9, 0), 0), ((-9, 8), 3), ((0.5, 0), 16)]
)
def test_a_plan_s_vehicle_turns_to_its_place(scripts, to, action):
    rules = make_rules()
    state = empty(1, rules)
    reset(state, 0, rules)
    assert state.heading[0, 0] == -90.0  # blue has the right half and faces the left one
    assert scripts.lure.heads_for(state, 0, state.pos[0, 0, 0] + to[0], state.pos[0, 0, 1] + to[1]) == action


def test_a_plan_is_worth_what_it_leads_to(scripts):
    lure, rules = scripts.lure, make_rules()
    state, seen = empty(1, rules), np.zeros((4, observation_size(rules)))
    raid, stay = (np.full((2, lure.SPANS, 2), place) for place in (rules.red_home_m, rules.blue_home_m))
    nobody, hard = (np.array([NAMES.index(name)] * 2) for name in ("nothing", "defend_hard"))
    assert lure.play(state, seen, stay, nobody, rules)[::2] == (0.0, False)
    worth, apart, won = lure.play(state, seen, raid, nobody, rules)
    assert won
    assert 10.0 < apart < 40.0  # those who do nothing start 30 m from their flag
    assert 150.0 < worth < 2 * 80.0 + 30.0  # the flag is 75 m from the middle, and those stay 30 m away
    assert not lure.play(state, seen, raid, hard, rules)[2]


def test_a_way_past_a_hard_defender_is_found_and_found_again(scripts):
    easy_hard, hard = (
        np.array([NAMES.index(name) for name in (other, "defend_hard")]) for other in ("defend_easy", "defend_hard")
    )
    way = scripts.lure.found(easy_hard, 8000, 3)
    assert way == scripts.lure.found(easy_hard, 8000, 3)
    assert way.time_s <= 420.0
    assert scripts.lure.found(hard, 5, 0) is None


def test_roles_are_what_members_add_to_their_teams(scripts):
    rng = np.random.default_rng(0)
    grabs, tags = np.array([0.5, 0.0, 0.25]), np.array([0.0, 2.0, 1.0])
    teams = {side: rng.integers(3, size=(40, 2)) for side in ("blue", "red")}
    games = pd.DataFrame({side: ["-".join(map(str, team)) for team in of] for side, of in teams.items()})
    for side, of in teams.items():
        games[f"{side}_grabs"], games[f"{side}_tags"] = grabs[of].sum(axis=1), tags[of].sum(axis=1)
        games[f"{side}_captures"], games[f"{side}_score"] = 0.0, 0.5
    found = scripts.roles.roles(games[games.index >= 10])
    assert found["grabs"].to_list() == pytest.approx(grabs)
    assert found["tags"].to_list() == pytest.approx(tags, abs=1e-12)
    assert found["score"].to_list() == pytest.approx([0.25] * 3)
    late = np.concatenate([of[10:] for of in teams.values()])
    assert found["share of places"].to_list() == pytest.approx(np.bincount(late.ravel(), minlength=3) / late.size)
    assert "| 1 | " in scripts.roles.shown(found)


@pytest.mark.filterwarnings("ignore:Computation of the confidence interval")  # which says that percent
def test_one_lever_is_compared_as_student_does_and_more_of_them_more_carefully(scripts):
    control, same, other = [
        pd.DataFrame(dict.fromkeys(scripts.levers.COMPARED, x)) for x in ([8.0, 10.0, 12.0], [9.0, 11.0], [40.0, 42.0])
    ]
    # Pooled variance (8 + 2) / 3, t of 3 degrees of freedom 3.182: 3.182 · √(10 / 3 · (1/3 + 1/2)) = 5.30.
    (alone,) = scripts.levers.differences(control, {"same": same})["won"]
    assert alone.startswith("+0.00 ± ")
    assert float(alone.split()[-1]) == pytest.approx(5.30, rel=0.02)  # SciPy finds the quantile to a percent or so
    both = scripts.levers.differences(control, {"same": same, "other": other, "not done": same[:1]})
    assert both["variant"].to_list() == ["`same`", "`other`"]
    assert both["lost"][1].startswith("**+31.00 ± ")
    assert float(both["won"][0].split(" ± ")[1]) > 3.9  # 3.182 · √(7 / 3 · 5 / 6) = 3.92, were they compared one by one


def test_levers_are_compared_at_one_size():
    plans = [yaml.safe_load((RESULTS / f"{name}.yaml").read_text()) for name in ("control", "ablations", "small")]
    assert plans[0]["overrides"] == plans[1]["overrides"] == plans[2]["overrides"]


def test_the_sweeps_can_be_run():
    prepare()
    for path in sorted(RESULTS.glob("*.yaml")):
        plan = yaml.safe_load(path.read_text())
        listed = plan.get("list", [[]])
        for variant in [listed[0], *(x for x in listed if any("." not in word.split("=")[0] for word in x))]:
            first = [f"{key}={values[0]}" for key, values in plan.get("sweep", {}).items()]
            config = check("train", [*plan["overrides"], *variant, *first], lambda config, keys: None)
            assert config.evaluation.games_per_pair > 0


def test_a_long_run_is_shown_at_looks_that_fit_with_the_last(scripts):
    assert scripts.curves.shown([0, 100, 200]) == [0, 100, 200]
    assert scripts.curves.shown(list(range(0, 2100, 100))) == list(range(0, 2100, 200))
    assert scripts.curves.shown([0, *range(100, 1200, 100), 1150]) == [0, *range(200, 1200, 200), 1150]


def test_a_run_s_course_is_that_of_its_looks_and_of_the_games_between(scripts, tmp_path):
    looks = {"epoch": [0, 2, 4], "who": "choice", "opponent": "all", "games": 10, "wins": [0, 1, 3], "draws": [4, 5, 6]}
    both = [
        pd.DataFrame(looks | {"elo": [800.0, 850.0, 900.0]}),
        pd.DataFrame(looks | {"who": "best_team", "elo": 1.0}),
    ]
    pd.concat(both).to_csv(tmp_path / "evaluation.csv")
    games = {"epoch": [1, 2, 3, 4], "blue_score": [0.5, 1.0, 0.5, 0.5], "blue_grabs": [0, 1, 0, 2], "red_grabs": 1}
    pd.DataFrame(games).to_csv(tmp_path / "games.csv")
    elo, won, drawn, own_drawn, grabs = scripts.curves.of_run(tmp_path).to_numpy().T
    assert elo.tolist() == [800.0, 850.0, 900.0]
    assert won.tolist() == [0.0, 0.1, 0.3]
    assert drawn.tolist() == [0.4, 0.5, 0.6]
    assert own_drawn[1:].tolist() == [0.5, 1.0]
    assert np.isnan(own_drawn[0])  # no game before the first look
    assert grabs[1:].tolist() == [1.5, 2.0]


def test_whole_runs_are_gathered_from_what_they_left(scripts, berteam, monkeypatch, tmp_path):
    words = ["experiment=paper_comparison", "population=islands4x3", *TINY, *SMALL_BERTEAM, "evaluation.games=560"]
    berteam("train", *words, "optimizer.replacements=0", "seed=3", "evaluate_every=2", "out=run")
    whole_run = tmp_path / "run"
    monkeypatch.setattr(scripts.whole, "HERE", tmp_path)
    monkeypatch.setattr(scripts.whole, "SPAN", 2)
    variant = "experiment=paper_comparison selector=berteam optimizer=coevolution optimizer.replacements=0"
    for file in scripts.whole.TABLES.values():
        shutil.copy(RESULTS / file, tmp_path)
    scripts.whole.gather(whole_run)
    tables = [pd.read_csv(tmp_path / file) for file in scripts.whole.TABLES.values()]
    for table, file in zip(tables, scripts.whole.TABLES.values(), strict=True):
        others = table[(table.variant != variant) | (table.seed != 3)].reset_index(drop=True)
        pd.testing.assert_frame_equal(others, pd.read_csv(RESULTS / file), check_exact=True)
    ours = (table[(table.variant == variant) & (table.seed == 3)] for table in tables)
    runs, looks, games = (table.reset_index(drop=True) for table in ours)
    played, elo = pd.read_csv(whole_run / "games.csv"), pd.read_csv(whole_run / "elo.csv")
    assert games.to_epoch.tolist() == [2, 4]
    assert games.games.sum() == len(played)
    assert games.decided.tolist() == [
        (played.blue_score[x] != 0.5).sum() for x in (played.epoch <= 2, played.epoch > 2)
    ]
    assert games.tags.sum() == played.blue_tags.sum() + played.red_tags.sum()
    assert (runs.rated_wins[0], runs.rated_games[0]) == (elo.wins.sum(), elo.games.sum())
    assert (runs.best_elo[0], runs.best_elo_low[0]) == (elo.elo.max(), elo.elo_low[0])
    assert runs.replaced[0] == runs.places_replaced[0] == runs.removed_fitter[0] == 0
    assert looks.epoch.unique().tolist() == [0, 2, 4]
    (row,) = scripts.whole.courses(looks, games).to_dict("records")
    choice = scripts.curves.of_choice(looks).loc[2]
    shares = choice.wins / choice.games, games.decided[0] / games.games[0]
    assert row == row | {
        "": "BERTeam, nobody cloned, 3",
        "to 2": f"{choice.elo:.0f} / {shares[0]:.2f} / {shares[1]:.3f}",
    }


def test_a_whole_run_takes_the_place_of_its_like_or_joins_its_variant(scripts):
    table = pd.DataFrame({"variant": ["b", "b", "a"], "seed": [0, 2, 0], "epoch": [1, 2, 3]})

    def with_run(variant: str, seed: int) -> list[tuple]:
        rows = pd.DataFrame({"variant": variant, "seed": seed, "epoch": [8, 9]})
        return list(scripts.whole.merged(table, rows).itertuples(index=False, name=None))

    assert with_run("b", 0) == [("b", 0, 8), ("b", 0, 9), ("b", 2, 2), ("a", 0, 3)]
    assert with_run("b", 1) == [("b", 0, 1), ("b", 1, 8), ("b", 1, 9), ("b", 2, 2), ("a", 0, 3)]
    assert with_run("A", 5) == [("b", 0, 1), ("b", 2, 2), ("a", 0, 3), ("A", 5, 8), ("A", 5, 9)]


def test_own_games_are_counted_span_by_span(scripts, monkeypatch, tmp_path):
    monkeypatch.setattr(scripts.whole, "SPAN", 10)
    games = {"epoch": [1, 10, 11, 20, 21], "blue_score": [1.0, 0.0, 0.5, 0.5, 0.0]}
    games |= {f"{side}_{what}": [1, 0, 0, 2, 3] for side in ("blue", "red") for what in ("captures", "grabs", "tags")}
    pd.DataFrame(games).to_csv(tmp_path / "games.csv")
    counted = scripts.whole.own_games(tmp_path)
    assert counted.to_epoch.tolist() == [10, 20, 30]
    assert counted.games.tolist() == [2, 2, 1]
    assert counted.decided.tolist() == [2, 0, 1]
    assert counted.grabs.tolist() == [2, 4, 6]


def test_who_was_replaced_is_counted(scripts, tmp_path):
    fitness = {
        "removed": [3, 4, 3],
        "removed_fitness": [900.0, 1100.0, 990.0],
        "parent_fitness": [1000.0, 1000.0, 1000.0],
    }
    elo = {"elo_low": [1.0, 0.0], "elo_high": [3.0, 2.0], "games": 5, "wins": [2, 1], "draws": [3, 0], "losses": [0, 4]}
    for name, table in (("summary", {"best_elo": [2.0]}), ("elo", elo), ("generations", fitness)):
        pd.DataFrame(table).to_csv(tmp_path / f"{name}.csv")
    (row,) = scripts.whole.ended(tmp_path).to_dict("records")
    assert (row["replaced"], row["places_replaced"], row["removed_fitter"]) == (3, 2, 1)
    assert (row["best_elo_low"], row["best_elo_high"]) == (1.0, 3.0)
    assert [row[f"rated_{x}"] for x in ("games", "wins", "draws", "losses")] == [10, 3, 3, 4]


def test_seeds_of_the_coevolution_stand_side_by_side(scripts, monkeypatch):
    monkeypatch.setattr(scripts.whole, "SPAN", 10)
    look = {"opponent": "all", "who": "choice"}
    looks = pd.DataFrame(
        [
            look | {"seed": seed, "epoch": epoch, "elo": 900 + epoch + seed, "wins": epoch, "losses": 1000 * seed}
            for seed, epochs in ((0, (0, 5, 10, 15)), (1, (0, 5, 10)))
            for epoch in epochs
        ]
    )
    games = pd.DataFrame({"seed": [0, 0, 1], "to_epoch": [10, 20, 10], "games": 8, "decided": [2, 0, 4], "grabs": 4})
    table = scripts.whole.coevolution(looks, games)
    assert table.to_dict("list") == {
        "to epoch": ["10", "20"],
        "expected Elo of the choice": ["908; 908", "915"],
        "won": ["15; 15", "15"],
        "lost": ["0; 2,000", "0"],
        "own games decided": ["0.2500; 0.5000", "0.0000"],
        "grabs in an own game": ["0.500; 0.500", "0.500"],
    }


def test_the_page_shows_the_whole_runs_that_are_shipped(scripts):
    runs, looks, games = (pd.read_csv(RESULTS / file) for file in scripts.whole.TABLES.values())
    page = (ROOT / "docs" / "results.md").read_text().splitlines()
    for line in scripts.whole.shown(runs, looks, games).splitlines():
        assert line in page


def test_a_course_is_the_mean_of_the_looks_since_the_point_before(scripts):
    table = pd.DataFrame(
        {
            "variant": ["a", "a", "a", "a", "a", "a", "b"],
            "seed": 0,
            "epoch": [0, 10, 11, 100, 100, 100, 100],
            "who": ["choice", "choice", "choice", "choice", "best_team", "choice", "choice"],
            "opponent": ["all", "all", "all", "all", "all", "random + random", "all"],
            "games": 10,
            "wins": [9, 1, 3, 5, 0, 0, 0],
            "elo": [800.0, 900.0, 920.0, 1000.0, 1.0, 2.0, 3.0],
        }
    )
    (run,) = scripts.course.lines(table, "a")
    points = scripts.course.smoothed(run, games_per_epoch=10)
    assert points.games.tolist() == [105.0, 1000.0]
    assert points.elo.tolist() == [910.0, 1000.0]
    assert points.won.tolist() == pytest.approx([0.2, 0.5])


def test_the_strengths_beside_the_courses_are_those_of_the_scripted_teams(scripts):
    elos = pd.read_csv(ROOT / "berteam_cli" / "rating" / "mctf_2_607c6363.csv").elo
    assert round(elos.max()) == scripts.course.BEST_PAIR
    drawn = scripts.course.NO_WIN_NO_LOSS
    assert (1 / (1 + 10 ** ((elos - drawn) / 400))).mean() == pytest.approx(0.5, abs=0.001)


def test_all_courses_are_drawn(scripts, tmp_path):
    for course in scripts.course.COURSES:
        runs = scripts.course.lines(pd.read_csv(RESULTS / course.table), course.variant)
        assert runs
        assert all(len(scripts.course.smoothed(run, course.games_per_epoch)) > 1 for run in runs)
    scripts.course.draw(tmp_path / "course.png")
    assert (tmp_path / "course.png").read_bytes().startswith(b"\x89PNG")
