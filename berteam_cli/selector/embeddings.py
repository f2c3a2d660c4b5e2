"""How alike a selector takes members to be, by the vectors it has learnt for them (paper, Section 5, Table 2)."""

from __future__ import annotations

from typing import Protocol, TypeVar, runtime_checkable

import numpy as np

from berteam_cli.outcomes import Bools, Floats, Ints

S_contra = TypeVar("S_contra", contravariant=True)


@runtime_checkable
class Embedding(Protocol[S_contra]):
    """A selector that has a vector for each member."""

    def embeddings(self, state: S_contra) -> Floats:
        """Returns (N, width) the vector of each member."""


def cosines(vectors: Floats) -> Floats:
    """Returns (N, N) the cosine of the angle between each two of the (N, width) ``vectors``, none of them zero."""
    directions = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.clip(directions @ directions.T, -1.0, 1.0)


def mean_cosine(similarity: Floats, chosen: Bools) -> float:
    """Returns the mean of ``similarity`` over all pairs of two different ``chosen`` members, NaN without any.

    Over all members it is also what a random subset of any size has on average (paper, appendix on it).

    Args:
        similarity: (N, N), symmetric.
        chosen: (N,).
    """
    among = similarity[np.ix_(chosen, chosen)]
    first, second = np.triu_indices(len(among), 1)
    return float(among[first, second].mean()) if len(first) else float("nan")


def nearest(similarity: Floats, count: int) -> Ints:
    """Returns (N, k) the ``count`` other members most like each, or all where they are fewer, the likest first."""
    others = similarity.copy()
    np.fill_diagonal(others, -np.inf)
    return np.argsort(-others, axis=1, kind="stable")[:, : min(count, len(others) - 1)]


def groups(islands: list[str], algorithms: list[str], fitness: Floats, behaviour: Floats) -> dict[str, Bools]:
    """Returns the groups of members whose likeness is looked at, each as (N,), none of them empty.

    All; each island and each algorithm, where there are several; aggressive and defensive; strong and weak; and both.

    Args:
        islands: (N,) name of each member's island.
        algorithms: (N,) name of each member's algorithm.
        fitness: (N,) on any scale; strong is who is above its mean.
        behaviour: (N,) aggression; above 1 is aggressive, below defensive, NaN neither.
    """
    found = {"all": np.ones(len(fitness), dtype=np.bool_)}
    for kind, named in (("island", islands), ("algorithm", algorithms)):
        values = list(dict.fromkeys(named))
        if len(values) > 1:
            found |= {f"{kind} {value}": np.array([name == value for name in named]) for value in values}
    manner = {"aggressive": behaviour > 1, "defensive": behaviour < 1}
    strength = {"strong": fitness > fitness.mean(), "weak": fitness < fitness.mean()}
    both = {f"{x} {y}": strength[x] & manner[y] for y in manner for x in strength}
    found |= manner | strength | both
    return {name: members for name, members in found.items() if members.any()}
