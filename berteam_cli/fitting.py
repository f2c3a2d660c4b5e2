"""Whether what a checkpoint holds fits its run. Compiled games look at no bounds, so this is looked at before them."""

from __future__ import annotations

from typing import Any

import numpy as np

from berteam_cli.acting import DEEPEST, FIXED, GREEDY, SAMPLED, Policies
from berteam_cli.env.base import Env
from berteam_cli.learner.traits import TRAITS
from berteam_cli.outcomes import BEHAVIOURS, OPEN
from berteam_cli.population import ARRAYS, policies
from berteam_cli.training import Parts, Run

FLOATS = ("fitness", "behaviour", "traits", "pay")
KINDS = dict.fromkeys(ARRAYS, np.int64) | {"stale": np.bool_} | dict.fromkeys(FLOATS, np.float64)
MEMBERS = ("teams", "found", "candidates", "choice")
"""Last words of the names of a selector's tensors that hold members."""


def check_said(said: Any) -> None:
    """Checks what state.json says.

    Raises:
        ValueError: it is no such thing.
    """
    counts = {"epoch": said["epoch"], "played": said["played"], "steps": said["steps"], **said["table_sizes"]}
    for name, count in counts.items():
        if type(count) is not int or not 0 <= count < 2**63:
            raise ValueError(f"its {name} is no number of them")
    if type(said["seconds"]) not in {int, float}:
        raise ValueError("its seconds are no number")


def check_run(run: Run, parts: Parts) -> None:
    """Checks the state of a run.

    Raises:
        ValueError: it does not fit the run's parts.
    """
    islands = parts.optimizer.islands
    members = sum(island.size for island in islands)
    for island, mind in zip(islands, run.population.minds, strict=True):
        if len(island.learner.names(mind, island.name)) != island.size:
            raise ValueError(f"its island {island.name} has not {island.size} members")
    axes = {"behaviour": (len(BEHAVIOURS),), "traits": (len(TRAITS),), "pay": (len(parts.optimizer.terms),)}
    for name, kind in KINDS.items():
        array = getattr(run.population, name)
        if array.dtype != kind or array.shape != (members, *axes.get(name, ())):
            raise ValueError(f"its {name} are not of {members} members: {array.dtype} of shape {array.shape}")
    check_policies(policies(islands, run.population, explore=False), parts.games.env)
    for snapshot in run.league.pool if run.league else ():
        check_policies(snapshot.policies, parts.games.env)
        if not (snapshot.epoch >= 0 and (snapshot.members >= 0).all() and (snapshot.members < members).all()):
            raise ValueError("its pool names members that there are not")
    if run.league and [x.island for x in run.league.attempts] != [k for k, x in enumerate(islands) if x.exploits]:
        raise ValueError("its exploiters are of other islands")
    for name, tensor in parts.selector.tensors(run.selection).items():
        if name.rpartition(".")[2] in MEMBERS and tensor.numel() and not OPEN <= tensor.min() <= tensor.max() < members:
            raise ValueError(f"its selector.{name} names members that there are not")


def check_policies(table: Policies, game: Env) -> None:
    """Checks that compiled games can read how everybody acts.

    Raises:
        ValueError: they cannot.
    """
    rows, sizes = len(table.kind), table.sizes.astype(np.int64)
    shapes = [column.shape for column in table]
    if shapes != [(rows,), (rows,), (rows, DEEPEST + 2), (rows,), (rows,), (rows, *shapes[-2][1:]), (rows, 0)]:
        raise ValueError("its policies are not as many everywhere")
    fixed, network = table.kind == FIXED, np.isin(table.kind, (SAMPLED, GREEDY))
    widths = sizes[np.arange(rows), np.maximum((sizes > 0).sum(axis=1) - 1, 0)]  # of the last layers
    weights = ((sizes[:, :-1] + 1) * sizes[:, 1:]).sum(axis=1)
    fits = (sizes >= 0).all(axis=1) & (sizes[:, 0] == game.observation_size) & (widths == game.actions)
    fits &= weights <= table.weights.shape[1]
    known = (table.fixed >= 0) & (table.fixed < len(game.fixed_policies))
    if not ((fixed & known) | (network & fits)).all():
        raise ValueError("some of its policies are none of this game")
