"""Tensors by name, as checkpoints hold them."""

from __future__ import annotations

from collections.abc import Mapping

from torch import Tensor


def below(named: Mapping[str, Tensor], prefix: str) -> dict[str, Tensor]:
    """Returns the tensors whose names begin with ``prefix``, without it."""
    return {name.removeprefix(prefix): tensor for name, tensor in named.items() if name.startswith(prefix)}
