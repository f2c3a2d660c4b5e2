"""BERTeam: a transformer that learns from winning teams which members to put together; paper, Section 3."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import torch
from numpy.random import Generator
from torch import Tensor

from berteam_cli.outcomes import OPEN, Bools, Experience, Floats, Ints, Lineups, Outcomes
from berteam_cli.selector import beam
from berteam_cli.selector.base import (
    Field,
    Selecting,
    TeamDistribution,
    exactly,
    most_probable,
    unordered_teams,
)
from berteam_cli.selector.berteam_state import BerteamState, restored
from berteam_cli.selector.best_response import best_response_loss
from berteam_cli.selector.captains import SCHEMES, captains, opening
from berteam_cli.selector.chances import (
    LARGEST_SUMMED,
    ORDERS,
    estimated_log_chances,
    log_chances,
    total_distribution,
)
from berteam_cli.selector.embedders import Embedder, embedder
from berteam_cli.selector.filling import Odds, drawn, filled, noise, proposal, sharpened
from berteam_cli.selector.masking import masking_loss
from berteam_cli.selector.network import LONGEST, POSITIONS, TeamNetwork, by_owner, odds_of, seeded
from berteam_cli.selector.observations import Looking, Seen, nothing_seen, seen_in
from berteam_cli.selector.updates import untrained, updated
from berteam_cli.selector.winners import Examples, Winners, harvest, in_parts, minibatch, no_winners, pushed

CPU = torch.device("cpu")
LOSSES = ("mlm", "l1")
KNOWING = ("shared", "token", "separate")  # how a side that is chosen for is told from the others


@dataclass(frozen=True, eq=False)  # a field's arrays have no truth value
class Berteam:
    """Settings of BERTeam.

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
        if self.loss == "l1" and not self.weighting:
            raise ValueError("selector.loss=l1 needs selector.weighting=true: else it finds what was chosen often.")
        if self.batch_size % self.minibatch_size:
            raise ValueError(
                f"selector.minibatch_size must divide selector.batch_size, "
                f"but {self.minibatch_size} does not divide {self.batch_size}."
            )
        if self.width % self.heads or self.width % 2:
            raise ValueError(
                f"selector.width must be even and a multiple of selector.heads, {self.heads}, but is {self.width}."
            )

    @property
    def observes(self) -> bool:
        """Whether it wants to know what players saw."""
        return self.observations.use != "none"

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
        rings = field.sides if self.dataset == "per_side" else 1
        device = torch.device(self.device)
        return BerteamState(
            tuple(untrained(self._built(rng), device) for _ in range(networks)),
            tuple(
                no_winners(self.capacity, field.team_size, looking.rows, looking.numbers) for _ in range(rings)
            ),  # a memory of its own for each: a checkpoint takes no tensor twice
            0,
        )

    def select(self, state: BerteamState, games: int, ages: Ints, rng: Generator) -> Lineups:
        """Returns captains by the scheme, and around each a team that the network completes, with noise.

        Args:
            state: what was learnt so far.
            games: B.
            ages: (N,) epochs since each member was last replaced.
            rng: the only source of chance.
        """
        sides = np.arange(self.field.sides if self.by_side else 1)
        known = np.broadcast_to(np.arange(self.field.sides) % len(sides), (games, self.field.sides))
        return self._chosen(self._odds(state, sides), known, ages, rng)

    def select_for(self, state: BerteamState, sides: Ints, ages: Ints, rng: Generator) -> Lineups:
        """Returns line-ups of one team each, (B, 1), as ``select`` makes them, for ``sides``, (B,)."""
        owners = np.arange(self.field.sides if self.by_side else 1)
        return self._chosen(self._odds(state, owners), (sides % len(owners))[:, np.newaxis], ages, rng)

    def answer(self, state: BerteamState, lineups: Lineups, seen: Experience, ages: Ints, rng: Generator) -> Lineups:
        """Returns a second game for each of ``lineups``: side b % S of game b chooses anew, on what its members saw.

        The captain of the new team is drawn by the scheme too.
        """
        games = np.arange(len(lineups))
        chooser = games % self.field.sides
        looked = self._seen(seen, len(lineups))[games, chooser]
        side = chooser if self.by_side else np.zeros_like(chooser)
        new = self._chosen(self._odds(state, side, looked), games[:, np.newaxis], ages, rng)
        teams, leaders = lineups.teams.copy(), lineups.captains.copy()
        chances = np.full(leaders.shape, np.nan)
        teams[games, chooser], leaders[games, chooser] = new.teams[:, 0], new.captains[:, 0]
        chances[games, chooser] = new.log_chances[:, 0]
        return Lineups(teams, leaders, chances)

    def sample(
        self,
        state: BerteamState,
        count: int,
        rng: Generator,
        side: int | None = None,
        seen: Seen | None = None,
        sharpening: float = 1.0,
    ) -> Ints:
        """Returns (count, T) teams filled from nobody, without noise.

        Args:
            state: what was learnt so far.
            count: how many.
            rng: the only source of chance.
            side: for which; None for one drawn at random for each team.
            seen: (count,) what the members of each saw of the opponent; None for nothing.
            sharpening: power of the conditionals; above 1 the likelier teams come even more often.
        """
        sides = self._sides(side)
        if seen is None:
            known = np.arange(count) % len(sides)
            odds = self._odds(state, sides)
        else:
            known = np.arange(count)
            odds = self._odds(state, sides[known % len(sides)], seen)
        return filled(sharpened(self._own(odds), sharpening), self._open(count), known, rng)

    def distribution(self, state: BerteamState, side: int | None = None) -> TeamDistribution:
        """Returns the total distribution (paper, Section 5) over unordered teams; N^(T-1) grows fast.

        Args:
            state: what was learnt so far.
            side: for which; None for the mean over sides.
        """
        sides = self._sides(side)
        odds = self._own(self._odds(state, sides))
        chances = sum(
            total_distribution(odds, self.field, k, exchangeable=self._exchangeable) for k in range(len(sides))
        )
        teams = unordered_teams(self.field.members, self.field.team_size)
        possible = chances > 0
        return TeamDistribution(teams[possible], chances[possible] / chances.sum())  # rounding

    def likeliest(self, state: BerteamState, count: int, rng: Generator) -> TeamDistribution:
        """Returns the ``count`` most probable unordered teams; by a beam search where they cannot all be listed.

        Where sides are told apart, the search is made for each; what it finds weighs the mean over sides.
        """
        if exactly(self.field):
            return most_probable(self.distribution(state), count)
        sides = self._sides(None)
        odds = self._own(self._odds(state, sides))
        return beam.likeliest(odds, self.field, count, rng, exchangeable=self._exchangeable, sources=len(sides))

    def captains(self, state: BerteamState) -> Floats:
        """Returns (N,) the mean over places of the network's first choice, without noise (paper, Section 5)."""
        sides = self._sides(None)
        return self._own(self._odds(state, sides))(self._open(len(sides)), np.arange(len(sides))).mean(axis=(0, 1))

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
        if after.epochs % self.train_every or not held:
            return after, Selecting(buffer=held)
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

    def remarks(self) -> list[str]:
        """Returns what is estimated."""
        size = self.field.team_size
        if not self.weighting or size <= LARGEST_SUMMED:
            return []
        return [
            f"selector.weighting: teams of {size} can be filled in too many orders to sum over; "
            f"the chance of each is estimated from {ORDERS} random ones."
        ]

    def tensors(self, state: BerteamState) -> dict[str, Any]:
        """Returns all that ``state`` holds as named tensors, without copies."""
        return state.tensors()

    def restored(self, tensors: dict[str, Any]) -> BerteamState:
        """Returns the state that ``tensors`` gave these."""
        return restored(tensors, self.device)

    def embeddings(self, state: BerteamState) -> Floats:
        """Returns (N, width) the token of each member; the mean over networks where each side has its own."""
        tokens = [learnt.used["writer.tokens.weight"][: self.field.members] for learnt in state.learnt]
        return torch.stack(tokens).mean(dim=0).double().cpu().numpy()

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

    @property
    def _exchangeable(self) -> bool:
        """Whether nothing tells the places of a team apart."""
        return self.position == "none" and self.field.alike

    def _sides(self, side: int | None) -> Ints:
        """Returns which sides are to be told apart: ``side``, or all."""
        return np.arange(self.field.sides if self.by_side else 1) if side is None else np.array([side])

    def _odds(self, state: BerteamState, sides: Ints, seen: Seen | None = None) -> Odds:
        """Returns the conditionals of the network, or of those of the sides.

        Args:
            state: what was learnt.
            sides: (U,) for which side each known thing is; 0 where sides are alike.
            seen: (U,) what the members saw; None for nothing.
        """
        if self.side != "separate":
            return odds_of(self._network, state.learnt[0].used, sides, seen)
        own = [odds_of(self._network, x.used, np.zeros_like(sides), seen) for x in state.learnt]
        return by_owner(own, sides)

    def _own(self, odds: Odds) -> Odds:
        """Returns what teams are drawn from without noise."""
        return proposal(odds, np.zeros(self.field.members), self.field.allowed)

    def _chosen(self, odds: Odds, known: Ints, ages: Ints, rng: Generator) -> Lineups:
        """Returns line-ups with (B, S') teams drawn with captains and noise; ``known``, (B, S'), as of Odds."""
        field, doubt = self.field, noise(ages, self.noise_half_life)
        sources = int(known.max()) + 1
        begun = opening(self.captain, odds(self._open(sources), np.arange(sources)), doubt, field.allowed)
        leaders = captains(self.captain, begun.sum(axis=1)[known], rng)  # (B, S')

        flat, who = known.ravel(), leaders.ravel()
        teams = self._open(len(flat))
        teams[np.arange(len(flat)), drawn(begun[flat, :, who], rng)] = who
        doubted = proposal(odds, doubt, field.allowed)
        teams = filled(doubted, teams, flat, rng)

        chances = np.full(len(teams), np.nan)
        if self.weighting and field.team_size <= LARGEST_SUMMED:
            chances = log_chances(doubted, teams, flat, begun)
        elif self.weighting:
            chances = estimated_log_chances(doubted, teams, flat, begun, rng)
        return Lineups(teams.reshape(*leaders.shape, -1), leaders, chances.reshape(leaders.shape))

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
        prefixes = field.team_size if self.loss == "l1" else 1  # rows of the network that one team takes
        for _ in range(self.batch_size // self.minibatch_size):
            examples = minibatch(rings, self.minibatch_size, self.weight_half_life, rng)
            if self.side != "token":
                examples = replace(examples, sides=np.zeros_like(examples.sides))
            yield in_parts(examples, max(1, self._network.rows(field.team_size, *players) // prefixes))

    def _open(self, count: int) -> Ints:
        """Returns (count, T) teams that nobody stands in yet."""
        return np.full((count, self.field.team_size), OPEN)
