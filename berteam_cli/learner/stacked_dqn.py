"""DQN of ``dqn.py`` for all members of an island in one batch on a device such as a GPU."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import torch
from numpy.random import Generator
from torch import Tensor
from torch.nn.functional import smooth_l1_loss

from berteam_cli.acting import Policies
from berteam_cli.learner.adam import Trained
from berteam_cli.learner.base import Learning
from berteam_cli.learner.dqn import Dqn, DqnState
from berteam_cli.learner.replay import Replay, latest
from berteam_cli.learner.stacked import OnDevice, acting, descend, on, outputs, put_where_finite, taken
from berteam_cli.learner.temporal import FIGURES
from berteam_cli.learner.traits import tuned
from berteam_cli.outcomes import Experience, Floats, Ints
from berteam_cli.workers import Workers


@dataclass(frozen=True)
class StackedDqn(Dqn):
    """DQN whose state lies on a device; it takes the same minibatches as ``Dqn`` and differs from it by rounding only.

    Attributes:
        device: of torch.
    """

    device: str

    def init(self, members: int, rng: Generator) -> DqnState:
        """Returns the state of ``members`` members that have not learnt yet."""
        return self.restored(Dqn.tensors(self, super().init(members, rng)))

    def policies(self, state: OnDevice, *, explore: bool) -> Policies:
        """Returns the members' greedy policies, which err at random as their schedules say if they ``explore``."""
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
        """Adds the members' steps to their replay buffers; then all take the gradient steps these allow, together.

        With (M, H) ``traits`` each member has its own. Changes ``state``.
        """
        rngs = rng.spawn(len(state.collected))
        trajectories = experience.trajectories(first, len(state.collected))
        rows = list(trajectories)
        if not rows:
            return []
        before = state.collected.copy()
        for row, games in trajectories.items():
            for game, player in games:
                at, new = latest(self.buffer_size, int(state.collected[row]), experience, game, player)
                columns: tuple[npt.NDArray[Any], ...] = new
                for kept, column in zip(state.replay, columns, strict=True):
                    kept[row, on(self.device, at)] = on(self.device, column)
                state.collected[row] += experience.lengths[game]
        plans = [self.plan(int(before[row]), int(state.collected[row])) for row in rows]
        batches = [
            self.batches(int(state.collected[row]), count, rngs[row])
            for row, (count, _) in zip(rows, plans, strict=True)
        ]
        own = [tuned(self, traits, row) for row in rows]
        figures, sound = self.stepped(state, rows, batches, [renewals for _, renewals in plans], own)
        learnt = []
        for row, (count, _), numbers, well in zip(rows, plans, figures, sound, strict=True):
            means = dict(zip(FIGURES, numbers, strict=True)) if count and well else {}
            steps, epsilon = int(state.collected[row] - before[row]), float(self.epsilon(state.collected[row]))
            learnt.append(Learning(row, count * well, **means, epsilon=epsilon, steps=steps, failures=int(not well)))
        return learnt

    def stepped(
        self, state: OnDevice, rows: list[int], batches: list[Ints], renewals: list[Ints], own: list[StackedDqn]
    ) -> tuple[list[list[float]], list[bool]]:
        """Takes gradient steps of the members ``rows``, some more than others.

        Args:
            state: changed.
            rows: K members.
            batches: for each (k, n) places in its ring.
            renewals: for each (k + 1,) as ``temporal.schedule`` gives them.
            own: the settings of each.

        Returns:
            For each the means of loss and of Q; and whether all is finite; if not, it stays as it was.
        """
        counts = on(self.device, np.array([len(x) for x in batches]))
        most = max(len(x) for x in batches)
        at = np.zeros((len(rows), most, self.batch_size), dtype=np.int64)
        renews = np.zeros((len(rows), most + 1), dtype=np.int64)
        for k, (places, targets) in enumerate(zip(batches, renewals, strict=True)):
            at[k, : len(places)], renews[k, : len(targets)] = places, targets
        chosen = torch.tensor(rows, device=self.device)
        newest = on(self.device, (state.collected[rows] - 1) % self.buffer_size)
        trained: OnDevice = Trained._make(taken(state.trained, chosen))
        rates: Any = on(self.device, np.array([[x.learning_rate] for x in own]))
        adam, gammas = self.adam._replace(learning_rate=rates), on(self.device, np.array([[x.gamma] for x in own]))
        target = state.target[chosen]
        sums = torch.zeros(len(rows), len(FIGURES), dtype=torch.float64, device=self.device)
        steps, renewing = on(self.device, at), on(self.device, renews)
        for step in range(most + 1):
            target = self.followed(target, trained.weights, renewing[:, step])
            if step == most:
                break
            active = step < counts
            gradient, figures = self.gradient(
                state, chosen, newest, steps[:, step], trained.weights, target, gammas.float()
            )
            sums += torch.where(active[:, None], figures, 0.0)
            descend(adam, trained, gradient, active)
        means = sums / counts.clamp(min=1)[:, None]
        sound = put_where_finite((*state.trained, state.target), chosen, (*trained, target), means)
        for row, times, well in zip(rows, renewing.sum(dim=1), sound, strict=True):
            if not well:  # what is undone does not delay the target
                state.target[row] = self.followed(state.target[row], state.trained.weights[row], times)
        return means.tolist(), sound

    def followed(self, target: Tensor, weights: Tensor, times: Tensor) -> Tensor:
        """Returns ``target``, shape (..., W), after it moved to ``weights`` so many ``times``, shape (...)."""
        stays = (1.0 - self.tau) ** times[..., None]
        return target * stays + weights * (1.0 - stays)

    def gradient(
        self,
        state: OnDevice,
        rows: Tensor,
        newest: Tensor,
        at: Tensor,
        weights: Tensor,
        target: Tensor,
        gammas: Tensor,
    ) -> tuple[Tensor, Tensor]:
        """Returns the gradients (K, W) of the members' losses, and their losses and mean Q, (K, 2).

        Args:
            state: of the island.
            rows: (K,) members.
            newest: (K,) where in its ring each member's last step is.
            at: (K, n) places in their rings.
            weights: (K, W).
            target: (K, W).
            gammas: (K, 1) float32, discount of each.
        """
        ring, who = state.replay, rows[:, None]
        last, goals, discounts = at, ring.rewards[who, at], gammas.expand(at.shape)
        for _ in range(1, self.n_steps):
            goes_on = ~(ring.ends[who, last] | (last == newest[:, None]))
            last = torch.where(goes_on, (last + 1) % self.buffer_size, last)
            goals = goals + torch.where(goes_on, discounts * ring.rewards[who, last], 0.0)
            discounts = torch.where(goes_on, discounts * gammas, discounts)
        future = outputs(target, self.sizes, self.smooth, ring.next_observations[who, last]).amax(dim=2)
        goals = goals + torch.where(ring.terminated[who, last], 0.0, discounts * future)
        weights = weights.detach().requires_grad_()
        q = outputs(weights, self.sizes, self.smooth, ring.observations[who, at])
        q = q.gather(2, ring.actions[who, at].long()[..., None])[..., 0]
        loss = smooth_l1_loss(q, goals, reduction="none").mean(dim=1)
        (gradient,) = torch.autograd.grad(loss.sum(), weights)
        return gradient, torch.stack([loss, q.mean(dim=1)], dim=1).detach().double()

    def tensors(self, state: OnDevice) -> dict[str, Any]:
        """Returns all that ``state`` holds, by name; of the replay buffers what the fullest one holds."""
        replay = {name: column[:, : self.held(state)] for name, column in state.replay._asdict().items()}
        columns = {**state.trained._asdict(), "target": state.target, **replay}
        return {**columns, "collected": torch.from_numpy(state.collected)}

    def restored(self, tensors: dict[str, Any]) -> DqnState:
        """Returns the state that ``tensors`` gave these, on the device."""
        self.checked(tensors)
        replay = self.whole({name: tensors[name].cpu().numpy() for name in Replay._fields})
        return DqnState(
            Trained._make(tensors[name].to(self.device, copy=True) for name in Trained._fields),
            tensors["target"].to(self.device, copy=True),
            Replay._make(on(self.device, column) for column in replay),
            tensors["collected"].cpu().numpy().copy(),
        )
