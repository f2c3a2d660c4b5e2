"""The training loop practises; whatever measures does not."""

import numpy as np
import pytest

from berteam_cli import build
from berteam_cli.config import checked
from berteam_cli.errors import InputError
from berteam_cli.training import Probes, begin, epoch
from tests.test_config import composed

WORDS = ["population=ppo6", "selector=uniform", "env.max_time_s=60", "games_per_epoch=16", "env.world_size_m=[80,50]"]


def parts(*words):
    return build.parts(checked(composed(*WORDS, *words)))


def test_only_the_populations_own_games_start_elsewhere():
    plain, practising = parts(), parts("curriculum=starts", "curriculum.random=0", "curriculum.carrying=0.8")
    run = begin(plain)
    (_, before), (_, after) = epoch(run, plain), epoch(run, practising)
    ours = after.outcomes
    assert (ours.event("captures") > ours.event("grabs")).any()  # carried home, and not grabbed
    assert (before.outcomes.event("captures") <= before.outcomes.event("grabs")).all()
    teams, opponents = np.array([[0, 1], [2, 3]]).repeat(4, axis=0), np.full((8, 2), 2)
    probed = [Probes(each, 5).play(run.population, teams, opponents, 4) for each in (plain, practising)]
    assert (probed[0].steps == probed[1].steps).all()
    assert (probed[0].events == probed[1].events).all()
    assert practising.games.env.starts == plain.games.env.starts


def test_when_the_shares_are_gone_training_is_as_without():
    plain, practising = parts(), parts("curriculum=starts", "curriculum.until=1")
    run, _ = epoch(begin(plain), plain)
    (_, before), (_, after) = epoch(run, plain), epoch(run, practising)
    assert (before.outcomes.steps == after.outcomes.steps).all()
    assert (before.outcomes.events == after.outcomes.events).all()


def test_by_default_nobody_practises():
    assert parts().curriculum.total == 0
    assert parts("curriculum=starts").curriculum.total == 0.6


@pytest.mark.parametrize(
    ("word", "said"),
    [
        ("env.last_steps=0", "env.last_steps must be >= 1 and <= 16, but is 0"),
        ("env.last_steps=17", "env.last_steps must be >= 1 and <= 16, but is 17"),
        ("env.potential=-1", "env.potential must be >= 0, but is -1"),
        ("env.potential_discount=1.1", "env.potential_discount must be >= 0 and <= 1, but is 1.1"),
        ("env.potential_tagged=-2", "env.potential_tagged must be >= -1 and <= 1, but is -2"),
        ("env.team_share=2", "env.team_share must be >= 0 and <= 1, but is 2"),
        ("curriculum.carrying=1.5", "curriculum.carrying must be >= 0 and <= 1, but is 1.5"),
        ("curriculum.near_flag_m=0", "curriculum.near_flag_m must be > 0, but is 0"),
        ("curriculum.until=-1", "curriculum.until must be >= 0, but is -1"),
    ],
)
def test_wrong_values(word, said):
    with pytest.raises(InputError, match=said):
        checked(composed(word))
