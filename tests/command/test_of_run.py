"""population.run, for real: the members of one run in another, and that one without the first."""

import re
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from berteam_cli.games import both_sides
from berteam_cli.population import names, policies
from berteam_cli.reading import last_state
from berteam_cli.records import COLUMNS
from berteam_cli.report.overview import headline
from berteam_cli.report.source import Source
from berteam_cli.selector.base import unordered_teams
from tests.command.conftest import SMALL_BERTEAM, TINY
from tests.hostile.conftest import FEW, MARK, changed

WORDS = [*TINY, "evaluation.games=0", "payoff_steps=0"]
OF = ["population=of_run", "population.run=src", "optimizer=fixed"]
HANDS = ["env=rps", "team_size=1", "games_per_epoch=4", "epochs=1", "evaluation.games=0"]
TIMED = {"timing", "summary"}


@pytest.fixture(scope="module")
def sources(tmp_path_factory):
    """Runs to take members from: `src` of the default game, with PPO, DQN and fixed members, and `hands` of rps."""
    from berteam_cli import cli  # noqa: PLC0415

    place = tmp_path_factory.mktemp("sources")
    league = ["opponents=league", "opponents.exploiters=[dqn64]", "opponents.exploit_share=0.25"]
    quick = ["population.islands.ppo64.learner.n_steps=16", "population.islands.ppo64.learner.minibatch_size=8"]
    runs = {
        "src": [*WORDS, "population=mixed4x3", "selector=uniform", *quick],
        "league": [*WORDS, "population=mixed4x3", "selector=uniform", "epochs=1", *league],
        "hands": [*HANDS, "population=hands", "selector=uniform", "optimizer=fixed"],
    }
    with pytest.MonkeyPatch.context() as patch:
        for name, words in runs.items():
            patch.setattr("sys.argv", ["berteam", "train", *words, f"out={place / name}"])
            cli.main()
    return place


@pytest.fixture
def src(sources, tmp_path):
    """Copies a source to where the command works."""

    def copied(name="src"):
        return Path(shutil.copytree(sources / name, tmp_path / name)).relative_to(tmp_path)

    return copied


def members_of(folder):
    parts, run = last_state(Path(folder))
    islands = parts.optimizer.islands
    return names(islands, run.population), policies(islands, run.population, explore=False), parts


def tables(folder):
    return {x: (Path(folder) / f"{x}.csv").read_bytes() for x in COLUMNS if (Path(folder) / f"{x}.csv").exists()}


def same_bytes(one, other):
    """Checks that two runs have the same tables, but for how long they took, and the same tensors after epoch 4."""
    ours, theirs = tables(one), tables(other)
    assert ours.keys() == theirs.keys() > TIMED
    assert [x for x in ours if ours[x] != theirs[x] and x not in TIMED] == []
    last = Path("checkpoint", "epoch_00000004", "tensors.safetensors")
    assert Path(one, last).read_bytes() == Path(other, last).read_bytes()


def test_members_of_a_run_act_as_there_and_learn_nothing(src, berteam):
    src()
    berteam("train", *WORDS, *OF, "selector=uniform", "optimizer=coevolution", "optimizer.replacements=0", "out=new")
    (called, theirs, before), (again, ours, after) = members_of("src"), members_of("new")
    assert again == called
    for column, copied in zip(theirs, ours, strict=True):
        np.testing.assert_array_equal(column, copied)
    teams = unordered_teams(len(called), 2)
    lineups = both_sides(teams, np.roll(teams, 7, axis=0), 2, 2)
    played = [parts.games.play(rows, lineups, 5)[0] for parts, rows in ((before, theirs), (after, ours))]
    for one, other in zip(vars(played[0]).values(), vars(played[1]).values(), strict=True):
        if isinstance(one, np.ndarray):
            np.testing.assert_array_equal(one, other)
    agents = pd.read_csv("new/agents.csv").query("epoch == 4")
    assert list(agents.island) == [x for x in ("ppo64", "dqn64", "attackers", "defenders") for _ in range(3)]
    assert list(agents.algorithm) == ["imported"] * 6 + ["fixed"] * 6
    assert pd.read_csv("src/learning.csv").updates.sum() > 0 == pd.read_csv("new/learning.csv").updates.sum()
    assert '"members_of": "src after epoch 4"' in Path("new/manifest.json").read_text()


def test_it_goes_on_and_is_read_when_the_source_has_gone(src, berteam):
    src()
    words = [*WORDS, *OF, *SMALL_BERTEAM, "selector=berteam"]
    berteam("train", *words, "workers=2", "out=whole")
    berteam("train", *words, "workers=1", "epochs=2", "out=parts")
    shutil.rmtree("src")
    berteam("resume", "parts", "epochs=4")
    same_bytes("whole", "parts")
    berteam("train", *words, "out=parts", "on_exists=resume", "epochs=5")
    berteam("evaluate", "whole", *FEW, "teams_at_most=4", "reference_teams=4")
    assert headline(Source.of(Path("whole")))["Members of"] == "src after epoch 4"
    berteam("tournament", "run=whole", "top=2", "games_per_pair=2", "out=t")
    berteam("replay", "whole", "blue=0-6", "red=3-9")
    error = berteam("train", *words, "out=new", code=2).stderr
    assert error == "berteam: population.run: src is no folder of a run: it has no readable manifest.json.\n"


def test_a_run_without_a_checkpoint_begins_again(src, berteam):
    src()
    words = [*WORDS, *OF, "selector=uniform", "out=new"]
    berteam("train", *words)
    once = tables("new")
    shutil.rmtree("new/checkpoint")
    berteam("train", *words, "on_exists=resume")
    assert all(once[x] == now for x, now in tables("new").items() if x not in TIMED)


def test_runs_of_runs_of_runs(src, berteam):
    """Exploiters stay in the first run; members join others, and copies keep the name of whom they are copies of."""
    src("league")
    berteam("train", *WORDS, *OF, "population.run=league", "selector=mcaa", "out=second")
    one, two = members_of("league"), members_of("second")
    assert two[0] == one[0][:3] + one[0][6:]
    for column, copied in zip(one[1], two[1], strict=True):
        np.testing.assert_array_equal(np.delete(column, [3, 4, 5], axis=0), copied)
    own = ["population=ppo6", "population.run=second", "selector=uniform", "optimizer.protect_new=0"]
    berteam("train", *WORDS, *own, "out=third")
    assert members_of("third")[0][:6] == [f"main.{k}" for k in range(6)]
    assert set(members_of("third")[0][6:9]) <= set(two[0][:3])
    berteam("train", *WORDS, *OF, "population.run=third", "selector=best_team", "out=fourth")
    three, four = members_of("third"), members_of("fourth")
    assert four[0] == three[0]
    for column, copied in zip(three[1], four[1], strict=True):
        np.testing.assert_array_equal(column, copied)


WRONG = {
    ("population.run=nothing",): "population.run: nothing is no folder of a run",
    (
        "population.run=hands",
    ): "population.run: hands must be a run of the same game, but is of env=rps, and this of mctf",
    ("team_size=3",): "population.run=src must hold members that see 61 numbers .* and its team_size=2",
    ("population=mixed4x3",): "population.run=src has an island ppo64, as this population has",
    ("out=src", "on_exists=overwrite"): "out must be another folder than population.run, but both are src",
}


def test_wrong_runs(src, berteam):
    src(), src("hands")
    before = sorted(Path().rglob("*"))
    for words, said in WRONG.items():
        error = berteam("train", *WORDS, *OF, "selector=uniform", "out=new", *words, code=2).stderr
        assert re.search(said, error), error
        assert error.count("\n") == 1, error
        assert sorted(Path().rglob("*")) == before
    for path in Path("src/checkpoint").glob("*/tensors.safetensors"):
        path.write_bytes(path.read_bytes()[:-4] + b"none")
    error = berteam("train", *WORDS, *OF, "selector=uniform", "out=new", code=2).stderr
    assert "population.run: src has no checkpoint to go on from" in error


def test_the_damaged_newest_checkpoint_of_the_source_gives_way_to_the_one_before(src, berteam):
    src()
    Path("src/checkpoint/epoch_00000004/tensors.safetensors").write_bytes(b"none")
    berteam("train", *WORDS, *OF, "selector=uniform", "out=new")
    assert '"members_of": "src after epoch 2"' in Path("new/manifest.json").read_text()


def test_nothing_that_the_source_names_is_imported(src, berteam):
    changed(src(), "reward: custom_rew2", "reward: strange:pay")
    changed(src("hands"), "name: rps", "name: pettingzoo\n  target: strange:pay\n  options: {}")
    changed(Path("hands"), "  sides: 2\n", "  teams: {}\n  max_steps: 9\n  score: reward\n")
    Path("strange.py").write_text(f"open({MARK!r}, 'w')\ndef pay(terms, before, after):\n    return 1.0\n")
    berteam("train", *WORDS, *OF, "selector=uniform", "out=new")
    error = berteam("train", *HANDS, *OF, "population.run=hands", "selector=uniform", "out=other", code=2).stderr
    assert "hands must be a run of the same game, but is of env=pettingzoo" in error
    assert not Path(MARK).exists()


def test_a_checkpoint_that_does_not_say_who_they_are_is_none(src, berteam):
    berteam("train", *HANDS, "population=hands", "selector=uniform", "optimizer=fixed", "out=new")
    changed(Path("new"), "run: null", f"run: {src('hands')}")
    changed(Path("new"), "hands:\n      size: 3", "others:\n      size: 3")
    assert "does not say who the members of population.run are" in berteam("resume", "new", code=3).stderr
    assert "does not say who the members" in berteam("evaluate", "new", *FEW, code=2).stderr


def test_members_learn_nothing_even_where_others_do(src, berteam):
    src("hands")
    learning = ["population=ppo6", "learner.n_steps=4", "learner.minibatch_size=4"]
    berteam("train", *HANDS, *learning, "population.run=hands", "selector=uniform", "games_per_epoch=60", "out=new")
    agents = pd.read_csv("new/agents.csv").query("epoch == 1")
    assert list(agents.island) == ["main"] * 6 + ["hands"] * 3
    updates = pd.read_csv("new/learning.csv").groupby("agent").updates.sum()
    assert updates[:6].sum() > 0 == updates[6:].sum()
