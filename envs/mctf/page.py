"""A film as a page for the browser: one file that needs nothing else."""

import json
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mctf.film import TEAM_NAMES, Film, home, is_right, result, said, team_of
from mctf.kernel import RUNNING
from mctf.rules import BLUE, RED

CARRIES, IS_TAGGED, CAN_TAG = 1, 2, 4
"""Bits of what page.js reads of a vehicle."""


def write_page(film: Film, path: Path, names: Sequence[str], title: str) -> None:
    """Writes a film as an HTML file that plays it.

    ``#t=120`` behind its address begins at that second, ``#play`` plays at once, ``#t=120&play&speed=4`` does both.

    Args:
        film: one frame or more.
        path: of the file.
        names: (V,) who steers each vehicle; any text.
        title: any text.

    Raises:
        ValueError: there are not as many names as vehicles.
    """
    vehicles = film.pos.shape[1]
    if len(names) != vehicles:
        raise ValueError(f"names must be {vehicles}, one for each vehicle, but are {len(names)}.")
    told = json.dumps(_told(film, names, title), separators=(",", ":"))
    for sign in "<>&":  # nothing in a name can end the script; json.dumps has left no other sign that could
        told = told.replace(sign, f"\\u{ord(sign):04x}")
    page = _part("page.html")
    for place, content in (("STYLE", _part("page.css")), ("SCRIPT", _part("page.js")), ("FILM", told)):
        before, after = page.split(f"/*{place}*/")
        page = before + content + after
    path.write_text(page, encoding="utf-8")


def _part(name: str) -> str:
    return files("mctf").joinpath(name).read_text(encoding="utf-8").rstrip()


def _told(film: Film, names: Sequence[str], title: str) -> dict[str, Any]:
    """Returns what page.js reads: whole numbers, those of the frames as what each adds to the one before."""
    rules = film.rules
    ready = film.cooldown >= rules.tagging_cooldown_s
    can_tag = ready & film.on_own_side & ~film.is_tagged
    status = CARRIES * film.has_flag + IS_TAGGED * film.is_tagged + CAN_TAG * can_tag
    return {
        "title": title,
        "names": list(names),
        "teams": [team_of(v, rules) for v in range(len(names))],
        "field": [rules.width_m, rules.height_m],
        "homes": [home(team, rules) for team in (BLUE, RED)],
        "right": TEAM_NAMES[BLUE if is_right(BLUE, rules) else RED],
        "keepout": rules.flag_keepout_m,
        "reach": rules.catch_radius_m,
        "step": rules.substeps * rules.tau_s,
        "limit": rules.max_time_s,
        "frames": len(film.pos),
        "result": "" if film.end == RUNNING else result(film),
        "pos": _steps(film.pos * 100.0),  # cm
        "heading": _steps(film.heading),  # deg
        "status": _steps(status),
        "waited": _steps(film.cooldown / rules.tagging_cooldown_s * 100.0),  # per cent
        "score": _steps(film.score),
        "events": [
            [event.frame, team_of(event.vehicle, rules), event.kind, said(event, rules)] for event in film.events
        ],
    }


def _steps(values: NDArray[Any]) -> list[int]:
    whole = np.rint(values).astype(np.int64).reshape(len(values), -1)
    return np.diff(whole, axis=0, prepend=np.zeros_like(whole[:1])).ravel().tolist()
