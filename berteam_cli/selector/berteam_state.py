"""All that BERTeam learnt, and as the tensors of a checkpoint."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import torch

from berteam_cli.selector import updates
from berteam_cli.selector.updates import Learnt
from berteam_cli.selector.winners import Examples, Winners
from berteam_cli.tensors import below


@dataclass(frozen=True)
class BerteamState:
    """All that BERTeam learnt.

    Attributes:
        learnt: weights and Adam's memory of the network, or of one for each side.
        winners: the teams it learns from, in one ring or in one for each side.
        epochs: how many it has seen.
    """

    learnt: tuple[Learnt, ...]
    winners: tuple[Winners, ...]
    epochs: int

    def tensors(self) -> dict[str, Any]:
        """Returns all of it as named tensors, without copies."""
        named: dict[str, Any] = {"epochs": torch.tensor(self.epochs)}
        for k, learnt in enumerate(self.learnt):
            named |= {f"learnt.{k}.{name}": value for name, value in learnt.tensors().items()}
        for k, ring in enumerate(self.winners):
            named |= {f"winners.{k}.{x.name}": torch.from_numpy(getattr(ring.held, x.name)) for x in fields(Examples)}
            named[f"winners.{k}.pushed"] = torch.tensor(ring.pushed)
        return named


def restored(tensors: dict[str, Any], device: str) -> BerteamState:
    """Returns the state that ``tensors`` gave these, its networks on ``device``."""
    learnt: list[Learnt] = []
    rings: list[Winners] = []
    while part := below(tensors, f"learnt.{len(learnt)}."):
        learnt.append(updates.restored(part, device))
    while part := below(tensors, f"winners.{len(rings)}."):
        held = Examples(*(part[x.name].cpu().numpy() for x in fields(Examples)))
        rings.append(Winners(held, int(part["pushed"])))
    return BerteamState(tuple(learnt), tuple(rings), int(tensors["epochs"]))
