"""Prints who attacks and who defends: python docs/results/roles.py RUN FIRST [END], two teams of members a game.

For each member, by how much grabs, captures, tags and score of its team rise with it on one of the team's places: the
least squares of what a team came to on how often each member stands in it, over both sides of the games of epochs
FIRST to END - 1.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pandas as pd
from tables import markdown

SIDES = ("blue", "red")
FIGURES = ("grabs", "captures", "tags", "score")


def counted(teams: pd.Series[str]) -> pd.DataFrame:
    """Returns how often each member (columns) stands in each of the ``teams``, whose index ascends."""
    members = teams.str.split("-").explode().astype(int)
    return pd.crosstab(members.index, members)


def roles(games: pd.DataFrame) -> pd.DataFrame:
    """Returns a row for each member: its share of the places, and what it adds to each of FIGURES of its team."""
    places = pd.concat([counted(games[side]) for side in SIDES]).fillna(0).sort_index(axis=1)
    came = pd.concat([games[[f"{side}_{x}" for x in FIGURES]].set_axis(FIGURES, axis=1) for side in SIDES])
    added, *_ = np.linalg.lstsq(places.to_numpy(float), came.to_numpy(float), rcond=None)
    table = pd.DataFrame(added, index=places.columns, columns=FIGURES)
    table.insert(0, "share of places", places.sum() / places.to_numpy().sum())
    return table


def shown(table: pd.DataFrame) -> str:
    """Returns the table as Markdown."""
    return markdown(table.map("{:.2f}".format).rename_axis("member").reset_index().astype(str))


if __name__ == "__main__":
    run, first, *rest = sys.argv[1:]
    games = pd.read_csv(Path(run) / "games.csv")
    end = int(rest[0]) if rest else int(games.epoch.max()) + 1
    print(shown(roles(games[(games.epoch >= int(first)) & (games.epoch < end)])))
