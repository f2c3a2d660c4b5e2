"""Gradient steps on the team network, from one frozen set of weights to the next."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from numpy.random import Generator
from torch import Tensor
from torch.func import functional_call

from berteam_cli.selector.masking import guessing_loss, masked
from berteam_cli.selector.network import TeamNetwork, seeded
from berteam_cli.selector.winners import Winners, minibatch


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


def untrained(network: TeamNetwork, device: torch.device) -> Learnt:
    """Returns the weights of ``network`` on ``device`` before the first step."""
    weights = {name: value.detach().to(device, copy=True) for name, value in network.named_parameters()}
    means = {name: torch.zeros_like(value) for name, value in weights.items()}
    squares = {name: torch.zeros_like(value) for name, value in weights.items()}
    return Learnt(weights, means, squares, 0, {})


def updated(
    network: TeamNetwork,
    learnt: Learnt,
    winners: Winners,
    rng: Generator,
    *,
    minibatches: int,
    size: int,
    weight_half_life: float,
    learning_rate: float,
    averaging: float,
) -> tuple[Learnt, float]:
    """Returns what is learnt after one Adam step on each minibatch, and the mean loss in nats.

    Args:
        network: holds the architecture; its own weights do not matter.
        learnt: stays as it is.
        winners: at least one; every minibatch is drawn anew from all of them.
        rng: the only source of chance.
        minibatches: how many steps.
        size: teams in a minibatch.
        weight_half_life: as in ``minibatch``.
        learning_rate: Adam's; its other settings are torch's defaults.
        averaging: in [0, 1), what a step counts in the averages where the next counts 1; 0 keeps none.
    """
    weights = {name: value.clone().requires_grad_() for name, value in learnt.weights.items()}
    adam = torch.optim.Adam(weights.values(), lr=learning_rate)
    for name, weight in weights.items():
        adam.state[weight] = {
            "step": torch.tensor(float(learnt.steps)),
            "exp_avg": learnt.means[name].clone(),
            "exp_avg_sq": learnt.squares[name].clone(),
        }
    averages = {name: value.clone() for name, value in learnt.used.items()} if averaging else {}
    device = next(iter(weights.values())).device
    losses = []
    network.train()
    with seeded(rng, device):
        for step in range(learnt.steps + 1, learnt.steps + minibatches + 1):
            teams, shares = minibatch(winners, size, weight_half_life, rng)
            shown, hidden = masked(teams, network.members, rng)
            shown, teams, hidden = (torch.from_numpy(array).to(device) for array in (shown, teams, hidden))
            logits = functional_call(network, weights, shown)
            loss = guessing_loss(logits, teams, hidden, torch.from_numpy(shares).to(device, torch.float32))
            adam.zero_grad()
            loss.backward()
            adam.step()
            average(averages, weights, averaging, step)
            losses.append(loss.item())
    after = Learnt(
        {name: weight.detach() for name, weight in weights.items()},
        {name: adam.state[weight]["exp_avg"] for name, weight in weights.items()},
        {name: adam.state[weight]["exp_avg_sq"] for name, weight in weights.items()},
        learnt.steps + minibatches,
        averages,
    )
    return after, float(np.mean(losses))


def average(averages: dict[str, Tensor], weights: dict[str, Tensor], averaging: float, step: int) -> None:
    """Takes ``weights`` after their ``step``-th step into ``averages``, in place; does nothing where none are kept.

    Each step counts a = ``averaging`` times the next, so that the newest has the share (1 - a) / (1 - a^step): all at
    the first, and the random weights before it never count.
    """
    if averages:
        share = (1 - averaging) / (1 - averaging**step)
        with torch.no_grad():
            torch._foreach_lerp_(list(averages.values()), [weights[name] for name in averages], share)
