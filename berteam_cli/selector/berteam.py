"""BERTeam: a transformer that learns from winning teams which members to put together; paper, Section 3."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import torch
from numpy.random import Generator

from berteam_cli.outcomes import OPEN, Floats, Ints, Lineups, Outcomes
from berteam_cli.selector.base import Field, Selecting, TeamDistribution, unordered_teams
from berteam_cli.selector.captains import SCHEMES, captains, opening
from berteam_cli.selector.chances import log_chances, total_distribution
from berteam_cli.selector.filling import drawn, filled, noise
from berteam_cli.selector.network import POSITIONS, Odds, TeamNetwork, odds_of, seeded
from berteam_cli.selector.updates import Learnt, untrained, updated
from berteam_cli.selector.winners import Winners, harvest, no_winners, pushed

LARGEST_WEIGHTED = 8  # T; a team's chance is a sum over 2^T partial teams

CPU = torch.device("cpu")

KINDS = ("weights", "means", "squares", "averages")  # of tensors that the network learns


@dataclass(frozen=True)
class BerteamState:
    """All that BERTeam learnt.

    Attributes:
        learnt: the network's weights and Adam's memory.
        winners: the teams it learns from.
        epochs: how many it has seen.
    """

    learnt: Learnt
    winners: Winners
    epochs: int


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
        capacity: winning teams that are remembered.
        weight_half_life: wins after which a remembered team counts half; 0 for never.
        draw_weight: weight of each team of a draw; 0 leaves draws out.
        learning_rate: Adam's.
        averaging: in [0, 1); teams are chosen with a mean of the weights after each gradient step, in which each counts
            so much of the next. 0 chooses with the newest weights.
        layers: of the encoder, and of the decoder.
        width: numbers in a token.
        heads: of each attention; divides ``width``.
        dropout: chance of a unit to be dropped in training.
        position: "append", "add" or "none": how the network knows the places of a team apart.
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
    learning_rate: float
    averaging: float
    layers: int
    width: int
    heads: int
    dropout: float
    position: str

    def __post_init__(self) -> None:
        """Refuses settings that exclude each other."""
        if self.captain not in SCHEMES:
            raise ValueError(f"selector.captain must be one of {', '.join(SCHEMES)}, but is {self.captain}.")
        if self.position not in POSITIONS:
            raise ValueError(f"selector.position must be one of {', '.join(POSITIONS)}, but is {self.position}.")
        if self.weighting and self.field.team_size > LARGEST_WEIGHTED:
            raise ValueError(
                f"selector.weighting needs teams of at most {LARGEST_WEIGHTED}, "
                f"but they have {self.field.team_size} members; set it to false."
            )
        if self.batch_size % self.minibatch_size:
            raise ValueError(
                f"selector.minibatch_size must divide selector.batch_size, "
                f"but {self.minibatch_size} does not divide {self.batch_size}."
            )
        if self.width % self.heads or self.width % 2:
            raise ValueError(
                f"selector.width must be even and a multiple of selector.heads, {self.heads}, but is {self.width}."
            )

    def init(self, rng: Generator) -> BerteamState:
        """Returns random weights and no winners."""
        winners = no_winners(self.capacity, self.field.team_size)
        return BerteamState(untrained(self._built(rng), torch.device(self.device)), winners, 0)

    def select(self, state: BerteamState, games: int, ages: Ints, rng: Generator) -> Lineups:
        """Returns captains by the scheme, and around each a team that the network completes, with noise.

        Args:
            state: what was learnt so far.
            games: B.
            ages: (N,) epochs since each member was last replaced.
            rng: the only source of chance.
        """
        odds, doubt = self._odds(state), noise(ages, self.noise_half_life)
        begun = opening(self.captain, odds(self._open(1))[0], doubt)
        leaders = captains(self.captain, begun, games, self.field.sides, rng)  # (B, S)

        teams = self._open(leaders.size)
        places = drawn(begun[:, leaders.ravel()].T, rng)
        teams[np.arange(len(teams)), places] = leaders.ravel()
        teams = filled(odds, teams, doubt, rng)

        chances = np.full(len(teams), np.nan)
        if self.weighting:
            chances = log_chances(odds, teams, begun, doubt)
        return Lineups(teams.reshape(*leaders.shape, -1), leaders, chances.reshape(leaders.shape))

    def sample(self, state: BerteamState, count: int, rng: Generator) -> Ints:
        """Returns (count, T) teams filled from nobody, without noise."""
        return filled(self._odds(state), self._open(count), np.zeros(self.field.members), rng)

    def distribution(self, state: BerteamState) -> TeamDistribution:
        """Returns the total distribution (paper, Section 5) over unordered teams; N^(T-1) grows fast."""
        members, size = self.field.members, self.field.team_size
        exchangeable = self.position == "none"
        chances = total_distribution(self._odds(state), members, size, exchangeable=exchangeable)
        return TeamDistribution(unordered_teams(members, size), chances / chances.sum())  # rounding

    def captains(self, state: BerteamState) -> Floats:
        """Returns (N,) the mean over places of the network's first choice, without noise (paper, Section 5)."""
        return self._odds(state)(self._open(1))[0].mean(axis=0)

    def learn(self, state: BerteamState, outcomes: Outcomes, rng: Generator) -> tuple[BerteamState, Selecting]:
        """Remembers the winners and, every ``train_every`` epochs, trains the network to complete them."""
        members = self.field.members if self.weighting else None
        winners = pushed(state.winners, *harvest(outcomes, self.draw_weight, self.weight_cap, members))
        after = replace(state, winners=winners, epochs=state.epochs + 1)
        if after.epochs % self.train_every or not len(winners):
            return after, Selecting(buffer=len(winners))

        minibatches = self.batch_size // self.minibatch_size
        learnt, loss = updated(
            self._network,
            state.learnt,
            winners,
            rng,
            minibatches=minibatches,
            size=self.minibatch_size,
            weight_half_life=self.weight_half_life,
            learning_rate=self.learning_rate,
            averaging=self.averaging,
        )
        return replace(after, learnt=learnt), Selecting(minibatches, loss, len(winners))

    def tensors(self, state: BerteamState) -> dict[str, Any]:
        """Returns all that ``state`` holds as named tensors, without copies."""
        learnt, winners = state.learnt, state.winners
        named = {f"{kind}.{name}": value for kind in KINDS for name, value in getattr(learnt, kind).items()}
        counts = {"steps": learnt.steps, "pushed": winners.pushed, "epochs": state.epochs}
        return {
            **named,
            "winners.teams": torch.from_numpy(winners.teams),
            "winners.weights": torch.from_numpy(winners.weights),
            **{name: torch.tensor(count) for name, count in counts.items()},
        }

    def restored(self, tensors: dict[str, Any]) -> BerteamState:
        """Returns the state that ``tensors`` gave these."""
        named: dict[str, dict[str, torch.Tensor]] = {kind: {} for kind in KINDS}
        for name, value in tensors.items():
            kind, _, parameter = name.partition(".")
            if kind in named:
                named[kind][parameter] = value.to(self.device)
        teams, weights = tensors["winners.teams"].cpu().numpy(), tensors["winners.weights"].cpu().numpy()
        return BerteamState(
            Learnt(**named, steps=int(tensors["steps"])),
            Winners(teams, weights, int(tensors["pushed"])),
            int(tensors["epochs"]),
        )

    @cached_property
    def _network(self) -> TeamNetwork:
        """The architecture; the weights it was built with are never used."""
        return self._built(np.random.default_rng(0)).to(self.device)

    def _built(self, rng: Generator) -> TeamNetwork:
        """Returns a network with random weights."""
        with seeded(rng, CPU):
            return TeamNetwork(
                self.field.members,
                self.field.team_size,
                self.layers,
                self.width,
                self.heads,
                self.dropout,
                self.position,
            )

    def _odds(self, state: BerteamState) -> Odds:
        """Returns the conditionals of the network in ``state``."""
        return odds_of(self._network, state.learnt.used)

    def _open(self, count: int) -> Ints:
        """Returns (count, T) teams that nobody stands in yet."""
        return np.full((count, self.field.team_size), OPEN)
