"""How alike a run's members are to its selector, as rows of tables."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from berteam_cli.outcomes import Floats
from berteam_cli.population import island_of, names
from berteam_cli.selector.embeddings import cosines, groups, mean_cosine, nearest
from berteam_cli.training import Parts, Run

NEIGHBOURS = 5


def likeness(run: Run, parts: Parts, behaviour: Floats) -> dict[str, list[tuple[Any, ...]]]:
    """Returns the rows of embeddings.csv and neighbours.csv of a run whose selector has embeddings.

    Args:
        run: as it stands.
        parts: of it.
        behaviour: (N,) aggression of each member, NaN where it is not known.
    """
    islands = parts.optimizer.islands
    selector: Any = parts.selector  # an Embedding
    similarity = cosines(selector.embeddings(run.selection))
    home = [islands[i] for i in island_of(islands)]
    labels = [x.name for x in home], [x.learner.algorithm for x in home]
    found = groups(*labels, run.population.fitness, behaviour)
    mean = mean_cosine(similarity, found["all"])
    rows = []
    for name, chosen in found.items():
        size, cosine = int(chosen.sum()), mean_cosine(similarity, chosen)
        rows.append((run.epoch, name, size, size * (size - 1) // 2, cosine, cosine - mean))
    return {"embeddings": rows, "neighbours": list(neighbour_rows(run, parts, similarity))}


def neighbour_rows(run: Run, parts: Parts, similarity: Floats) -> Iterator[tuple[Any, ...]]:
    """Returns the rows of neighbours.csv."""
    called = names(parts.optimizer.islands, run.population)
    for n, others in enumerate(nearest(similarity, NEIGHBOURS)):
        for rank, other in enumerate(others, start=1):
            yield run.epoch, n, called[n], rank, other, called[other], similarity[n, other]
