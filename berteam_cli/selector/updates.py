"""Gradient steps on a network, from one frozen set of weights to the next."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.random import Generator
from torch import Tensor, nn
from torch.func import functional_call

from berteam_cli.selector.network import seeded


@dataclass(frozen=True)
class Learnt:
    """A network's weights and what Adam remembers of their gradients, by parameter name.

    Attributes:
        weights: the parameters.
        means: Adam's running mean of the gradient of each.
        squares: Adam's running mean of its square.
        steps: Adam's steps so far.
    """

    weights: dict[str, Tensor]
    means: dict[str, Tensor]
    squares: dict[str, Tensor]
    steps: int


def untrained(network: nn.Module, device: torch.device) -> Learnt:
    """Returns the weights of ``network`` on ``device`` before the first step."""
    weights = {name: value.detach().to(device, copy=True) for name, value in network.named_parameters()}
    means = {name: torch.zeros_like(value) for name, value in weights.items()}
    squares = {name: torch.zeros_like(value) for name, value in weights.items()}
    return Learnt(weights, means, squares, 0)


Loss = Callable[[Callable[..., Tensor], Any, Generator], Tensor]
"""What a gradient step goes down: of the network, from arrays of its inputs to logits, and a minibatch of examples."""


def updated(
    network: nn.Module,
    learnt: Learnt,
    minibatches: Iterable[Any],
    loss_of: Loss,
    rng: Generator,
    *,
    learning_rate: float,
) -> tuple[Learnt, float]:
    """Returns what is learnt after one Adam step on each minibatch, and the mean loss.

    Args:
        network: holds the architecture; its own weights do not matter.
        learnt: stays as it is.
        minibatches: at least one.
        loss_of: what to go down.
        rng: the only source of chance.
        learning_rate: Adam's; its other settings are torch's defaults.
    """
    weights = {name: value.clone().requires_grad_() for name, value in learnt.weights.items()}
    adam = torch.optim.Adam(weights.values(), lr=learning_rate)
    for name, weight in weights.items():
        adam.state[weight] = {
            "step": torch.tensor(float(learnt.steps)),
            "exp_avg": learnt.means[name].clone(),
            "exp_avg_sq": learnt.squares[name].clone(),
        }
    device = next(iter(weights.values())).device
    losses = []
    network.train()

    def asked(*inputs: np.ndarray | None) -> Tensor:
        on_device = (None if x is None else torch.from_numpy(x).to(device) for x in inputs)
        return functional_call(network, weights, tuple(on_device))

    with seeded(rng, device):
        for examples in minibatches:
            loss = loss_of(asked, examples, rng)
            adam.zero_grad()
            loss.backward()
            adam.step()
            losses.append(loss.item())
    after = Learnt(
        {name: weight.detach() for name, weight in weights.items()},
        {name: adam.state[weight]["exp_avg"] for name, weight in weights.items()},
        {name: adam.state[weight]["exp_avg_sq"] for name, weight in weights.items()},
        learnt.steps + len(losses),
    )
    return after, float(np.mean(losses))
