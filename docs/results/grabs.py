"""Prints what becomes of the flags a team grabs: python docs/results/grabs.py RUN BLUE RED GAMES.

BLUE and RED are teams as in ``berteam replay``. A row is for grabs with the nearest opponent so far away; its columns
tell those when that opponent could tag from those when it had tagged somebody and had to wait.
"""

from __future__ import annotations

import sys
from typing import NamedTuple

import numpy as np
import pandas as pd
from tables import markdown

from berteam_cli.command.replay import Match, checked_film, played, players
from berteam_cli.config_commands import ReplayConfig
from mctf.film import Film

LOST = ("lost_by_tag", "lost_by_wall")
FAR_M = [0.0, 10.0, 12.0, 13.0, 14.0, np.inf]


class Grab(NamedTuple):
    """A flag that blue grabbed.

    Attributes:
        far_m: to the nearest opponent, which may tag within 10 m.
        waits: whether that opponent had to wait before it could tag again.
        home: whether the flag came home.
        lost_s: after how many seconds it was lost; NaN if it was not.
    """

    far_m: float
    waits: bool
    home: bool
    lost_s: float


def grabs(film: Film) -> list[Grab]:
    """Returns the flags that blue grabbed, in the order in which that ended."""
    found, carried = [], {}
    ours, rested = film.rules.blue_size, film.rules.tagging_cooldown_s
    for event in film.events:
        v, frame = event.vehicle, event.frame
        if v >= ours:
            continue
        if event.kind == "grab":
            apart = np.linalg.norm(film.pos[frame, ours:] - film.pos[frame, v], axis=1)
            near = ours + int(np.argmin(apart))
            # Who tags in the very step of the grab could do so.
            could = max(film.cooldown[frame - 1, near], film.cooldown[frame, near]) == rested
            carried[v] = Grab(float(apart.min()), not could, home=False, lost_s=np.nan), frame
        elif event.kind in {"capture", *LOST} and v in carried:
            grab, since = carried.pop(v)
            after = float(film.time[frame] - film.time[since]) if event.kind in LOST else np.nan
            found.append(grab._replace(home=event.kind == "capture", lost_s=after))
    return found + [grab for grab, _ in carried.values()]  # still carried when the time was up


def films(match: Match, games: int) -> list[Film]:
    """Returns ``games`` games of the two teams; 7 seeds their chance."""
    outcomes, experience = played(match, 7, games)
    return [checked_film(match.env, outcomes, experience, i) for i in range(games)]


def table(found: list[Grab]) -> pd.DataFrame:
    """Returns a row for each distance of FAR_M."""
    given = pd.DataFrame(found, columns=Grab._fields)
    given["far"] = pd.cut(given.far_m, FAR_M, right=False)
    said = {}
    for waits, when in ((False, "it may tag"), (True, "it waits")):
        rows = given[given.waits == waits].groupby("far", observed=False)
        said |= {f"{when}: grabs": rows.size(), f"{when}: brought home": rows.home.sum()}
        said[f"{when}: else lost after, s (median)"] = rows.lost_s.median()
    return pd.DataFrame(said).rename_axis("nearest opponent, m")


def shown(found: pd.DataFrame) -> str:
    """Returns the table as Markdown, with nothing where there is no median."""
    return markdown(found.reset_index().map(lambda cell: "" if pd.isna(cell) else str(cell)))


if __name__ == "__main__":
    run, blue, red, games = sys.argv[1:]
    match = players(ReplayConfig(run=run, trust=None, blue=blue, red=red, seed=0))
    print(shown(table([grab for film in films(match, int(games)) for grab in grabs(film)])))
