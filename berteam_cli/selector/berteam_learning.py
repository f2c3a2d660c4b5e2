"""How BERTeam learns: from winning teams, by guessing their members or by the best response; paper, Section 3."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import torch
from numpy.random import Generator
from torch import Tensor

from berteam_cli.outcomes import Bools, Experience, Floats, Outcomes
from berteam_cli.selector.base import Field, Plain, Selecting
from berteam_cli.selector.berteam_state import BerteamState, restored
from berteam_cli.selector.best_response import best_response_loss
from berteam_cli.selector.captains import SCHEMES
from berteam_cli.selector.embedders import Embedder, embedder
from berteam_cli.selector.masking import masking_loss
from berteam_cli.selector.network import LONGEST, POSITIONS, TeamNetwork, seeded
from berteam_cli.selector.observations import Looking, Seen, nothing_seen, seen_in
from berteam_cli.selector.updates import check_minibatches, check_weights, untrained, updated
from berteam_cli.selector.winners import Examples, Winners, harvest, in_parts, minibatch, no_winners, pushed

CPU = torch.device("cpu")
LOSSES = ("mlm", "l1")
LARGEST_COMPARED = 16  # T of the L1 loss, which reads T partial teams for each team of a minibatch at once
KNOWING = ("shared", "token", "separate")  # how a side that is chosen for is told from the others


@dataclass(frozen=True, eq=False)  # a field's arrays have no truth value
class BerteamLearning(Plain):
    """Settings of BERTeam, and how it learns.

    Attributes:
        field: among whom it chooses.
        device: where the network lives, as torch names it.
        captain: "matching", every member in turn; "uniform"; or "berteam", the network's noisy first choice.
        weighting: whether winners weigh the inverse of their chance to be chosen (Appendix D).
        weight_cap: largest such weight.
        noise_half_life: epochs after which a new member is half believed in; 0 for no noise.
        train_every: epochs from one update to the next.
        batch_size: teams of an update.
        minibatch_size: teams of one gradient step; divides ``batch_size``.
        capacity: winning teams that are remembered, in each ring; all teams where losers teach too.
        weight_half_life: wins after which a remembered team counts half; 0 for never.
        draw_weight: weight of each team of a draw; 0 leaves draws out.
        loss: "mlm", winners are to be guessed; "l1", the best response is looked for (Appendix D, "Relation to Nash
            Equilibria"), and losers teach too.
        entropy_coef: beta of the L1 loss.
        entropy_clip: its p, in [0, 1].
        learning_rate: Adam's.
        averaging: in [0, 1); teams are chosen with a mean of the weights after each gradient step, in which each counts
            so much of the next. 0 chooses with the newest weights.
        layers: of the encoder, and of the decoder.
        width: numbers in a token.
        heads: of each attention; divides ``width``.
        dropout: chance of a unit to be dropped in training.
        position: "append", "add" or "none": how the network knows the places of a team apart.
        side: "shared", all sides are alike; "token", the network reads which it is; "separate", a network each.
        dataset: "shared", one ring of winners; "per_side", one for each side, all as often learnt from.
        observations: what of the opponent is known before a team is chosen.
    """

    field: Field
    device: str
    captain: str
    weighting: bool
    weight_cap: float
    noise_half_life: float
    train_every: int
    batch_size: int
    minibatch_size: int
    capacity: int
    weight_half_life: float
    draw_weight: float
    loss: str
    entropy_coef: float
    entropy_clip: float
    learning_rate: float
    averaging: float
    layers: int
    width: int
    heads: int
    dropout: float
    position: str
    side: str
    dataset: str
    observations: Looking

    def __post_init__(self) -> None:
        """Refuses settings that exclude each other."""
        named = (("captain", SCHEMES), ("position", POSITIONS), ("side", KNOWING), ("loss", LOSSES))
        for name, allowed in named:
            if getattr(self, name) not in allowed:
                raise ValueError(f"selector.{name} must be one of {', '.join(allowed)}, but is {getattr(self, name)}.")
        if not 1 <= self.field.team_size <= LONGEST:
            raise ValueError(
                f"team_size must be 1 to {LONGEST}, the longest a network reads, but is {self.field.team_size}."
            )
        if self.side == "separate" and self.dataset == "shared":
            raise ValueError("selector.side=separate needs selector.dataset=per_side: a network learns from its side.")
        if self.loss == "l1" and self.field.team_size > LARGEST_COMPARED:
            raise ValueError(
                f"selector.loss=l1 needs teams of at most {LARGEST_COMPARED}, whose minibatches fit the memory whole, "
                f"but they have {self.field.team_size} members."
            )
        if self.loss == "l1" and not self.weighting:
            raise ValueError("selector.loss=l1 needs selector.weighting=true: else it finds what was chosen often.")
        check_minibatches(self.batch_size, self.minibatch_size)
        if self.width % self.heads or self.width % 2:
            raise ValueError(
                f"selector.width must be even and a multiple of selector.heads, {self.heads}, but is {self.width}."
            )

    @property
    def observes(self) -> bool:
        """Whether it wants to know what players saw."""
        return self.observations.use != "none"

    @property
    def seen_bytes(self) -> int:
        """Bytes that it takes to remember what they saw."""
        looking = self.observations
        numbers = self.field.team_size * looking.rows * looking.numbers
        return np.dtype(np.float16).itemsize * self._rings * self.capacity * numbers

    @property
    def _rings(self) -> int:
        return self.field.sides if self.dataset == "per_side" else 1

    @property
    def answers(self) -> bool:
        """Whether it chooses teams for a second game on what was seen in the first."""
        return self.observations.use == "previous_game"

    @property
    def by_side(self) -> bool:
        """Whether a team's chance depends on the side it plays."""
        return self.side != "shared"

    def init(self, rng: Generator) -> BerteamState:
        """Returns random weights and no winners."""
        field, looking = self.field, self.observations
        networks = field.sides if self.side == "separate" else 1
        device = torch.device(self.device)
        return BerteamState(
            tuple(untrained(self._built(rng), device) for _ in range(networks)),
            tuple(
                no_winners(self.capacity, field.team_size, looking.rows, looking.numbers) for _ in range(self._rings)
            ),  # a memory of its own for each: a checkpoint takes no tensor twice
            0,
        )

    def learn(
        self, state: BerteamState, outcomes: Outcomes, seen: Experience, fitness: Floats, rng: Generator
    ) -> tuple[BerteamState, Selecting]:
        """Remembers the winners and, every ``train_every`` epochs, trains the network to complete them."""
        return self.study(state, self.examples(outcomes, seen, np.ones_like(outcomes.scores, dtype=np.bool_)), rng)

    def study(self, state: BerteamState, new: Examples, rng: Generator) -> tuple[BerteamState, Selecting]:
        """Remembers the ``new`` examples of an epoch and, every ``train_every`` epochs, trains the network."""
        rings = tuple(
            pushed(ring, new[np.flatnonzero(new.sides % len(state.winners) == k)], self.field.members)
            for k, ring in enumerate(state.winners)
        )
        after = replace(state, winners=rings, epochs=state.epochs + 1)
        held = sum(len(ring) for ring in rings)
        if after.epochs % self.train_every:
            return after, Selecting(buffer=held)
        if not held:
            return after, Selecting(skipped=1)
        learnt, losses = list(state.learnt), []
        for k, before in enumerate(state.learnt):
            own = (rings[k],) if self.side == "separate" else rings
            if any(len(ring) for ring in own):
                learnt[k], loss = updated(
                    self._network,
                    before,
                    self._minibatches(own, rng),
                    self._loss,
                    rng,
                    learning_rate=self.learning_rate,
                    averaging=self.averaging,
                )
                losses.append(loss)
        steps = len(losses) * self.batch_size // self.minibatch_size
        return replace(after, learnt=tuple(learnt)), Selecting(steps, float(np.mean(losses)), held)

    def examples(self, outcomes: Outcomes, seen: Experience, chosen: Bools) -> Examples:
        """Returns the teams of an epoch to learn from, with what was known when they were chosen.

        Args:
            outcomes: of the epoch's games.
            seen: what the players saw in them.
            chosen: (B, S) whose outcomes count.
        """
        games, sides = outcomes.scores.shape
        chosen = chosen.copy()
        known = nothing_seen((games, sides), self.field.team_size, self.observations.rows, self.observations.numbers)
        if self.observations.use == "self":
            known = self._seen(seen, games)
        if self.answers:
            first, second = np.arange(games // 2), np.arange(games // 2, games)
            chooser = first % sides
            chosen[second] &= chooser[:, np.newaxis] == np.arange(sides)
            looked = self._seen(seen, games)[first, chooser]
            known.rows[second, chooser], known.lengths[second, chooser] = looked.rows, looked.lengths
        log_uniform = -float(np.log(self.field.allowed.sum(axis=1)).sum()) if self.weighting else None
        losers = self.loss == "l1"
        return harvest(outcomes, known, chosen, self.draw_weight, self.weight_cap, log_uniform, losers=losers)

    def _seen(self, experience: Experience, games: int) -> Seen:
        """Returns what the members of all teams saw in ``games`` games, (B, S)."""
        return seen_in(experience, games, self.field.sides, self.observations)

    def _minibatches(self, rings: tuple[Winners, ...], rng: Generator) -> Iterator[list[tuple[Examples, float]]]:
        """Yields the minibatches of an update, each drawn anew, in parts that the memory holds."""
        field, players = self.field, rings[0].held.rows.shape[1:3]
        for _ in range(self.batch_size // self.minibatch_size):
            examples = minibatch(rings, self.minibatch_size, self.weight_half_life, rng)
            if self.side != "token":
                examples = replace(examples, sides=np.zeros_like(examples.sides))
            # The L1 loss compares the teams of a minibatch with each other: it has to see them all.
            whole = self.loss == "l1"
            yield in_parts(examples, len(examples) if whole else self._network.rows(field.team_size, *players))

    def tensors(self, state: BerteamState) -> dict[str, Any]:
        """Returns all that ``state`` holds as named tensors, without copies."""
        return state.tensors()

    def restored(self, tensors: dict[str, Any]) -> BerteamState:
        """Returns the state that ``tensors`` gave these.

        Raises:
            ValueError: they are of another network.
        """
        state = restored(tensors, self.device)
        check_weights(state.learnt, self._network)
        return state

    @cached_property
    def _network(self) -> TeamNetwork:
        """The architecture; the weights it was built with are never used."""
        return self._built(np.random.default_rng(0)).to(self.device)

    def _built(self, rng: Generator) -> TeamNetwork:
        """Returns a network with random weights."""
        field = self.field
        with seeded(rng, CPU):
            return TeamNetwork(
                field.members,
                field.team_size,
                self.layers,
                self.width,
                self.heads,
                self.dropout,
                self.position,
                field.sides if self.side == "token" else 1,
                self._embedder() if self.observes else None,
            )

    def _embedder(self) -> Embedder:
        """Returns what makes one token of what a member saw, with random weights."""
        looking = self.observations
        return embedder(looking.embed, looking.numbers, self.width, self.heads, looking.lstm_layers, self.dropout)

    def _loss(self, network: Callable[..., Tensor], examples: Examples, rng: Generator) -> Tensor:
        """Returns what an update goes down."""
        drops = self.observations.drop_input, self.observations.drop_player
        if self.loss == "l1":
            entropy = self.entropy_coef, self.entropy_clip
            return best_response_loss(network, examples, self.field.allowed, *entropy, *drops, rng)
        return masking_loss(network, examples, self.field.members, *drops, rng)
