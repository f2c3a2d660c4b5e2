"""The pool of the past: who is kept, who is met how often, and that the frozen stay as they were."""

import numpy as np
import pytest

from berteam_cli.acting import joined
from berteam_cli.games import pairings
from berteam_cli.opponents.past import Past, Snapshot, thinned
from berteam_cli.opponents.record import Record
from berteam_cli.outcomes import NOBODY
from berteam_cli.population import policies
from berteam_cli.training import begin, epoch
from tests.makers import random_networks
from tests.opponents.makers import parts

ANY = random_networks(2, parts().games.env)


def snapshot(number, *record, island=NOBODY):
    return Snapshot(number, island, np.array([1, 4]), ANY, Record(*record))


def pool_settings(**changed):
    usual = {"games": 4, "snapshot_every": 1, "snapshot_members": None, "pool_size": 5, "draw": "prioritised"}
    return Past(
        **usual | {"power": 2.0, "mix_uniform": 0.1, "prior_games": 4.0, "half_life": 0.0, "prior": 0.5} | changed
    )


POOL = (snapshot(0, 3, 4), snapshot(5, 0, 4), snapshot(9))


def test_who_is_hard_to_beat_is_met_more_often_by_hand():
    # p = (2 + 3) / 8, 2 / 8 and 2 / 4; squares of 1 - p are 9, 36 and 16 of 64ths.
    np.testing.assert_allclose([pool_settings().estimate(x) for x in POOL], [0.625, 0.25, 0.5])
    np.testing.assert_allclose(pool_settings(mix_uniform=0.0).chances(POOL), np.array([9, 36, 16]) / 61)
    np.testing.assert_allclose(pool_settings().chances(POOL), 0.9 * np.array([9, 36, 16]) / 61 + 0.1 / 3)
    np.testing.assert_allclose(pool_settings(power=0.0).chances(POOL), 1 / 3)
    np.testing.assert_allclose(pool_settings(draw="uniform").chances(POOL), 1 / 3)


def test_snapshots_are_drawn_by_their_chances_and_each_team_is_of_one():
    rng, sides = np.random.default_rng(0), np.zeros(6000, dtype=int)
    teams, tables, guests = pool_settings().invited(POOL, 6, 2, sides, rng)
    met = np.bincount([[0, 5, 9].index(guest.epoch) for guest in guests])
    np.testing.assert_allclose(met / 6000, pool_settings().chances(POOL), atol=4 * np.sqrt(0.25 / 6000))
    assert [len(table.kind) for table in tables] == [2, 2, 2]
    for team, guest in zip(teams[:200], guests[:200], strict=True):
        k = [0, 5, 9].index(guest.epoch)
        places = team - 6 - 2 * k  # rows of this snapshot's members 1 and 4
        assert set(places) <= {0, 1}
        assert guest.name == f"{guest.epoch}:" + "-".join(sorted("14"[place] for place in places))


def test_a_record_forgets_half_in_its_half_life():
    assert Record(4, 8).after(1.0, 2, 1.0) == (3, 6)
    assert Record(4, 8).after(0.0, 0, 2.0) == pytest.approx((4 / np.sqrt(2), 8 / np.sqrt(2)))
    assert Record(4, 8).after(1.5, 2, 0.0) == (5.5, 10)


def test_thinning_by_hand():
    def after_all(numbers, most):
        pool = ()
        for number in numbers:
            pool = thinned((*pool, snapshot(number)), most)
        return [x.epoch for x in pool]

    assert after_all([0, 10, 20, 30, 40], 4) == [0, 20, 30, 40]
    assert after_all([0, 10, 20, 30, 40, 50], 4) == [0, 20, 40, 50]
    assert after_all([0, 10, 20], 2) == [0, 20]


@pytest.mark.parametrize("most", [3, 5, 12])
def test_what_is_left_is_evenly_spread(most):
    """No gap is more than twice what even ones would be, however long the run; the first and the newest are there."""
    pool = ()
    for number in range(300):
        pool = thinned((*pool, snapshot(number)), most)
        kept = np.array([x.epoch for x in pool])
        assert (kept[0], kept[-1], len(kept)) == (0, number, min(most, number + 1))
        if number >= 2 * most:
            assert np.diff(kept).max() <= 2 * np.ceil(number / (most - 1))


def test_each_kind_is_thinned_by_itself_by_hand():
    def left(pool, most):
        return [x.key for x in thinned(tuple(pool), most)]

    own = [snapshot(number) for number in (0, 10, 30)]
    # Gaps among its kind: 30 around (10, own), 20 around (20, exploiters); neighbours of another kind do not count.
    mixed = [*own[:2], *(snapshot(number, island=1) for number in (10, 20, 30)), own[2]]
    assert left(mixed, 5) == [(0, -1), (10, -1), (10, 1), (30, 1), (30, -1)]
    assert left(mixed, 4) == [(0, -1), (10, 1), (30, 1), (30, -1)]
    assert left(mixed, 2) == [(0, -1), (30, -1)]  # where all are ends, exploiters go first
    alike = [own[0], own[1], snapshot(0, island=1), snapshot(10, island=1), snapshot(20, island=1), snapshot(20)]
    assert left(alike, 5) == [(0, -1), (10, -1), (0, 1), (20, 1), (20, -1)]  # of equal gaps too


def test_exploiters_that_often_begin_anew_leave_the_own_past_where_it_was():
    """Half as long as an hour of experiment=strong: a snapshot every 25 epochs, exploiters' every 50 at most."""
    rng, pool, again = np.random.default_rng(0), (snapshot(0),), 0
    for number in range(1, 6001):
        if number % 25 == 0:
            pool = thinned((*pool, snapshot(number)), 40)
        if number - again == 50 or rng.random() < 0.02:
            pool, again = thinned((*pool, snapshot(number, island=1)), 40), number
    own = np.array([x.epoch for x in pool if x.island == NOBODY])
    assert (own[0], own[-1]) == (0, 6000)
    assert 15 <= len(own) <= 25
    assert np.diff(own).max() <= 2 * np.ceil(6000 / 15)


def test_the_frozen_play_as_they_did_when_the_living_have_learnt():
    made = parts("opponents=past", "opponents.snapshot_every=100", "learner.learning_rate=0.1")
    run = begin(made)
    teams = np.random.default_rng(0).integers(6, size=(2, 300, 2))

    def actions(table, first=0):
        return made.games.play(table, pairings(*(teams + first)), 5, record=True)[1].actions

    before = actions(policies(made.optimizer.islands, run.population, explore=True))
    for _ in range(5):
        run, _ = epoch(run, made)
    assert [x.epoch for x in run.league.pool] == [0]
    now = policies(made.optimizer.islands, run.population, explore=True)
    np.testing.assert_array_equal(actions(joined([now, run.league.pool[0].policies]), 6), before)
    assert (actions(now) != before).mean() > 0.05


def test_the_fittest_of_those_that_learn_are_frozen():
    made = parts("opponents=past", "opponents.snapshot_every=1", "opponents.snapshot_members=2")
    run, _ = epoch(begin(made), made)
    first, last = run.league.pool
    np.testing.assert_array_equal(first.members, [0, 1])  # all are equally fit: the first
    np.testing.assert_array_equal(last.members, np.sort(np.argsort(-run.population.fitness, kind="stable")[:2]))


def test_what_was_played_is_in_the_records():
    made = parts("opponents=past", "opponents.past_share=0.25", "opponents.snapshot_every=100", "opponents.half_life=0")
    run, beaten = begin(made), 0.0
    for number in range(1, 4):
        run, report = epoch(run, made)
        beaten += report.met.beaten.sum()
        assert run.league.pool[0].record == (beaten, 3 * number)
    assert made.opponents.standings(run.league) == {report.met.teams[0].whose: (1.0, (2 + beaten) / (4 + 9))}
