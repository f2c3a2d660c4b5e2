"""From the config of opponents to those who bring them."""

from __future__ import annotations

import numpy as np

from berteam_cli.config_commands import TrainConfig
from berteam_cli.config_env import LeagueConfig, OpponentsConfig, PastConfig, ScriptedConfig
from berteam_cli.env.base import Env
from berteam_cli.errors import InputError
from berteam_cli.founding import check_policies
from berteam_cli.opponents.base import Opponents
from berteam_cli.opponents.exploiters import Exploiters
from berteam_cli.opponents.league import League
from berteam_cli.opponents.none import Nobody
from berteam_cli.opponents.past import Past
from berteam_cli.opponents.scripted import Scripted
from berteam_cli.outcomes import Bools
from berteam_cli.population import Island, learners, rated

SHARES = ("past_share", "scripted_share", "exploit_share")


def opponents(config: TrainConfig, islands: tuple[Island, ...], game: Env, *, learning: bool) -> Opponents:
    """Returns who brings other opponents than the population's teams.

    Args:
        config: checked.
        islands: of the population.
        game: that is played.
        learning: whether members learn.

    Raises:
        InputError: the settings do not go together.
    """
    told = config.opponents
    games = {share: games_of(config, share) for share in SHARES}
    if isinstance(told, LeagueConfig):
        check_exploiters(told, islands)
    if not sum(games.values()):
        return Nobody(game.sides, game.team_size)
    if not learning or not learners(islands):
        raise InputError(
            f"opponents={told.name} needs members that learn from games against them, but with "
            f"optimizer={config.optimizer.name} and this population there are none; use opponents=none."
        )
    if sum(games.values()) >= config.games_per_epoch:
        said = ", ".join(f"opponents.{share}={getattr(told, share)}" for share in SHARES if games[share])
        raise InputError(
            f"{said} must leave at least one game of games_per_epoch={config.games_per_epoch} "
            f"to the population's teams, but take {sum(games.values())}."
        )
    return League(
        islands,
        game.sides,
        game.team_size,
        past(told, games["past_share"], 1 - 1 / game.sides),
        scripted(told, games["scripted_share"], game),
        exploiters(told, games["exploit_share"], islands, 1 - 1 / game.sides),
    )


def games_of(config: TrainConfig, share: str) -> int:
    """Returns how many games of an epoch a share is: the nearest whole number.

    Raises:
        InputError: it is none, though the share is not 0.
    """
    value = getattr(config.opponents, share, 0.0)
    games = int(value * config.games_per_epoch + 0.5)
    if value and not games:
        raise InputError(
            f"opponents.{share} must be 0, or >= {0.5 / config.games_per_epoch:g} to be a game of "
            f"games_per_epoch={config.games_per_epoch}, but is {value:g}."
        )
    return games


def past(told: OpponentsConfig, games: int, prior: float) -> Past | None:
    """Returns the settings of the pool."""
    if not games or not isinstance(told, PastConfig):
        return None
    return Past(
        games=games,
        snapshot_every=told.snapshot_every,
        snapshot_members=told.snapshot_members,
        pool_size=told.pool_size,
        draw=told.draw,
        power=told.power,
        mix_uniform=told.mix_uniform,
        prior_games=told.prior_games,
        half_life=told.half_life,
        prior=prior,
    )


def scripted(told: OpponentsConfig, games: int, game: Env) -> Scripted | None:
    """Returns the settings of scripted opponents.

    Raises:
        InputError: they are none of the game's, or nobody is named.
    """
    if not isinstance(told, ScriptedConfig):
        return None
    check_policies(told.scripted, game, "opponents.scripted")
    if games and not told.scripted:
        raise InputError(
            f"opponents.scripted must name fixed policies with opponents.scripted_share={told.scripted_share:g}, "
            f"some of {', '.join(game.fixed_policies)}, but is empty."
        )
    names = tuple(dict.fromkeys(told.scripted))
    return Scripted(games, tuple(game.fixed_policies.index(x) for x in names), names) if games else None


def exploiters(told: OpponentsConfig, games: int, islands: tuple[Island, ...], prior: float) -> Exploiters | None:
    """Returns the settings of the exploiters."""
    if not games or not isinstance(told, LeagueConfig):
        return None
    return Exploiters(
        games=games,
        islands=tuple(i for i, island in enumerate(islands) if island.exploits),
        epochs=told.exploiter_epochs,
        score=told.exploiter_score,
        prior_games=told.prior_games,
        half_life=told.half_life,
        prior=prior,
    )


def check_exploiters(told: LeagueConfig, islands: tuple[Island, ...]) -> None:
    """Checks that the exploiters are islands that learn, and that others are left.

    Raises:
        InputError: they are not.
    """
    able = {island.name: island.learns for island in islands}
    for name in told.exploiters:
        if name not in able:
            raise InputError.choice("opponents.exploiters", name, able)
        if not able[name]:
            raise InputError(f"opponents.exploiters must name islands whose members learn, but those of {name} do not.")
    if all(island.exploits for island in islands):
        raise InputError(
            f"opponents.exploiters must leave an island to choose teams from, but names all: {', '.join(able)}."
        )
    if bool(told.exploiters) != bool(told.exploit_share):
        asked = "must be > 0 for opponents.exploiters to play" if told.exploiters else "needs opponents.exploiters"
        raise InputError(f"opponents.exploit_share {asked}, but is {told.exploit_share:g}.")


def without_exploiters(valid: Bools | None, islands: tuple[Island, ...], team_size: int) -> Bools | None:
    """Returns (T, N) who may stand at each place: of those ``valid``, or of all, the ones who are no exploiters.

    Raises:
        InputError: a place is left without anybody.
    """
    if not any(island.exploits for island in islands):
        return valid
    free = rated(islands)
    rows = np.tile(free, (team_size, 1)) if valid is None else valid & free
    for place in np.flatnonzero(~rows.any(axis=1)):
        raise InputError(f"selector.valid_members[{place}] must name more than opponents.exploiters.")
    return rows
