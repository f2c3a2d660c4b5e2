"""How alike a run's members are to its selector, as rows of tables."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from berteam_cli.outcomes import Floats, Ints
from berteam_cli.population import island_of, names, rated
from berteam_cli.selector.embeddings import cosines, groups, mean_cosine, nearest
from berteam_cli.training import Parts, Run

NEIGHBOURS = 5


def likeness(run: Run, parts: Parts, behaviour: Floats) -> dict[str, list[tuple[Any, ...]]]:
    """Returns the rows of embeddings.csv and neighbours.csv of a run whose selector has embeddings.

    Exploiters are left out: the selector never sees them, so their vectors say nothing.

    Args:
        run: as it stands.
        parts: of it.
        behaviour: (N,) aggression of each member, NaN where it is not known.
    """
    islands = parts.optimizer.islands
    selector: Any = parts.selector  # an Embedding
    members = np.flatnonzero(rated(islands))
    similarity = cosines(selector.embeddings(run.selection)[members])
    home = [islands[i] for i in island_of(islands)[members]]
    labels = [x.name for x in home], [x.learner.algorithm for x in home]
    found = groups(*labels, run.population.fitness[members], behaviour[members])
    mean = mean_cosine(similarity, found["all"])
    rows = []
    for name, chosen in found.items():
        size, cosine = int(chosen.sum()), mean_cosine(similarity, chosen)
        rows.append((run.epoch, name, size, size * (size - 1) // 2, cosine, cosine - mean))
    return {"embeddings": rows, "neighbours": list(neighbour_rows(run, parts, members, similarity))}


def neighbour_rows(run: Run, parts: Parts, members: Ints, similarity: Floats) -> Iterator[tuple[Any, ...]]:
    """Returns the rows of neighbours.csv, of ``members`` (K,) and (K, K) how alike they are."""
    called = names(parts.optimizer.islands, run.population)
    for k, others in enumerate(nearest(similarity, NEIGHBOURS)):
        for rank, other in enumerate(others, start=1):
            n, m = members[k], members[other]
            yield run.epoch, n, called[n], rank, m, called[m], similarity[k, other]
