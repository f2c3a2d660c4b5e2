"""From the config of a population to its islands; the only place that knows which name is which learner."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from berteam_cli.acting import Policies, joined
from berteam_cli.config_commands import TrainConfig
from berteam_cli.config_env import LeagueConfig
from berteam_cli.config_members import IslandConfig, LearnerConfig, MemberConfig
from berteam_cli.env.base import Env
from berteam_cli.env.mctf import Mctf
from berteam_cli.errors import InputError
from berteam_cli.learner.base import Learner
from berteam_cli.learner.dqn import Dqn
from berteam_cli.learner.fixed import Fixed
from berteam_cli.learner.imported import Imported, read
from berteam_cli.learner.ppo import Ppo
from berteam_cli.learner.stacked_dqn import StackedDqn
from berteam_cli.learner.stacked_ppo import StackedPpo
from berteam_cli.learner.zipped import Unfit
from berteam_cli.optimizer.base import Optimizer
from berteam_cli.optimizer.coevolution import Coevolution
from berteam_cli.optimizer.perturbing import GAMMA
from berteam_cli.population import Island

MEMBERS = "members"  # the island of members from files
SB3_GAMMA = 0.99  # of all algorithms of Stable-Baselines3, if it is not given
NO_NAMES = {"na", "nan", "null", "none", "n-a", "other"}  # pandas reads most of these as nothing


def sb3(**settings: Any) -> Learner[Any]:
    """Returns a learner of Stable-Baselines3, on the processor; that library takes seconds to load, and only here."""
    from berteam_cli.learner.sb3 import Sb3  # noqa: PLC0415

    return Sb3(**settings)


LEARNERS: dict[str, Callable[..., Learner[Any]]] = {"ppo": Ppo, "dqn": Dqn, "sb3": sb3}
STACKED_LEARNERS: dict[str, Callable[..., Learner[Any]]] = {"ppo": StackedPpo, "dqn": StackedDqn}


def archipelago(config: TrainConfig, game: Env, device: str, *, stored: bool) -> tuple[Island, ...]:
    """Returns the islands that the config names, one after the other, that of members from files last.

    Raises:
        InputError: there is none, or its learner or a file does not fit.
    """
    islands: list[Island] = []
    exploiters = config.opponents.exploiters if isinstance(config.opponents, LeagueConfig) else []
    for name, settings in config.population.islands.items():
        key = f"population.islands.{name}"
        if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_-]*", name) or name.lower() in NO_NAMES:
            raise InputError(f"{key}: an island's name must be a word that tables can hold, but is {name!r}.")
        first = islands[-1].first + islands[-1].size if islands else 0
        typed = len(config.population.islands) == 1 and settings.learner == config.learner
        of_learner = "learner" if typed else f"{key}.learner"
        if settings.learner.name == "fixed":
            made = fixed_members(settings, game, key, of_learner)
        else:
            made = learner(settings.learner, game, of_learner, device)
        islands.append(Island(name, first, settings.size, made, name in exploiters))
    if members := config.population.members:
        if MEMBERS in config.population.islands:
            raise InputError(
                f"population.islands.{MEMBERS} must have another name: "
                f"the members of population.members are on the island {MEMBERS}."
            )
        first = islands[-1].first + islands[-1].size if islands else 0
        islands.append(Island(MEMBERS, first, len(members), imported_members(members, game, stored=stored)))
    if not islands and config.population.run is None:
        raise InputError(
            "population must have members, but has none: name islands in population.islands, "
            "files in 'population.members=[{file: agent.zip}]', or a run in population.run."
        )
    return tuple(islands)


def imported_members(members: list[MemberConfig], game: Env, *, stored: bool) -> Learner[Any]:
    """Returns the learner of members from files, which are read unless the run is ``stored``.

    Raises:
        InputError: a file holds no policy that can act in this game, or a name is none or is another member's too.
    """
    called: list[str] = []
    for k, member in enumerate(members):
        name, key = member.name or Path(member.file).stem, f"population.members[{k}].name"
        if not re.fullmatch(r"\w[\w.-]*", name, re.ASCII) or name.lower() in NO_NAMES:
            raise InputError(f"{key} must be a word that tables can hold, but is {name!r}; give it another.")
        if name in called:
            raise InputError(f"{key} is {name!r}, as that of member {called.index(name)}; give each a name of its own.")
        called.append(name)
    size = game.observation_size, game.actions
    tables: list[Policies] = []
    for k, member in enumerate([] if stored else members):
        try:
            tables.append(read(Path(member.file), *size, trust=member.trust))
        except Unfit as error:
            raise InputError(f"population.members[{k}].file={member.file} {error}.") from error
    return Imported(tuple(called), *size, None if stored else joined(tables))


def fixed_members(settings: IslandConfig, game: Env, key: str, of_learner: str) -> Learner[Any]:
    """Returns the learner of an island of fixed policies.

    Args:
        settings: of the island.
        game: that is played.
        key: of the island, for messages.
        of_learner: key of its learner's settings, for messages.

    Raises:
        InputError: a policy is not the game's, or they are not as many as the island has members.
    """
    names = list(settings.learner.policies)  # type: ignore[attr-defined]
    check_policies(names, game, f"{of_learner}.policies")
    if not names:
        raise InputError(
            f"{of_learner}.policies must name {settings.size} of {', '.join(game.fixed_policies)}, one for each "
            f"member, but is empty."
        )
    if len(names) != settings.size:
        raise InputError(
            f"{key}.size must be {len(names)}, as {of_learner}.policies names so many, but is {settings.size}."
        )
    return Fixed(tuple(game.fixed_policies.index(x) for x in names), game.fixed_policies)


def check_policies(names: list[str], game: Env, key: str) -> None:
    """Checks that ``names`` are fixed policies of the game.

    Raises:
        InputError: one is not.
    """
    for name in names:
        if name not in game.fixed_policies:
            raise InputError.choice(f"{key} (with env={game.name})", name, game.fixed_policies)


def learner(config: LearnerConfig, game: Env, key: str, device: str) -> Learner[Any]:
    """Returns a learner of networks.

    Args:
        config: its settings.
        game: what it learns.
        key: of its settings, for messages.
        device: "cpu", where compiled functions learn, or "cuda", where torch does for the learners that can.

    Raises:
        InputError: its settings do not go together.
    """
    if type(config) is LearnerConfig:
        raise InputError(f"{key} must be one of {', '.join(LEARNERS)}: a population's yaml chooses it in its defaults.")
    settings = asdict(config)
    name = settings.pop("name")
    network = settings.pop("network")
    if not 1 <= len(network) <= 6 or not all(1 <= width <= 4096 for width in network):
        raise InputError(f"{key}.network must be 1 to 6 widths from 1 to 4096, but is {network}.")
    check_settings(settings, key)
    made = LEARNERS[name]
    if device != "cpu" and name in STACKED_LEARNERS:
        made, settings["device"] = STACKED_LEARNERS[name], device
    try:
        return made(
            observation_size=game.observation_size,
            actions=game.actions,
            network=tuple(network),
            **settings,
        )
    except ValueError as error:
        raise InputError(f"{key}.{error}") from error


def check_settings(settings: dict[str, Any], key: str) -> None:
    """Checks that the settings of a learner go together.

    Raises:
        InputError: they do not.
    """
    steps, minibatch = settings.get("n_steps"), settings.get("minibatch_size")
    if steps is not None and minibatch is not None and steps % minibatch:
        less, more = steps // minibatch * minibatch, -(-steps // minibatch) * minibatch
        near = f"{less} or {more}" if less else f"{more}"
        raise InputError(
            f"{key}.n_steps must be a multiple of {key}.minibatch_size={minibatch}, such as {near}, but is {steps}."
        )
    if minibatch == 1 and settings["normalize_advantage"]:
        raise InputError(f"{key}.minibatch_size must be >= 2 with {key}.normalize_advantage=true, but is 1.")
    if settings.get("gradient_steps") == 0:
        raise InputError(f"{key}.gradient_steps must be >= 1, or -1 for as many as transitions, but is 0.")


def discounts(optimizer: Optimizer, game: Env) -> list[str]:
    """Returns a remark for each island whose members discount otherwise than the potential in the game's reward."""
    if not isinstance(game, Mctf) or game.reward.shaping.potential == 0:
        return []
    ours, remarks = game.reward.shaping.potential_discount, []
    for island in optimizer.islands:
        learner: Any = island.learner
        gamma = getattr(learner, "gamma", None)
        if gamma is None and hasattr(learner, "options"):
            gamma = learner.options.get("gamma", SB3_GAMMA)
        if gamma is not None and gamma != ours:
            remarks.append(
                f"The potential in the reward changes which policy is best on island {island.name}, as its learner "
                f"discounts by gamma={gamma:g} and env.potential_discount is {ours:g}."
            )
    if isinstance(optimizer, Coevolution) and GAMMA in optimizer.breeding.perturbation.moved:
        remarks.append(
            "The potential in the reward changes which policy is best for copies, as optimizer.perturb.gamma lets them "
            f"discount otherwise than env.potential_discount={ours:g}."
        )
    return remarks
