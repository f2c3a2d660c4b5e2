"""Learning the best response: the L1 loss of the paper's Appendix D, "Relation to Nash Equilibria".

The distance of the distribution D over teams from the one that is always T is |D - e_T|_1 = 2 - 2 D_T. Weighted by
outcome o and inverse chance c over the teams that played, its mean is least where D is all on the teams with the best
expected outcome. Two things are added that leave that least point where it is:

- The scale. D_T is a product of many chances: far from the answer it is about 1 / N^T, and so is its slope, and there
  training is said to get stuck. The mean of c D is an estimate of a constant, since D sums to 1 over all teams and by c
  all teams are equally common; dividing by it makes the loss 2 - 2 V, where V is the outcome that D itself expects. Its
  slope does not vanish: every team pushes by D_T / P_T, how much more common it is now than when it was chosen.
- The baseline. For the same reason the mean of c D times a constant has no slope in expectation. With V in that place
  only outcomes better or worse than what D expects anyway push, which leaves less to chance; and a team so rare that
  its weight is capped is seldom seen, but not for that taken to be bad. This is why losers have to be kept too.

Then there is no more of D in the loss than its entropy: below that of a D that leaves a share p to all but one team it
is pushed up, so that no team falls out of sight; above, it is not.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import torch
from numpy.random import Generator
from torch import Tensor

from berteam_cli.outcomes import OPEN, Bools, Ints
from berteam_cli.selector.masking import forgotten
from berteam_cli.selector.winners import Examples


def best_response_loss(
    network: Callable[..., Tensor],
    examples: Examples,
    allowed: Bools,
    entropy_coef: float,
    entropy_clip: float,
    drop_input: float,
    drop_player: float,
    rng: Generator,
) -> Tensor:
    """Returns 2 - 2 V - beta mean(min(H, gamma)) / gamma, of which V has the slope of mean(c D (o - V)) / mean(c D).

    V = mean(c D o) / mean(c D). The chance D of each team is estimated by the product of the conditionals along one
    random fill order; H is the sum of their entropies, in nats.

    Args:
        network: from its inputs to logits.
        examples: K teams; ``inverses`` are c, and ``weights`` c o.
        allowed: (T, N) who may stand at each place.
        entropy_coef: beta.
        entropy_clip: p, as of ``least_entropy``.
        drop_input: as of ``masking.forgotten``.
        drop_player: as there.
        rng: the only source of chance.
    """
    count, size = examples.teams.shape
    order = rng.permuted(np.tile(np.arange(size), (count, 1)), axis=1)
    seen: tuple[np.ndarray | None, np.ndarray | None] = (None, None)
    if examples.rows.shape[2]:
        lengths = forgotten(examples.lengths, drop_input, drop_player, rng)
        seen = (np.tile(examples.rows, (size, 1, 1, 1)), np.tile(lengths, (size, 1)))
    shown = prefixes(examples.teams, order).reshape(-1, size)  # (T K, T)
    logits = network(shown, np.tile(examples.sides, size), *seen).reshape(size, count, size, -1)

    steps, rows, device = np.arange(size)[:, np.newaxis], np.arange(count), logits.device
    place = order.T  # (T, K) the place filled at each step
    there = torch.from_numpy(allowed[place]).to(device)
    log_odds = torch.log_softmax(logits[steps, rows, place].masked_fill(~there, -torch.inf), dim=-1)  # (T, K, N)
    log_chance = log_odds[steps, rows, examples.teams[rows, place]].sum(dim=0)  # (K,)
    entropy = -(log_odds.exp() * log_odds.masked_fill(~there, 0.0)).sum(dim=-1).sum(dim=0)  # (K,)

    inverses = np.maximum(examples.inverses, np.finfo(np.float64).tiny)  # age may have brought it down to 0
    counts = (torch.from_numpy(x).to(device).float() for x in (np.log(inverses), examples.weights / inverses))
    loss = shortfall(log_chance, *counts)
    least = least_entropy(allowed, entropy_clip)
    if least > 0:
        loss = loss - entropy_coef * entropy.clamp(max=least).mean() / least
    return loss


def shortfall(log_chance: Tensor, log_inverses: Tensor, outcomes: Tensor) -> Tensor:
    """Returns 2 - 2 V, with the slope of -2 mean(c D (o - V)) / mean(c D).

    Args:
        log_chance: (K,) ln D.
        log_inverses: (K,) ln c, up to a constant.
        outcomes: (K,) o.
    """
    share = torch.softmax((log_chance + log_inverses).detach(), dim=0)  # c D / sum(c D)
    expected = (share * outcomes).sum()  # V
    push = (share * (outcomes - expected) * log_chance).sum()  # slope of D = D times that of ln D
    return 2.0 - 2.0 * (expected + push - push.detach())


def prefixes(teams: Ints, order: Ints) -> Ints:
    """Returns (T, K, T) what of ``teams`` is there before each step, when their places are filled in ``order``.

    Args:
        teams: (K, T), no place OPEN.
        order: (K, T) the place filled at each step.
    """
    size = teams.shape[1]
    step_of = np.argsort(order, axis=1)  # (K, T) when each place is filled
    return np.where(step_of < np.arange(size)[:, np.newaxis, np.newaxis], teams, OPEN)


def least_entropy(allowed: Bools, clip: float) -> float:
    """Returns gamma, the entropy in nats on the way to a team that is nearly certain.

    Each place has one member with chance 1 - p' and all others that may stand there alike, p' = 1 - (1 - p)^(1 / T):
    then the likeliest team has chance 1 - p. Where p' would make that member rarer than the others, all are alike:
    gamma never falls as p grows, and p = 1 gives T ln N, the largest entropy there is, so that nothing is clipped.

    Args:
        allowed: (T, N) who may stand at each place.
        clip: p, in [0, 1].
    """
    other = 1.0 - (1.0 - clip) ** (1.0 / len(allowed))
    many = allowed.sum(axis=1)
    total = 0.0
    for n in many[many > 1]:
        rest = min(other, 1.0 - 1.0 / n)
        chances = np.append(np.full(n - 1, rest / (n - 1)), 1.0 - rest)
        chances = chances[chances > 0]
        total -= float((chances * np.log(chances)).sum())
    return total
