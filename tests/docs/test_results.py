"""What docs/results/ says of sweeps, and that its sweeps are of this version's keys."""

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
from mctf.rules import BLUE
from mctf.state import CAPTURES, GRABS
from tests.docs.pages import ROOT
from tests.test_config import composed

RESULTS = ROOT / "docs" / "results"
SCRIPTS = ("tables", "selection", "roles", "levers", "curves", "grabs", "course")


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


def test_a_variant_is_named_by_what_most_jobs_do_not_say(scripts, tmp_path):
    lists = [["epochs=9"], ["epochs=9", "x=1"], ["epochs=4"]]
    Sweep(tmp_path, "train", dict(enumerate([*words, f"seed={k}"] for words in lists for k in range(2)))).keep()
    assert list(scripts.tables.variants(tmp_path)) == ["as it is", "x=1", "epochs=4"]
    assert scripts.tables.of_sweep(tmp_path)["seeds"].to_list() == ["0", "0", "0"]


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


def test_a_course_is_the_mean_of_the_looks_since_the_point_before(scripts):
    table = pd.DataFrame(
        {
            "job": [0, 0, 0, 0, 0, 0, 3],
            "epoch": [0, 10, 11, 100, 100, 100, 100],
            "who": ["choice", "choice", "choice", "choice", "best_team", "choice", "choice"],
            "opponent": ["all", "all", "all", "all", "all", "random + random", "all"],
            "games": 10,
            "wins": [9, 1, 3, 5, 0, 0, 0],
            "elo": [800.0, 900.0, 920.0, 1000.0, 1.0, 2.0, 3.0],
        }
    )
    points = scripts.course.smoothed(scripts.course.looks(table, 0), games_per_epoch=10)
    assert points.games.tolist() == [105.0, 1000.0]
    assert points.elo.tolist() == [910.0, 1000.0]
    assert points.won.tolist() == pytest.approx([0.2, 0.5])


def test_all_courses_are_drawn(scripts, tmp_path):
    for course in scripts.course.COURSES:
        looked_at = scripts.course.looks(pd.read_csv(RESULTS / course.table), course.job)
        assert len(scripts.course.smoothed(looked_at, course.games_per_epoch)) > 1
    scripts.course.draw(tmp_path / "course.png")
    assert (tmp_path / "course.png").read_bytes().startswith(b"\x89PNG")
