"""From the config of an optimizer to what its copies differ by and what keeps members apart."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from berteam_cli.env.base import Env, Spatial, Weighing
from berteam_cli.errors import InputError
from berteam_cli.founding import check_policies
from berteam_cli.learner.breeding import Breedable
from berteam_cli.learner.traits import TRAITS, Tunable
from berteam_cli.optimizer.aggression import opponents
from berteam_cli.optimizer.archive import Archive, grid, voronoi
from berteam_cli.optimizer.breeding import Breeding
from berteam_cli.optimizer.perturbing import Perturbation
from berteam_cli.outcomes import BEHAVIOURS, Ints
from berteam_cli.population import Island
from berteam_cli.selector.base import team_count
from berteam_cli.training import ARCHIVE, generator

MOST_CELLS = 10_000
MOST_TEAMS = 100_000
UNMOVED = {"learning_rate": 0.0, "entropy_coef": 0.0, "gamma": 1.0}
"""Values that no factor moves."""


def breeding(settings: dict[str, Any], islands: tuple[Island, ...], game: Env) -> Breeding:
    """Takes ``perturb``, ``mutation`` and ``crossover`` out of ``settings``; returns in what copies differ.

    Exploiters, of whom there are no copies, need not be able to.

    Raises:
        InputError: a learner or the game cannot do it, or there are no copies.
    """
    factors = settings.pop("perturb")
    bred = {name: settings.pop(name) for name in ("mutation", "crossover")}
    asked = [f"perturb.{name}" for name in factors if factors[name] > 1] + [name for name in bred if bred[name] > 0]
    if asked and settings["replacements"] == 0:
        raise InputError(f"optimizer.{asked[0]} has no effect with optimizer.replacements=0, where nobody is copied.")
    copied = tuple(island for island in islands if not island.exploits)
    for name in TRAITS:
        if factors[name] > 1:
            check_trait(name, copied)
    for name, value in bred.items():
        for island in copied if value > 0 else ():
            if not isinstance(island.learner, Breedable):
                raise InputError(
                    f"optimizer.{name} must be 0 with the island {island.name}, as its learner "
                    f"({island.learner.algorithm}) is neither learner=ppo nor learner=dqn, but is {value:g}."
                )
    weights = weights_of(game) if factors["reward"] > 1 else {}
    weighed = tuple(k for k, weight in enumerate(weights.values()) if weight)
    moved = Perturbation(tuple(factors[name] for name in TRAITS), factors["reward"], tuple(weights), weighed)
    return Breeding(moved, **bred)


def check_trait(name: str, islands: tuple[Island, ...]) -> None:
    """Checks that some member's ``name``, one of TRAITS, can be perturbed.

    Raises:
        InputError: no learner has it, or a factor does not move it.
    """
    key = f"optimizer.perturb.{name}"
    able = [x.learner for x in islands if isinstance(x.learner, Tunable) and name in x.learner.own_traits]
    if not able:
        learners = "learner=ppo" if name == "entropy_coef" else "learner=ppo or learner=dqn"
        raise InputError(f"{key} must be 1 unless an island has {learners}, as nobody else has a {name} of its own.")
    if all(getattr(learner, name) == UNMOVED[name] for learner in able):
        raise InputError(
            f"{key} must be 1 while learner.{name} is {UNMOVED[name]:g} on all islands: no factor moves it."
        )


def weights_of(game: Env) -> dict[str, float]:
    """Returns the weights of the game's reward.

    Raises:
        InputError: it has none.
    """
    weights = game.reward_weights if isinstance(game, Weighing) else {}
    if not any(weights.values()):
        raise InputError(
            f"optimizer.perturb.reward must be 1 where the reward has no weights, as that of env={game.name} here; "
            "env.reward=custom_rew2 of env=mctf has some."
        )
    return weights


def niches(settings: dict[str, Any], team_size: int, game: Env, seed: int) -> dict[str, Any]:
    """Takes what tells members apart out of ``settings``; returns it as MapElites has it.

    Raises:
        InputError: a behaviour cannot be measured, or a range or a number of cells is wrong.
    """
    names = settings.pop("behaviours")
    check_behaviours(names, team_size, game)
    scales, bins, ranges = (settings.pop(x) for x in ("behaviour_scales", "archive_bins", "archive_ranges"))
    kind, cells = settings.pop("archive"), settings.pop("archive_cells")
    made: Archive | None = None
    if kind != "none":
        if settings["lambda_growth"] > 1:
            raise InputError(
                f"optimizer.lambda_growth must be 1 with optimizer.archive={kind}, which has no lambda, "
                f"but is {settings['lambda_growth']:g}."
            )
        low, high = np.array([checked_range(name, ranges[name]) for name in names]).T
        if kind == "grid":
            count = math.prod(bins[name] for name in names)
            if count > MOST_CELLS:
                raise InputError(f"optimizer.archive_bins must give at most {MOST_CELLS} cells, but give {count}.")
            made = grid(low, high, np.array([bins[name] for name in names]))
        else:
            made = voronoi(low, high, cells, generator(seed, ARCHIVE))
    return {"behaviours": tuple(names), "scales": np.array([scales[name] for name in names]), "archive": made}


def measured_by(names: list[str], team_size: int, game: Env) -> Ints:
    """Returns (J, T) the teams of fixed policies ``names``, none meaning the standard ones, that members meet.

    Raises:
        InputError: a name is none of the game's, or they are too many.
    """
    names = names or list(game.fixed_policies[: game.standard_policies])
    check_policies(names, game, "optimizer.opponents, or optimizer.opponents=[] for the standard ones,")
    count = team_count(len(names), team_size)
    if count > MOST_TEAMS:
        raise InputError(
            f"optimizer.opponents must make at most {MOST_TEAMS:,} teams of team_size={team_size}, as a member meets "
            f"each when it is measured, but its {len(names)} policies make {count:,}; name fewer."
        )
    return opponents(tuple(game.fixed_policies.index(name) for name in names), team_size)


def check_behaviours(names: list[str], team_size: int, game: Env) -> None:
    """Checks that the behaviours ``names`` can be measured.

    Raises:
        InputError: they cannot.
    """
    if not names or len(set(names)) < len(names):
        raise InputError(f"optimizer.behaviours must name one of {', '.join(BEHAVIOURS)}, or some once each: {names}.")
    measured = ("aggression", *(game.habits if isinstance(game, Spatial) else ()))
    for name in names:
        if name not in BEHAVIOURS:
            raise InputError.choice("optimizer.behaviours", name, BEHAVIOURS)
        if name not in measured:
            raise InputError(f"optimizer.behaviours must be [aggression] with env={game.name}, which has no positions.")
    if "spread" in names and team_size < 2:
        raise InputError("optimizer.behaviours must not have spread with team_size=1, as there are no team-mates.")


def checked_range(name: str, given: list[float]) -> list[float]:
    """Returns lowest and highest of a behaviour.

    Raises:
        InputError: they are not two numbers, the lower first.
    """
    if len(given) != 2 or not (np.isfinite(given).all() and given[0] < given[1]):
        raise InputError(
            f"optimizer.archive_ranges.{name} must be [lowest, highest], two numbers, the lower first, but is {given}."
        )
    return given
