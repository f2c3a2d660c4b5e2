"""berteam replay: one game as a page or a GIF, of a trained run's members or of the fixed policies."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from berteam_cli import build, checkpoint
from berteam_cli.acting import Policies, fixed_policies, joined
from berteam_cli.command.inspect import read_table
from berteam_cli.config import checked
from berteam_cli.config_commands import ReplayConfig
from berteam_cli.env.base import Env
from berteam_cli.env.mctf import Mctf
from berteam_cli.errors import InputError, RunError, did_you_mean
from berteam_cli.folder import new_folder, read_manifest, write_whole
from berteam_cli.games import Games, pairings
from berteam_cli.outcomes import Experience, Ints, Outcomes
from berteam_cli.population import names, policies
from berteam_cli.quiet import written
from berteam_cli.stored import stored_config
from berteam_cli.terminal import end, say
from berteam_cli.trust import trusted
from berteam_cli.workers import Workers
from mctf.film import Film, filmed, result
from mctf.kernel import RUNNING
from mctf.page import write_page
from mctf.render import clock, write_gif
from mctf.rules import BLUE, RED
from mctf.state import CAPTURES, GRABS

Team = list[int]


@dataclass(frozen=True)
class Match:
    """Who plays in the film.

    Attributes:
        env: the game.
        policies: how the players act.
        names: of the players.
        called: how each player is named on the command line: members of a run and fixed policies alone by index,
            fixed policies beside members by name.
        blue, red: players of each team, place by place.
        title: what is played.
    """

    env: Mctf
    policies: Policies
    names: list[str]
    called: list[str]
    blue: Team
    red: Team
    title: str


def replay(config: ReplayConfig, text: str, out: Path | None) -> float:
    """Plays a game and writes it as configured; returns NaN, having no figure to tell.

    Args:
        config: checked.
        text: the same as yaml, which a film does not keep.
        out: file to write, with or without its ending; None has it beside the run.

    Raises:
        InputError: the config does not go together, or a file is in the way.
        RunError: the game did not come out the same when it was played again.
    """
    match = players(config)
    files = places(config, match, out)
    outcomes, experience = played(match, config.seed)
    film = checked_film(match.env, outcomes, experience)
    steering = [label(match, member) for member in match.blue + match.red]
    for kind, path in files.items():
        if kind == "html":
            write_whole(path, lambda part: write_page(film, part, steering, match.title))
        else:
            write_whole(path, lambda part: write_gif(film, part))
    say(f"{match.title}.")
    say(ending(film))
    first = next(iter(files.values()))
    written(first)
    end(first.parent, [path.name for path in files.values()], f"open {first} in a browser")
    return math.nan


def players(config: ReplayConfig, overridden: Collection[str] = ()) -> Match:
    """Returns who plays.

    Args:
        config: checked.
        overridden: keys that the command line gave.

    Raises:
        InputError: the config does not go together, or there is no such run.
        RunError: the run has no checkpoint.
    """
    if config.run is None:
        return of_fixed_policies(config)
    for key in overridden:
        if key.split(".", maxsplit=1)[0] in {"env", "team_size"}:
            raise InputError(f"{key} has no effect with run={config.run}, whose game and team size are taken.")
    return of_run(config, Path(config.run))


def of_fixed_policies(config: ReplayConfig) -> Match:
    """Returns two teams of fixed policies.

    Raises:
        InputError: a team is not named, or is none.
    """
    game = filmable(build.env(config.env, config.team_size))
    named = list(game.fixed_policies)
    for key, given in (("blue", config.blue), ("red", config.red)):
        if given is None:
            raise InputError(
                f"{key} must name a team when no run is given, "
                f"such as {key}={example(sizes(game)[0])}, which is {named[0]} first."
            )
    blue, red = (
        team(key, str(given), size, len(named), {name: k for k, name in enumerate(named)})
        for key, given, size in zip(("blue", "red"), (config.blue, config.red), sizes(game), strict=True)
    )
    called = [str(k) for k in range(len(named))]
    title = f"Fixed policies: {versus(blue, red, named, called)}, seed {config.seed}"
    return Match(game, fixed_policies(range(len(named))), named, called, blue, red, title)


def of_run(config: ReplayConfig, folder: Path) -> Match:
    """Returns two teams of members or fixed policies, acting as in evaluations; by default the strongest of the run.

    Raises:
        InputError: there is no such run, or no such team in it.
        RunError: it has no checkpoint.
    """
    read_manifest(folder)
    parts = build.parts_to_read(checked(stored_config(folder, trusted(config.trust))), folder)
    game = filmable(parts.games.env)
    run = checkpoint.load(folder, parts).run
    population, islands = run.population, parts.optimizer.islands
    given = strongest(folder, config.blue, config.red)
    fixed = list(game.fixed_policies)
    blue, red = (
        team(key, text, size, population.size, {name: population.size + k for k, name in enumerate(fixed)})
        for key, text, size in zip(("blue", "red"), given, sizes(game), strict=True)
    )
    named = names(islands, population) + fixed
    called = [*map(str, range(population.size)), *fixed]
    acting = joined([policies(islands, population, explore=False), fixed_policies(range(len(fixed)))])
    title = f"{folder} after epoch {run.epoch}: {versus(blue, red, named, called)}, seed {config.seed}"
    return Match(game, acting, named, called, blue, red, title)


def filmable(game: Env) -> Mctf:
    """Returns ``game`` if it can be filmed.

    Raises:
        InputError: it cannot.
    """
    if not isinstance(game, Mctf):
        raise InputError(f"Only games of env=mctf and env=mctf_2025 can be filmed, but this one is env={game.name}.")
    return game


def sizes(game: Mctf) -> tuple[int, int]:
    """Returns how many members blue and red have."""
    return game.rules.blue_size, game.rules.red_size


def strongest(folder: Path, blue: str | None, red: str | None) -> tuple[str, str]:
    """Returns the teams given, and for one that is not the strongest rated team that is not its opponent.

    Raises:
        InputError: too few teams were rated.
    """
    if blue is not None and red is not None:
        return blue, red
    table = read_table(folder, "elo")
    rated = [] if table is None else list(table.sort_values("rank", kind="stable").team)

    def best_but(opponent: str | None, key: str) -> str:
        other = sorted((opponent or "").split("-"))  # whose members may be named in any order
        free = [name for name in rated if sorted(name.split("-")) != other]
        if not free:
            raise InputError(
                f"{folder} has rated too few teams to choose one (with evaluation.games=0 none); name both, such as "
                f"blue={example(2)} red={example(2)}."
            )
        return free[0]

    blue = best_but(red, "blue") if blue is None else blue
    return blue, best_but(blue, "red") if red is None else red


def team(key: str, given: str, size: int, members: int, fixed: Mapping[str, int]) -> Team:
    """Returns the players that ``given`` names, place by place.

    Args:
        key: of the config, for the message.
        given: indices or names of fixed policies, joined by hyphens.
        size: how many they must be.
        members: how many have an index.
        fixed: the players that have a name.

    Raises:
        InputError: they are not as many, or one does not exist.
    """
    words = given.split("-")
    if len(words) != size:
        raise InputError(
            f"{key} must be {size} members joined by hyphens, such as {example(size)}, but {given!r} is {len(words)}."
        )
    found = []
    for word in words:
        if word in fixed:
            found.append(fixed[word])
        elif word.isdecimal() and int(word) < members:
            found.append(int(word))
        else:
            raise InputError(
                f"A member of {key} must be one of 0 to {members - 1}, or {', '.join(sorted(fixed))}, "
                f"but is {word!r}.{did_you_mean(word, fixed)}"
            )
    return found


def example(size: int) -> str:
    """Returns a team as it may be given."""
    return "-".join(str(member % 7) for member in range(size))


def hyphenated(members: Team, called: list[str]) -> str:
    """Returns a team with its members in their places."""
    return "-".join(called[member] for member in members)


def versus(blue: Team, red: Team, named: list[str], called: list[str]) -> str:
    """Returns who plays whom, as they are called and by name."""
    sides = (f"{hyphenated(side, called)} ({' + '.join(named[member] for member in side)})" for side in (blue, red))
    return "blue {} against red {}".format(*sides)


def label(match: Match, player: int) -> str:
    """Returns what stands beside a vehicle's name in a film."""
    called, name = match.called[player], match.names[player]
    return name if called == name else f"{called} {name}"


def places(config: ReplayConfig, match: Match, out: Path | None) -> dict[str, Path]:
    """Returns the file of each format that is wanted.

    Raises:
        InputError: its name does not go with the format, or it exists and may not be overwritten.
    """
    kinds = ("html", "gif") if config.format == "both" else (config.format,)
    if out is None:
        folder = new_folder("replay") if config.run is None else Path(config.run) / "replay"
        out = folder / f"{hyphenated(match.blue, match.called)}_{hyphenated(match.red, match.called)}"
    elif out.suffix in {".html", ".gif"}:
        if kinds != (out.suffix[1:],):
            raise InputError(
                f"out={out} does not go with format={config.format}; name the other format or leave its ending away."
            )
        out = out.with_suffix("")
    files = {kind: out.with_name(f"{out.name}.{kind}") for kind in kinds}
    for path in files.values():
        if path.exists() and config.on_exists != "overwrite":
            raise InputError(f"{path} exists already; name another file with out=FILE, or say on_exists=overwrite.")
    return files


def played(match: Match, seed: int, count: int = 1) -> tuple[Outcomes, Experience]:
    """Returns ``count`` games, with what everybody did in them; ``seed`` is of the players' chance."""
    games = Games(match.env, Workers(1))
    lineups = pairings(np.array([match.blue] * count), np.array([match.red] * count))
    return games.play(match.policies, lineups, seed, record=True)


def checked_film(game: Mctf, outcomes: Outcomes, experience: Experience, i: int = 0) -> Film:
    """Returns game ``i`` of ``outcomes``, played again from its actions.

    Raises:
        RunError: it did not come out the same.
    """
    actions = experience.actions[i, :, : outcomes.steps[i]].T
    try:
        film = filmed(actions, game.rules, int(outcomes.seeds[i]))
    except ValueError as error:
        raise RunError(f"The game did not come out the same when it was played again: {error}") from error
    counted: Ints = np.stack([outcomes.event("captures")[i], outcomes.event("grabs")[i]])
    again = film.score[-1][:, [CAPTURES, GRABS]].T
    if film.end == RUNNING or not np.array_equal(again, counted):
        raise RunError(
            f"The game did not come out the same when it was played again: captures and grabs were "
            f"{counted.tolist()}, then {again.tolist()} after {len(actions)} steps. No film was written."
        )
    return film


def ending(film: Film) -> str:
    """Returns how a game ended, in words."""
    blue, red = (int(film.score[-1, side, CAPTURES]) for side in (BLUE, RED))
    return f"{result(film)}, {blue} to {red}, after {clock(film.time[-1])} ({len(film.time) - 1} steps)."
