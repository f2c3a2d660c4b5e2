"""The loop does what Algorithm 1 says, in its order."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from berteam_cli import build
from berteam_cli.config import checked
from berteam_cli.selector.uniform import Uniform
from berteam_cli.training import Probes, begin, epoch, generator
from tests.test_config import composed

RPS = ["env=rps", "population=ppo6", "learner.n_steps=8", "learner.minibatch_size=4", "games_per_epoch=12"]


def parts(*overrides):
    return build.parts(checked(composed(*RPS, *overrides)))


@dataclass(frozen=True, eq=False)
class Witness(Uniform):
    """A uniform selector that remembers what it was asked and told."""

    asked: list = field(default_factory=list)
    told: list = field(default_factory=list)

    def select(self, state, games, ages, rng):
        self.asked.append((games, ages.copy()))
        return super().select(state, games, ages, rng)

    def learn(self, state, outcomes, seen, fitness, rng):
        self.told.append(outcomes)
        return super().learn(state, outcomes, seen, fitness, rng)


def test_the_selector_is_asked_with_the_ages_and_told_the_outcomes():
    made = parts("selector=uniform", "optimizer.protect_new=0")
    witness = Witness(made.selector.field, "matching")
    made = replace(made, selector=witness)
    run = begin(made)
    for number in range(3):
        ages = run.population.age.copy()
        run, report = epoch(run, made)
        assert witness.asked[number][0] == 12
        np.testing.assert_array_equal(witness.asked[number][1], ages)
        assert witness.told[number] is report.outcomes


def test_games_are_rated_before_members_are_renewed():
    made = parts("selector=uniform", "optimizer.protect_new=100")
    run = begin(made)
    for _ in range(2):
        before = run.population.fitness.copy()
        run, report = epoch(run, made)
        rated = made.optimizer.fitness.rated(before, report.outcomes)
        np.testing.assert_allclose(run.population.fitness, rated - rated.mean())
    assert run.population.fitness.any()
    assert run.population.captain_games.sum() == 2 * 12 * 2
    assert run.played == 24


def test_members_learn_from_the_games_of_the_epoch():
    made = parts("selector=uniform", "optimizer.protect_new=100")
    _, report = epoch(begin(made), made)
    places = np.bincount(report.outcomes.lineups.teams.ravel(), minlength=6)
    assert {learnt.row: learnt.steps for _, learnt in report.learnt} == dict(enumerate(places))
    assert any(learnt.updates for _, learnt in report.learnt)


def test_the_selector_learns_from_the_games_of_the_epoch():
    made = parts("selector=mcaa", "optimizer.protect_new=100")
    run, report = epoch(begin(made), made)
    assert run.selection.epochs == 1
    assert run.selection.wins.sum() == report.outcomes.winners.size > 0


def test_who_is_replaced_is_one_epoch_old_and_named():
    made = parts("selector=uniform", "optimizer.protect_new=0", "optimizer.replacements=3")
    run, report = epoch(begin(made), made)
    assert report.replaced == []  # everyone was of age 0, and at most that age is protected
    run, report = epoch(run, made)
    assert len(report.replaced) == 3
    assert set(np.flatnonzero(run.population.age == 1)) == {x.removed for x in report.replaced}


def test_fixed_policies_are_not_watched():
    made = parts("optimizer=fixed")
    assert not made.optimizer.learns
    _, report = epoch(begin(made), made)
    assert report.learnt == []


def test_streams_are_apart():
    """No two purposes or epochs share random numbers, and asking again gives the same."""
    draws = {generator(7, purpose, number).integers(2**62) for purpose in range(4) for number in range(50)}
    assert len(draws) == 200
    assert generator(7, 1, 3).integers(2**62) in draws


def test_probes_play_members_as_they_are_evaluated_against_fixed_policies():
    made = parts("selector=uniform")
    run = begin(made)
    probes = Probes(made, 5)
    teams, others = np.repeat(np.arange(6), 6).reshape(-1, 1), np.tile([0, 1, 2], 12).reshape(-1, 1)
    outcomes = probes.play(run.population, teams.repeat(2, axis=1), others.repeat(2, axis=1), 6)
    np.testing.assert_array_equal(outcomes.lineups.teams[:, 0, 0], teams[:, 0])
    np.testing.assert_array_equal(outcomes.lineups.teams[:, 1, 0], others[:, 0] + 6)
    assert probes.steps == 36
    # Rock does not win against paper from either side: whatever a member shows, the record is from its own view.
    np.testing.assert_array_equal(outcomes.scores.sum(axis=1), 1)


def test_probes_among_three_sides_are_told_from_the_members_view():
    made = parts("selector=uniform", "env.sides=3")
    probes = Probes(made, 5)
    outcomes = probes.play(begin(made).population, np.zeros((3, 2), int), np.array([[0, 0]] * 3), 3)
    np.testing.assert_array_equal(outcomes.lineups.teams[:, 0], 0)
    np.testing.assert_array_equal(outcomes.lineups.teams[:, 1:], 6)
    np.testing.assert_array_equal(outcomes.scores[:, 1], outcomes.scores[:, 2])  # two copies of rock fare alike


def test_the_clock_counts_every_part():
    made = parts("selector=uniform")
    _, report = epoch(begin(made), made)
    assert set(report.seconds) == {"select_s", "play_s", "learn_s", "probe_s", "renew_s", "selector_s"}
    assert all(seconds >= 0 for seconds in report.seconds.values())
    assert report.env_steps == pytest.approx(report.outcomes.steps.sum())
