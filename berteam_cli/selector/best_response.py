"""Learning the best response: the L1 loss of the paper's Appendix D, "Relation to Nash Equilibria".

The distance of the distribution D over teams from the one that is always T is |D - e_T|_1 = 2 - 2 D_T. Weighted by
outcome o and inverse chance c over the teams that played, its mean is least where D is all on the teams with the best
expected outcome. Two things keep that least point where it is and make it easier to reach:

- The scale. D_T is a product of many chances: far from the answer it is about 1 / N^T, and so is its slope, and there
  training is said to get stuck. The mean of c D estimates a constant, since by c all teams are equally common and D
  sums to 1 over them; divided by it, the loss is 2 - 2 V, V the outcome that D itself expects: the mean of o with
  shares c D / sum(c D), each team as much more common as it is now than when it was chosen.
- The baseline. As the shares sum to 1, the slope of V is that of the mean of c D (o - V): only outcomes that are better
  or worse than what D expects anyway push, which leaves less to chance. A team so rare that its weight is capped is
  underrated in how common it is, not in how good. This is why losers teach too.

The entropy of D, with the same shares, is pushed up while it is below that of a D that leaves a share p to all teams
but one, so that no team falls out of sight.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import torch
from numpy.random import Generator
from torch import Tensor

from berteam_cli.outcomes import ABSENT, OPEN, Bools, Ints
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
    """Returns 2 - 2 V - beta H / gamma, with V the mean outcome that the network's distribution D over teams expects.

    V and H are means of the outcomes and of the entropies min(H_T, gamma), in nats, with shares c D / sum(c D). The
    chance D of each team is estimated by the product of the conditionals along one random fill order; H_T is the sum of
    the entropies of these conditionals.

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
    who = examples.teams[rows, place]  # (T, K)
    real = torch.from_numpy(who != ABSENT).to(device)
    log_chance = log_odds[steps, rows, np.maximum(who, 0)].masked_fill(~real, 0.0).sum(dim=0)  # (K,)
    entropy = -((log_odds.exp() * log_odds.masked_fill(~there, 0.0)).sum(dim=-1) * real).sum(dim=0)  # (K,)

    inverses = np.maximum(examples.inverses, np.finfo(np.float64).tiny)  # age may have brought it down to 0
    log_inverses, outcomes = (
        torch.from_numpy(x).to(device).float() for x in (np.log(inverses), examples.weights / inverses)
    )
    share = torch.softmax(log_chance + log_inverses, dim=0)
    loss = 2.0 - 2.0 * (share * outcomes).sum()
    least = least_entropy(allowed, entropy_clip)
    if least > 0:
        loss = loss - entropy_coef * (share * entropy.clamp(max=least)).sum() / least
    return loss


def prefixes(teams: Ints, order: Ints) -> Ints:
    """Returns (T, K, T) what of ``teams`` is there before each step, when their places are filled in ``order``.

    Args:
        teams: (K, T), no place OPEN; ABSENT places are so from the start.
        order: (K, T) the place filled at each step.
    """
    size = teams.shape[1]
    step_of = np.argsort(order, axis=1)  # (K, T) when each place is filled
    there = (step_of < np.arange(size)[:, np.newaxis, np.newaxis]) | (teams == ABSENT)
    return np.where(there, teams, OPEN)


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
