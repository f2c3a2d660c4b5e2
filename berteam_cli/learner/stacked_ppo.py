"""PPO of ``ppo.py`` for all members of an island that are due, in one batch on a device such as a GPU."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.random import Generator
from torch import Tensor

from berteam_cli.acting import Policies
from berteam_cli.learner.adam import Trained
from berteam_cli.learner.base import Learning
from berteam_cli.learner.mlp import weight_count
from berteam_cli.learner.ppo import Ppo, PpoState, learning
from berteam_cli.learner.rollout import Seen, Steps, advantages, append, seen, stitched
from berteam_cli.learner.stacked import OnDevice, acting, descend, on, outputs, put_where_finite, taken
from berteam_cli.learner.surrogate import FIGURES, KL, LOSSES, Sample
from berteam_cli.learner.traits import tuned
from berteam_cli.outcomes import Experience, Floats
from berteam_cli.workers import Workers


@dataclass(frozen=True)
class StackedPpo(Ppo):
    """PPO whose state lies on a device; it takes the same minibatches as ``Ppo`` and differs from it by rounding only.

    Attributes:
        device: of torch.
    """

    device: str

    def init(self, members: int, rng: Generator) -> PpoState:
        """Returns the state of ``members`` members that have not learnt yet."""
        return self.restored(Ppo.tensors(self, super().init(members, rng)))

    def policies(self, state: OnDevice, *, explore: bool) -> Policies:
        """Returns the members' stochastic policies."""
        return super().policies(acting(state), explore=explore)

    def learn(
        self,
        state: OnDevice,
        experience: Experience,
        first: int,
        rng: Generator,
        workers: Workers,
        traits: Floats | None = None,
    ) -> list[Learning]:
        """Adds the members' steps to their rollouts; all whose are full learn from them together.

        With (M, H) ``traits`` each member has its own. Changes ``state``.
        """
        own = [tuned(self, traits, row) for row in range(len(state.filled))]
        rngs = rng.spawn(len(state.filled))
        trajectories = experience.trajectories(first, len(state.filled))
        rows = list(trajectories)
        saw = [seen(experience, trajectories[row]) for row in rows]
        new = dict(zip(rows, self.judged_together(state, rows, saw, own), strict=True))
        used = {row: append(state.rollouts, state.filled, row, new[row], 0) for row in rows}
        before = state.trained.updates.tolist()
        figures: dict[int, list[list[float]]] = {row: [] for row in rows}
        failures = dict.fromkeys(rows, 0)
        while due := [row for row in rows if state.filled[row] == self.n_steps]:
            of_update, sound = self.updated(state, due, [rngs[row] for row in due], own)
            for row, numbers, well in zip(due, of_update, sound, strict=True):
                figures[row] += [numbers] if well else []
                failures[row] += not well
                state.filled[row] = 0
                used[row] += append(state.rollouts, state.filled, row, new[row], used[row])
        for row in rows:
            state.collected[row] += used[row]
        after = state.trained.updates.tolist()
        return [learning(row, figures[row], after[row] - before[row], used[row], failures[row]) for row in rows]

    def judged_together(
        self, state: OnDevice, rows: list[int], saw: list[Seen], own: list[StackedPpo]
    ) -> list[OnDevice]:
        """Returns the new steps of each member, with what its networks say of them before it learns.

        Args:
            state: of the island.
            rows: K members.
            saw: what each of them did.
            own: (M,) the settings of each member of the island.
        """
        if not rows:
            return []
        shape = (len(rows), max(len(x.actions) for x in saw))
        observations, actions = np.zeros((*shape, self.observation_size), np.float32), np.zeros(shape, np.int64)
        for k, x in enumerate(saw):
            observations[k, : len(x.actions)], actions[k, : len(x.actions)] = x.observations, x.actions
        with torch.no_grad():
            weights = state.trained.weights[torch.tensor(rows, device=self.device)]
            logits, values = self.both(weights, on(self.device, observations))
            logs = logits.log_softmax(dim=2).gather(2, on(self.device, actions)[..., None])[..., 0].cpu().numpy()
        said = values.cpu().numpy()
        steps = [
            stitched(x, said[k, : len(x.actions)], logs[k, : len(x.actions)], own[rows[k]].gamma)
            for k, x in enumerate(saw)
        ]
        return [Steps._make(on(self.device, column) for column in x) for x in steps]

    def both(self, weights: Tensor, observations: Tensor) -> tuple[Tensor, Tensor]:
        """Returns the policies' outputs (K, n, A) and the values (K, n) of ``observations``, shape (K, n, O)."""
        cut = weight_count(np.array(self.policy_sizes))
        logits = outputs(weights[:, :cut], self.policy_sizes, self.smooth, observations)
        return logits, outputs(weights[:, cut:], self.value_sizes, self.smooth, observations)[..., 0]

    def updated(
        self, state: OnDevice, due: list[int], rngs: list[Generator], own: list[StackedPpo]
    ) -> tuple[list[list[float]], list[bool]]:
        """Lets the members ``due`` learn from their full rollouts; ``own`` (M,) are the settings of all members.

        Returns for each its figures, and whether they and its weights are finite; if not, it stays as it was.
        """
        rows = torch.tensor(due, device=self.device)
        rollout = self.samples(state, rows, [own[row].gamma for row in due])
        entropy_coef = on(self.device, np.array([own[row].entropy_coef for row in due], dtype=np.float32))
        rates: Any = on(self.device, np.array([[own[row].learning_rate] for row in due]))
        adam = self.adam._replace(learning_rate=rates)
        orders = on(self.device, np.stack([self.orders(rng) for rng in rngs]))  # (K, n_epochs, n_steps)
        trained: OnDevice = Trained._make(taken(state.trained, rows))
        everyone = torch.arange(len(due), device=self.device)[:, None]
        sums = torch.zeros(len(due), len(FIGURES), dtype=torch.float64, device=self.device)
        seen_in_all = torch.zeros(len(due), device=self.device)
        near = torch.ones(len(due), dtype=torch.bool, device=self.device)
        last = torch.zeros_like(sums[:, KL])
        for order in orders.unbind(dim=1):
            divergence, seen_in_pass, in_pass = torch.zeros_like(sums[:, KL]), torch.zeros_like(seen_in_all), near
            for at in order.split(self.minibatch_size, dim=1):
                sample = Sample._make(x[everyone, at] for x in rollout)
                gradient, figures = self.gradient(trained.weights, sample, entropy_coef)
                sums += torch.where(near[:, None], figures, 0.0)
                divergence += torch.where(near, figures[:, KL], 0.0)
                seen_in_all += near
                seen_in_pass += near
                near = near & ~(figures[:, KL] > 1.5 * self.surrogate.target_kl)
                descend(adam, trained, gradient, near)
            last = torch.where(in_pass, divergence / seen_in_pass, last)
        means = sums / seen_in_all[:, None]
        means[:, KL] = last
        return means.tolist(), put_where_finite(state.trained, rows, trained, means[:, :LOSSES])

    def samples(self, state: OnDevice, rows: Tensor, gammas: list[float]) -> OnDevice:
        """Returns the full rollouts of the members ``rows`` with their advantages and returns, (K, n_steps).

        Args:
            state: of the island.
            rows: (K,) members.
            gammas: (K,) discount of each.
        """
        rollouts: OnDevice = Steps._make(taken(state.rollouts, rows))
        host = [x.cpu().numpy() for x in (rollouts.rewards, rollouts.values, rollouts.next_values, rollouts.ends)]
        each = [
            advantages(r, v, after, ends, gamma, self.gae_lambda)
            for r, v, after, ends, gamma in zip(*host, gammas, strict=True)
        ]
        gains = on(self.device, np.stack(each))
        actions = rollouts.actions.long()
        returns = gains + rollouts.values
        return Sample._make((rollouts.observations, actions, rollouts.log_probs, gains, rollouts.values, returns))

    def gradient(self, weights: Tensor, sample: OnDevice, entropy_coef: Tensor) -> tuple[Tensor, Tensor]:
        """Returns the gradients (K, W) of the members' losses, and their figures (K, len(FIGURES)); see ``Surrogate``.

        Args:
            weights: (K, W).
            sample: (K, n) steps.
            entropy_coef: (K,) weight of the entropy.
        """
        weights = weights.detach().requires_grad_()
        logits, values = self.both(weights, sample.observations)
        logs = logits.log_softmax(dim=2)
        entropy = -(logs.exp() * logs).sum(dim=2).mean(dim=1)
        log_ratio = logs.gather(2, sample.actions[..., None])[..., 0] - sample.log_probs
        ratio, gains = log_ratio.exp(), sample.advantages
        if self.normalize_advantage and gains.shape[1] > 1:
            gains = (gains - gains.mean(dim=1, keepdim=True)) / (gains.std(dim=1, keepdim=True) + 1e-8)
        bounded = ratio.clamp(1 - self.clip_range, 1 + self.clip_range)
        policy_loss = -torch.minimum(gains * ratio, gains * bounded).mean(dim=1)
        if self.clip_range_vf is not None:
            values = sample.values + (values - sample.values).clamp(-self.clip_range_vf, self.clip_range_vf)
        value_loss = (values - sample.returns).square().mean(dim=1)
        loss = policy_loss - entropy_coef * entropy + self.value_coef * value_loss
        (gradient,) = torch.autograd.grad(loss.sum(), weights)
        approx_kl = (ratio - 1 - log_ratio).mean(dim=1)
        clip_fraction = ((ratio - 1).abs() > self.clip_range).float().mean(dim=1)
        figures = torch.stack([loss, policy_loss, value_loss, entropy, approx_kl, clip_fraction], dim=1)
        return gradient, figures.detach().double()

    def tensors(self, state: OnDevice) -> dict[str, Any]:
        """Returns all that ``state`` holds, by name."""
        columns = {**state.trained._asdict(), **state.rollouts._asdict()}
        counts = {"filled": state.filled, "collected": state.collected}
        return {**columns, **{name: torch.from_numpy(column) for name, column in counts.items()}}

    def restored(self, tensors: dict[str, Any]) -> PpoState:
        """Returns the state that ``tensors`` gave these, on the device."""
        self.checked(tensors)
        return PpoState(
            Trained._make(tensors[name].to(self.device, copy=True) for name in Trained._fields),
            Steps._make(tensors[name].to(self.device, copy=True) for name in Steps._fields),
            *(tensors[name].cpu().numpy().copy() for name in ("filled", "collected")),
        )
