"""The replay of a run's best team, for the page."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

from berteam_cli.errors import InputError, RunError
from berteam_cli.report.source import Source


@dataclass(frozen=True)
class Replay:
    """A game to watch.

    Attributes:
        title: who plays.
        says: how it ended, or why there is no game.
        page: the whole page that plays it; empty where there is none.
    """

    title: str
    says: str
    page: str = ""


def best_game(source: Source, seed: int) -> Replay:
    """Returns a game of the run's strongest rated team against the second strongest."""
    from berteam_cli.command.replay import Match, checked_film, ending, of_run, played  # noqa: PLC0415 (torch)
    from berteam_cli.config_commands import ReplayConfig  # noqa: PLC0415
    from mctf.page import write_page  # noqa: PLC0415

    title = "A game of the best team"
    if source.elo is None or len(source.elo) < 2:
        return Replay(title, "Fewer than two teams were rated; `berteam replay RUN blue=0-1 red=2-3` plays any two.")
    if not (source.folder / "checkpoint").exists():
        return Replay(title, "There is no checkpoint to play from: only training runs have one.")
    blue, red = source.elo.team[:2]
    try:
        asked = ReplayConfig(run=str(source.folder), trust=source.trust, blue=blue, red=red, seed=seed)
        match: Match = of_run(asked, source.folder)
        film = checked_film(match.env, *played(match, seed))
    except (InputError, RunError) as error:
        return Replay(title, f"No game can be shown: {error}")
    steering = [f"{member} {match.names[member]}" for member in match.blue + match.red]
    with tempfile.TemporaryDirectory() as place:
        path = Path(place) / "game.html"
        write_page(film, path, steering, match.title)
        page = path.read_text(encoding="utf-8")
    return Replay(title, f"{match.title.removeprefix(f'{source.folder} ')}. {ending(film)}", page)
