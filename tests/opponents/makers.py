"""Small runs with other opponents."""

from functools import cache

from berteam_cli import build
from berteam_cli.config import checked
from tests.test_config import composed

RPS = ["env=rps", "selector=uniform", "games_per_epoch=12", "optimizer.protect_new=0"]
ONE = ("population=ppo6", "learner.n_steps=8", "learner.minibatch_size=4")
FOUR = ("population=islands4x3", *(f"population.islands.dqn{x}.learner.buffer_size=500" for x in (64, 96)))
EXPLOITERS = ["opponents=league", "opponents.exploiters=[ppo96,dqn64]", "opponents.exploit_share=0.5"]


@cache
def parts(*overrides, population=ONE):
    """Returns the parts of a run, which keep nothing of those who use them."""
    return build.parts(checked(composed(*RPS, *population, *overrides)))
