"""Starts for practice are as they are told, and a game goes on from them by the rules."""

import numpy as np
import pytest

from mctf.kernel import BLUE_WON, RED_WON, RUNNING, finished, step
from mctf.observe import observation_size, observe
from mctf.practice import BY_THE_RULES, Starts, practise
from mctf.rewards import TERMS, make_reward, rewards
from mctf.rules import make_rules
from mctf.scripted import NAMES, act
from mctf.start import reset
from mctf.state import EVENTS, empty

GAMES = 300
HALF, LENGTH, MARGIN = 100.0, 200.0, 2.0


def started(starts, games=GAMES, **rules):
    rules = make_rules(**rules)
    state = empty(games, rules)
    for b in range(games):
        state.stream[b] = b
        reset(state, b, rules)
        practise(state, b, starts, rules)
    return state, rules


def at_home(state):
    """Returns (B, V) who is on the own half, with blue on the right."""
    return np.where(np.arange(4) < 2, state.pos[..., 0] >= HALF, state.pos[..., 0] <= HALF)


def check_places(state, rules):
    low, high = MARGIN, np.array([rules.width_m, rules.height_m]) - MARGIN
    assert ((state.pos >= low) & (state.pos <= high)).all()
    assert (state.prev_pos == state.pos).all()
    assert (state.was_pos == state.pos).all()
    assert (state.on_own_side == at_home(state)).all()
    assert not state.is_tagged.any()
    assert not state.events.any()
    assert not state.score.any()
    assert not state.speed.any()


def test_random():
    state, rules = started(Starts(random=1.0))
    check_places(state, rules)
    assert at_home(state).all()
    assert len(np.unique(state.pos[..., 0])) == 4 * GAMES
    assert state.pos[..., 1].min() < 10.0
    assert state.pos[..., 1].max() > 90.0
    assert np.ptp(state.heading) > 350.0
    assert not state.has_flag.any()


@pytest.mark.parametrize("near", [3.0, 30.0, 90.0])
def test_near_flag(near):
    """With 90 m a place may be beyond the middle line, or behind a wall, and is put to the wall then."""
    state, rules = started(Starts(near_flag=1.0, near_flag_m=near))
    check_places(state, rules)
    homes = np.array([rules.red_home_m, rules.blue_home_m])[[0, 0, 1, 1]]
    distance = np.linalg.norm(state.pos - homes, axis=-1)
    close = distance <= near
    assert close.any(axis=1).all()
    if near < 75.0:
        assert (close.sum(axis=1) == 1).all()
        assert (at_home(state) == ~close).all()
        chosen = close.sum(axis=0) / GAMES
        assert chosen == pytest.approx([0.25] * 4, abs=0.1)  # 4 standard deviations
        assert np.median(distance[close]) == pytest.approx(near * np.sqrt(0.5), rel=0.1)  # uniform in the circle
    assert not state.has_flag.any()


def test_carrying():
    state, rules = started(Starts(carrying=1.0))
    check_places(state, rules)
    assert (state.has_flag.sum(axis=1) == 1).all()
    assert (at_home(state) == ~state.has_flag).all()
    assert state.has_flag.mean(axis=0) == pytest.approx([0.25] * 4, abs=0.1)
    b, v = np.nonzero(state.has_flag)
    them = np.where(v < 2, 1, 0)
    assert (state.flag_taken[b, them]).all()
    assert not state.flag_taken[b, 1 - them].any()
    assert (state.pickup[b, 1 - them]).all()
    assert not state.pickup[b, them].any()
    assert (state.flag_pos[b, them] == state.pos[b, v]).all()
    homes = np.array([rules.blue_home_m, rules.red_home_m])
    assert (state.flag_pos[b, 1 - them] == homes[1 - them]).all()


def test_kinds_are_as_frequent_as_they_are_said():
    state, _ = started(Starts(0.2, 0.3, 0.1, 20.0))
    plain, _ = started(BY_THE_RULES)
    rest = (state.pos == plain.pos).all(axis=(1, 2))
    carrying, near = state.has_flag.any(axis=1), ~at_home(state).all(axis=1)
    assert rest.mean() == pytest.approx(0.4, abs=0.09)
    assert carrying.mean() == pytest.approx(0.1, abs=0.06)
    assert (near & ~carrying).mean() == pytest.approx(0.3, abs=0.09)
    assert (~near & ~carrying & ~rest).mean() == pytest.approx(0.2, abs=0.08)


def test_without_shares_nothing_is_drawn():
    state, rules = started(BY_THE_RULES, 3)
    assert state.stream.tolist() == [0, 1, 2]
    other = empty(1, rules)
    reset(other, 0, rules)
    for name, mine, theirs in zip(state._fields, state, other, strict=True):
        if name not in ("stream", "reach"):
            assert (mine[0] == theirs[0]).all(), name


@pytest.mark.parametrize("profile", ["pyquaticus-2024-06", "clean", "pyquaticus-2025-11"])
def test_a_carrier_wins_by_driving_home(profile):
    """An attacker with the flag goes home; nobody else moves. Who started with it wins, and nobody has grabbed."""
    state, rules = started(Starts(carrying=1.0), 20, profile=profile, max_score=1)
    raw = np.zeros((4, observation_size(rules)))
    won = 0
    for b in range(20):
        v = int(np.flatnonzero(state.has_flag[b])[0])
        ready = state.cooldown[b].copy()
        state.cooldown[b] = 0.0  # nobody tags at once
        assert (ready == rules.tagging_cooldown_s).all()
        while finished(state, b, rules) == RUNNING and state.has_flag[b, v]:
            observe(state, b, rules, raw)
            actions = np.full(4, 16)
            actions[v] = act(NAMES.index("attack_easy"), state, b, v, raw[v], rules)
            step(state, b, actions, rules)
        if finished(state, b, rules) != RUNNING:
            won += 1
            assert finished(state, b, rules) == (BLUE_WON if v < 2 else RED_WON)
            assert state.events[b, v, EVENTS.index("captures")] == 1
        assert state.events[b, :, EVENTS.index("grabs")].sum() == 0
    assert won >= 10


def first_paid(state, rules, term):
    """Plays one step of every game in which nobody moves on purpose; returns (B, V) what ``term`` paid."""
    reward = make_reward("outcome", {"won": 0.0, "lost": 0.0, term: 1.0})
    out, seen = np.zeros(state.has_flag.shape), np.zeros((2, 4, observation_size(rules)))
    for b in range(len(out)):
        step(state, b, np.full(4, 16), rules)
        rewards(reward, state, b, rules, *seen, np.zeros(len(TERMS)), out[b])
    return out


def test_who_grabs_the_flag_in_the_first_step_is_paid():
    state, rules = started(Starts(near_flag=1.0, near_flag_m=30.0))
    paid = first_paid(state, rules, "grabbed")
    assert state.has_flag.any()
    assert (paid == state.has_flag).all()


def test_who_loses_it_in_the_first_step_pays():
    state, rules = started(Starts(carrying=1.0))
    carrying = state.has_flag.copy()
    paid = first_paid(state, rules, "dropped")
    lost = carrying & ~state.has_flag & ~state.capture.any(axis=1, keepdims=True)
    assert lost.any()
    assert (paid == lost).all()


def test_who_brings_it_home_in_the_first_step_is_paid():
    state, rules = started(Starts(carrying=1.0))
    blue = state.has_flag[:, :2].copy()
    state.pos[:, :2][blue] = HALF + 1.0, 50.0
    paid = first_paid(state, rules, "team_captured")
    assert blue.any()
    assert (paid[:, :2] == blue.any(axis=1, keepdims=True)).all()  # both of the team
