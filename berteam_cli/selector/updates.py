"""Gradient steps on a network, from one frozen set of weights to the next."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.random import Generator
from torch import Tensor, nn
from torch.func import functional_call

from berteam_cli.selector.network import seeded
from berteam_cli.tensors import below

KINDS = ("weights", "means", "squares", "averages")  # of tensors in Learnt


@dataclass(frozen=True)
class Learnt:
    """A network's weights and what Adam remembers of their gradients, by parameter name.

    Attributes:
        weights: the parameters.
        means: Adam's running mean of the gradient of each.
        squares: Adam's running mean of its square.
        steps: Adam's steps so far.
        averages: running means of the parameters; empty where none are kept.
    """

    weights: dict[str, Tensor]
    means: dict[str, Tensor]
    squares: dict[str, Tensor]
    steps: int
    averages: dict[str, Tensor]

    @property
    def used(self) -> dict[str, Tensor]:
        """What teams are chosen with: the averages, or the newest parameters where none are kept."""
        return self.averages or self.weights

    def tensors(self) -> dict[str, Tensor]:
        """Returns all of it as named tensors, without copies."""
        named = {f"{kind}.{name}": value for kind in KINDS for name, value in getattr(self, kind).items()}
        return named | {"steps": torch.tensor(self.steps)}


def restored(tensors: dict[str, Tensor], device: str) -> Learnt:
    """Returns what gave ``tensors``, on ``device``."""
    kinds = {kind: {name: x.to(device) for name, x in below(tensors, f"{kind}.").items()} for kind in KINDS}
    return Learnt(**kinds, steps=int(tensors["steps"]))


def check_weights(learnt: Iterable[Learnt], network: nn.Module) -> None:
    """Checks that what was learnt is of ``network``.

    Raises:
        ValueError: it is of another one.
    """
    kinds = {name: (value.shape, value.dtype) for name, value in network.named_parameters()}
    for one in learnt:
        for kind in KINDS:
            held = getattr(one, kind)
            if (held or kind != "averages") and {name: (x.shape, x.dtype) for name, x in held.items()} != kinds:
                raise ValueError(f"its selector's {kind} are of another network")


def untrained(network: nn.Module, device: torch.device) -> Learnt:
    """Returns the weights of ``network`` on ``device`` before the first step."""
    weights = {name: value.detach().to(device, copy=True) for name, value in network.named_parameters()}
    means = {name: torch.zeros_like(value) for name, value in weights.items()}
    squares = {name: torch.zeros_like(value) for name, value in weights.items()}
    return Learnt(weights, means, squares, 0, {})


def check_minibatches(batch_size: int, minibatch_size: int) -> None:
    """Checks that the minibatches of an update are of one size.

    Raises:
        ValueError: they are not.
    """
    if batch_size % minibatch_size:
        raise ValueError(
            f"selector.minibatch_size must divide selector.batch_size, "
            f"but {minibatch_size} does not divide {batch_size}."
        )


Loss = Callable[[Callable[..., Tensor], Any, Generator], Tensor]
"""What a gradient step goes down: of the network, from arrays of its inputs to logits, and a minibatch of examples."""


def updated(
    network: nn.Module,
    learnt: Learnt,
    minibatches: Iterable[Sequence[tuple[Any, float]]],
    loss_of: Loss,
    rng: Generator,
    *,
    learning_rate: float,
    averaging: float,
) -> tuple[Learnt, float]:
    """Returns what is learnt after one Adam step on each minibatch, and the mean loss.

    Args:
        network: holds the architecture; its own weights do not matter.
        learnt: stays as it is.
        minibatches: at least one; each in the parts that the memory holds, with their shares of the whole.
        loss_of: what to go down.
        rng: the only source of chance.
        learning_rate: Adam's; its other settings are torch's defaults.
        averaging: in [0, 1), what a step counts in the averages where the next counts 1; 0 keeps none.
    """
    weights = {name: value.clone().requires_grad_() for name, value in learnt.weights.items()}
    device = next(iter(weights.values())).device
    adam = torch.optim.Adam(weights.values(), lr=learning_rate, fused=True)
    for name, weight in weights.items():
        adam.state[weight] = {
            "step": torch.tensor(float(learnt.steps), device=device),
            "exp_avg": learnt.means[name].clone(),
            "exp_avg_sq": learnt.squares[name].clone(),
        }

    def asked(*inputs: np.ndarray | None) -> Tensor:
        on_device = (None if x is None else torch.from_numpy(x).to(device) for x in inputs)
        return functional_call(network, weights, tuple(on_device))

    averages = {name: value.clone() for name, value in learnt.used.items()} if averaging else {}
    losses: list[float] = []
    network.train()
    with seeded(rng, device):
        for parts in minibatches:
            adam.zero_grad()
            losses.append(sum(add_gradients(loss_of(asked, part, rng), share) for part, share in parts))
            adam.step()
            average(averages, weights, averaging, learnt.steps + len(losses))
    after = Learnt(
        {name: weight.detach() for name, weight in weights.items()},
        {name: adam.state[weight]["exp_avg"] for name, weight in weights.items()},
        {name: adam.state[weight]["exp_avg_sq"] for name, weight in weights.items()},
        learnt.steps + len(losses),
        averages,
    )
    return after, float(np.mean(losses))


def add_gradients(loss: Tensor, share: float) -> float:
    """Adds the gradient of ``loss``, a mean over ``share`` of a minibatch, and returns its part of the whole's loss.

    Up to rounding all parts together give what the whole at once would; what dropout takes differs.
    """
    part = loss * share
    part.backward()
    return float(part.item())


def average(averages: dict[str, Tensor], weights: dict[str, Tensor], averaging: float, step: int) -> None:
    """Takes ``weights`` after their ``step``-th step into ``averages``, in place; does nothing where none are kept.

    Each step counts a = ``averaging`` times the next, so that the newest has the share (1 - a) / (1 - a^step): all at
    the first, and the random weights before it never count.
    """
    if averages:
        share = (1 - averaging) / (1 - averaging**step)
        with torch.no_grad():
            torch._foreach_lerp_(list(averages.values()), [weights[name] for name in averages], share)
