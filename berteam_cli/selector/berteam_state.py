"""All that BERTeam learnt, and as the tensors of a checkpoint."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import torch

from berteam_cli.selector.updates import Learnt
from berteam_cli.selector.winners import Examples, Winners

KINDS = ("weights", "means", "squares", "averages")  # of tensors in Learnt


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
            for kind in KINDS:
                named |= {f"learnt.{k}.{kind}.{name}": value for name, value in getattr(learnt, kind).items()}
            named[f"learnt.{k}.steps"] = torch.tensor(learnt.steps)
        for k, ring in enumerate(self.winners):
            named |= {f"winners.{k}.{x.name}": torch.from_numpy(getattr(ring.held, x.name)) for x in fields(Examples)}
            named[f"winners.{k}.pushed"] = torch.tensor(ring.pushed)
        return named


def restored(tensors: dict[str, Any], device: str) -> BerteamState:
    """Returns the state that ``tensors`` gave these, its networks on ``device``."""
    learnt: list[Learnt] = []
    rings: list[Winners] = []
    while part := below(tensors, f"learnt.{len(learnt)}."):
        kinds = {kind: {name: x.to(device) for name, x in below(part, f"{kind}.").items()} for kind in KINDS}
        learnt.append(Learnt(**kinds, steps=int(part["steps"])))
    while part := below(tensors, f"winners.{len(rings)}."):
        held = Examples(*(part[x.name].cpu().numpy() for x in fields(Examples)))
        rings.append(Winners(held, int(part["pushed"])))
    return BerteamState(tuple(learnt), tuple(rings), int(tensors["epochs"]))


def below(named: dict[str, Any], prefix: str) -> dict[str, Any]:
    """Returns what has a name that begins with ``prefix``, without it."""
    return {name.removeprefix(prefix): value for name, value in named.items() if name.startswith(prefix)}
