"""Every choice composes, checks, and says what it is."""

import re
from itertools import product
from pathlib import Path

import numpy as np
import pytest
import yaml
from gymnasium.spaces import Box
from hydra import compose, initialize_config_module

from berteam_cli import build, cli
from berteam_cli.compose import CONF, choices, groups, keys, prepare
from berteam_cli.config import checked
from berteam_cli.errors import InputError
from berteam_cli.learner.exporting import exported

ROOT = Path(__file__).parent.parent
YAMLS = sorted((ROOT / "conf").glob("**/*.yaml"))
# What a choice cannot do without
NEEDS = {"hands": ["env=rps"], "fixed": [], "pettingzoo": ["env.target=mctf:parallel_env", "env.options.team_size=2"]}


def composed(*overrides, command="train"):
    prepare()
    with initialize_config_module(CONF, version_base="1.3"):
        return compose(command, overrides=list(overrides))


def all_choices():
    prepare()
    with initialize_config_module(CONF, version_base="1.3"):
        return [(group, choice) for group in groups() for choice in choices(group)]


@pytest.fixture(scope="module")
def a_file(tmp_path_factory):
    """A member of the default game, as a file of Stable-Baselines3."""
    path, parts = tmp_path_factory.mktemp("member") / "one.zip", build.parts(checked(composed("population=ppo6")))
    learner, game = parts.optimizer.islands[0].learner, parts.games.env
    state = learner.init(1, np.random.default_rng(0))
    exported(learner, state, 0, Box(-1, 1, (game.observation_size,), np.float32)).save(path)
    return path


@pytest.fixture(scope="module")
def a_run(tmp_path_factory):
    """A run of the default game that has begun."""
    folder = tmp_path_factory.mktemp("source") / "run"
    words = ["population=fixed_policies", "selector=uniform", "optimizer=fixed", "epochs=0", "evaluation.games=0"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sys.argv", ["berteam", "train", *words, f"out={folder}"])
        cli.main()
    return folder


@pytest.mark.parametrize(("group", "choice"), all_choices())
def test_every_choice_builds(group, choice, a_file, a_run):
    if (group, choice) == ("learner", "fixed"):
        overrides = ["population=ppo6", "learner=fixed", "learner.policies=[random,random,random,random,random,random]"]
    else:
        overrides = [f"{group}={choice}", *NEEDS.get(choice, [])]
    if choice == "rps":
        overrides += ["population=ppo6"]
    if choice == "imported":
        overrides += [f"population.members=[{{file: {a_file}}},{{file: {a_file}, name: twin}}]"]
    if choice == "of_run":
        overrides += [f"population.run={a_run}"]
    parts = build.parts(checked(composed(*overrides)))
    assert parts.selector.field.members == sum(island.size for island in parts.optimizer.islands)


@pytest.mark.parametrize("words", list(product(["berteam", "mcaa", "uniform"], ["coevolution", "mapelites", "fixed"])))
@pytest.mark.parametrize("experiment", ["quickstart", "paper_comparison"])
def test_every_selector_goes_with_every_optimizer(experiment, words):
    selector, optimizer = words
    build.parts(checked(composed(f"experiment={experiment}", f"selector={selector}", f"optimizer={optimizer}")))


@pytest.mark.parametrize("path", YAMLS, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_value_has_a_comment(path):
    """A key at the top of a file is a value unless it is a part of Hydra, a name, or stands in an experiment."""
    lines = path.read_text().splitlines()
    assert lines[0].startswith("#")
    if path.parent.name == "experiment":
        return
    for number, line in enumerate(lines):
        key = re.match(r"(\w+):", line)
        if key and key[1] not in {"defaults", "name", "hydra", "islands"}:
            assert lines[number - 1].startswith("#"), f"{path}: {key[1]} has no comment"


@pytest.mark.parametrize("path", YAMLS, ids=lambda path: str(path.relative_to(ROOT)))
def test_the_choice_is_named_like_its_module(path):
    name = yaml.safe_load(path.read_text()).get("name")
    if name is not None:
        assert name == path.stem
        assert (ROOT / "berteam_cli" / path.parent.name / f"{name}.py").exists()


def test_the_papers_parameters():
    comparison = checked(composed("experiment=paper_comparison"))
    assert (comparison.epochs, comparison.games_per_epoch, comparison.optimizer.protect_new) == (4000, 16, 500)
    assert [i.size for i in comparison.population.islands.values()] == [15] * 4
    assert comparison.selector.captain == "uniform"
    assert not comparison.selector.weighting
    coevolution = checked(composed("experiment=paper_coevolution"))
    assert (coevolution.epochs, coevolution.optimizer.elites, coevolution.optimizer.protect_new) == (8000, 3, 500)
    assert (coevolution.games_per_epoch, coevolution.population.islands["main"].size) == (25, 50)
    assert (coevolution.selector.batch_size, coevolution.selector.minibatch_size) == (512, 64)
    fixed = checked(composed("experiment=paper_fixed"))
    assert (fixed.epochs, fixed.selector.weighting, fixed.selector.captain) == (3000, True, "berteam")
    assert (fixed.selector.batch_size, fixed.selector.minibatch_size, fixed.selector.weight_cap) == (1024, 256, 13)
    plain = checked(composed())
    assert (plain.epochs, plain.games_per_epoch, plain.optimizer.protect_new) == (200, 16, 25)


@pytest.mark.parametrize(
    ("override", "said"),
    [
        ("env.tau_s=0", "env.tau_s must be > 0, but is 0"),
        ("selector.draw_weight=1.5", "selector.draw_weight must be >= 0 and <= 1, but is 1.5"),
        ("population.islands.dqn96.learner.gamma=-0.1", "population.islands.dqn96.learner.gamma must be >= 0 and <= 1"),
    ],
)
def test_bounds(override, said):
    with pytest.raises(InputError, match=f"^{said}"):
        checked(composed(override))


def test_keys_are_dotted_and_follow_references():
    found = keys(composed("population=ppo6"))
    assert {"epochs", "env.max_time_s", "population.islands.main.learner.gamma", "learner.gamma"} <= set(found)
