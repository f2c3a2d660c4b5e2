"""From the archive of MAP-Elites to the rows of its tables."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from berteam_cli.optimizer.archive import Archive, occupied, quality
from berteam_cli.optimizer.mapelites import MapElites
from berteam_cli.outcomes import BEHAVIOURS
from berteam_cli.training import Parts, Run

Row = tuple[Any, ...]


def archive_of(parts: Parts) -> Archive | None:
    """Returns the cells that keep members apart, None where nothing does or lambda does."""
    return parts.optimizer.archive if isinstance(parts.optimizer, MapElites) else None


def archive_rows(run: Run, parts: Parts) -> Iterator[Row]:
    """Returns one row for each island."""
    shown = parts.optimizer.fitness.shown(run.population.fitness)
    for island, archive, elites in filled(run, parts):
        cells, full = len(archive.centres), occupied(elites)
        count, best = int(full.sum()), shown[island.members][elites[full]]
        yield (
            *(run.epoch, island.name, cells, count, count / cells, quality(elites, shown[island.members])),
            best.max() if count else math.nan,
        )


def cell_rows(run: Run, parts: Parts) -> Iterator[Row]:
    """Returns one row for each cell of each island, empty ones too."""
    shown = parts.optimizer.fitness.shown(run.population.fitness)
    for island, archive, elites in filled(run, parts):
        for cell, (centre, elite, full) in enumerate(zip(archive.centres, elites, occupied(elites), strict=True)):
            member = island.first + int(elite)
            who = (member, shown[member]) if full else (None, math.nan)
            yield run.epoch, island.name, cell, *placed(parts, centre), *who


def filled(run: Run, parts: Parts) -> Iterator[tuple[Any, Archive, Any]]:
    """Returns each island that is rated with the archive and (C,) its fittest of each cell, counted within it."""
    optimizer = parts.optimizer
    if isinstance(optimizer, MapElites) and optimizer.archive is not None:
        for island in (x for x in optimizer.islands if not x.exploits):
            yield island, optimizer.archive, optimizer.cells(run.population, island, optimizer.archive)[1]


def placed(parts: Parts, centre: Any) -> list[float]:
    """Returns (D,) the middle of a cell, NaN for behaviours that it does not tell apart."""
    known = dict(zip(getattr(parts.optimizer, "behaviours", ()), centre.tolist(), strict=True))
    return [known.get(name, math.nan) for name in BEHAVIOURS]
