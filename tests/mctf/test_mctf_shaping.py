"""Outcomes, potential and the team's share: worked by hand, and over whole games."""

import math

import numpy as np
import pytest

from berteam_cli.acting import fixed_policies
from berteam_cli.games import pairings
from mctf.batch import Batch
from mctf.kernel import RUNNING, TIME_OUT
from mctf.parallel import parallel_env
from mctf.rewards import TERMS, make_reward, rewards
from mctf.rules import make_rules
from mctf.shaping import Shaping, make_shaping
from tests.makers import mctf

DIAGONAL = math.hypot(200.0, 100.0)


def earned(game, reward):
    out, seen = np.zeros(4), np.zeros((2, 4, 45))
    rewards(reward, game.state, 0, game.rules, *seen, np.zeros(len(TERMS)), out)
    return out


@pytest.fixture
def game(scene):
    """Everybody as in the step before."""
    game = scene()
    game.state.was_pos[:] = game.state.pos
    game.state.steps[0] = 2
    return game


def ended(game, captures=(0, 0), time=0.0):
    game.state.score[0, :, 0] = captures
    game.state.time[0] = time
    return game


@pytest.mark.parametrize(
    ("captures", "time", "paid"),
    [
        ((0, 0), 0.0, [0, 0, 0, 0]),
        ((1, 0), 0.0, [1, 1, -1, -1]),
        ((0, 1), 0.0, [-1, -1, 1, 1]),
        ((0, 0), 420.0, [-3, -3, -3, -3]),
    ],
)
def test_outcome(game, captures, time, paid):
    assert earned(ended(game, captures, time), make_reward("outcome", {"drawn": -3.0})).tolist() == paid
    plain = [0.0 if x == -3 else float(x) for x in paid]
    assert earned(game, make_reward("outcome")).tolist() == plain


def test_on_time_more_captures_win(scene):
    game = scene(max_score=3)
    assert earned(ended(game, (2, 1), 420.0), make_reward("outcome", {"drawn": 9.0})).tolist() == [1, 1, -1, -1]
    assert earned(ended(game, (2, 2), 420.0), make_reward("outcome", {"drawn": 9.0})).tolist() == [9] * 4
    assert earned(ended(game, (2, 1), 300.0), make_reward("outcome", {"drawn": 9.0})).tolist() == [0] * 4
    assert earned(ended(game, (3, 3), 420.0), make_reward("outcome")).tolist() == [-1, -1, 1, 1]  # red wins ties
    tied = ended(scene(max_score=3, tie_at_max="draw"), (3, 3))
    assert earned(tied, make_reward("outcome", {"drawn": 9.0})).tolist() == [9] * 4


def shaped(**shaping):
    return make_reward("outcome", {"won": 0.0, "lost": 0.0}, shaping)


def test_coming_nearer_to_the_flag(game):
    game.put(0, 100.0, 50.0)
    game.state.was_pos[0, 0] = 110.0, 50.0
    paid = earned(game, shaped(potential=2.0, potential_discount=0.5))
    assert paid[0] == pytest.approx(2.0 * (0.5 * -75.0 + 85.0) / DIAGONAL)
    # Who stays where they are, at (190, 10), pays for the time that it takes: half of its potential is gone
    assert paid[1] == pytest.approx(2.0 * 0.5 * math.hypot(165.0, 40.0) / DIAGONAL)


def test_the_first_step_counts(game):
    game.put(0, 100.0, 50.0)
    game.state.was_pos[0, 0] = 110.0, 50.0
    game.state.steps[0] = 1
    assert earned(game, shaped(potential=1.0, potential_discount=1.0))[0] == pytest.approx(10.0 / DIAGONAL)


def test_grabbing_carrying_and_losing_the_flag(game):
    """At (35, 50) the opponents' home is 10 m away, the own one 140 m."""
    game.put(0, 35.0, 50.0, has_flag=True)
    game.state.was_pos[0, 0] = 35.0, 50.0
    reward = shaped(potential=1.0, potential_discount=1.0)
    assert earned(game, reward)[0] == pytest.approx(1.0 - 140.0 / DIAGONAL + 10.0 / DIAGONAL)
    game.state.was_carrying[0, 0] = True
    assert earned(game, reward)[0] == 0.0
    game.state.has_flag[0, 0] = False
    assert earned(game, reward)[0] == pytest.approx(-(1.0 - 140.0 / DIAGONAL) - 10.0 / DIAGONAL)


@pytest.mark.parametrize("tagged", [0.0, -1.0, 1.0, 0.25])
def test_being_tagged(game, tagged):
    game.put(0, 35.0, 50.0, is_tagged=True)
    game.state.was_pos[0, 0] = 35.0, 50.0
    reward = shaped(potential=1.0, potential_discount=0.9, potential_tagged=tagged)
    assert earned(game, reward)[0] == pytest.approx(0.9 * tagged + 10.0 / DIAGONAL)
    game.state.was_tagged[0, 0] = True
    assert earned(game, reward)[0] == pytest.approx(-0.1 * tagged)


def test_nothing_is_worth_anything_after_the_end(game):
    game.put(0, 35.0, 50.0)
    game.state.was_pos[0, 0] = 35.0, 50.0
    reward = shaped(potential=1.0, potential_discount=0.9)
    assert earned(ended(game, (1, 0)), reward)[0] == pytest.approx(10.0 / DIAGONAL)
    assert earned(ended(game, (0, 0), 420.0), reward)[0] == pytest.approx(0.1 * 10.0 / DIAGONAL)  # time is up only


def own(terms, before, after):
    return 4.0 * before[14] + 2.0


def test_the_share_of_the_team(game):
    game.state.oob[0, 0] = game.state.oob[0, 3] = True
    game.state.tagged_opponent[0, 2] = 1
    plain = earned(game, make_reward("custom_rew2"))
    assert plain.tolist() == [-1.0, 0.0, 0.05, -1.0]
    assert earned(game, make_reward("custom_rew2", None, {"team_share": 0.5})) == pytest.approx(
        [-0.75, -0.25, -0.2125, -0.7375]
    )
    assert earned(game, make_reward("custom_rew2", None, {"team_share": 1.0})) == pytest.approx(
        [-0.5, -0.5, -0.475, -0.475]
    )


def test_all_is_shared_and_the_teams_sum_stays(game):
    """Own functions and the potential, too; teams may differ in size."""
    before = np.random.default_rng(0).uniform(-5.0, 5.0, (4, 45))
    game.put(0, 60.0, 20.0)
    out, whole = np.zeros(4), {"potential": 1.5}
    for shaping in (whole, whole | {"team_share": 0.3}):
        reward = make_reward(own, {"wall_hit": 1.0}, shaping)
        rewards(reward, game.state, 0, game.rules, before, before, np.zeros(len(TERMS)), out)
        if shaping is whole:
            plain = out.copy()
    means = plain.reshape(2, 2).mean(axis=1).repeat(2)
    assert out == pytest.approx(0.7 * plain + 0.3 * means)
    assert out.reshape(2, 2).sum(axis=1) == pytest.approx(plain.reshape(2, 2).sum(axis=1))


RULES = {"profile": "clean", "world_size_m": (80.0, 50.0), "max_time_s": 120.0}


@pytest.fixture(scope="module")
def sequences():
    """(B, L, V) actions of whole games of all kinds of policies, from one start; 16 behind the end."""
    games = mctf(1, **RULES)
    ours, theirs = np.random.default_rng(0).choice([0, 1, 2, 5, 6], (2, 24, 2))  # attackers, a defender, random
    outcomes, seen = games.play(fixed_policies(range(7)), pairings(ours, theirs), 3, record=True)
    actions = np.full((len(ours), outcomes.steps.max(), 4), 16)
    for b, steps in enumerate(outcomes.steps):
        actions[b, :steps] = seen.actions[b, :, :steps].T
    return actions


def returns(actions, discount, weights=None, **shaping):
    """Returns (B, V) discounted sums of rewards, (B, V) discounted last potentials by hand, and how games ended."""
    rules = make_rules(**RULES)
    batch = Batch(len(actions), rules, reward_weights=weights, shaping=shaping)
    batch.start(np.zeros(len(actions), np.int64))
    sums, last, ends = np.zeros((len(actions), 4)), np.zeros((len(actions), 4)), np.zeros(len(actions), np.int64)
    start = worth(batch._lanes.state, rules)
    for moment in range(actions.shape[1]):
        played = ends == RUNNING
        turn = batch.step(actions[:, moment])
        sums[played] += discount**moment * turn.rewards[played]
        ends[turn.ended.games] = turn.ended.ends
        for b in turn.ended.games:
            last[b] = discount ** (moment + 1) * worth(batch._lanes.state, rules)[b]
    return sums, start, last, ends


def worth(state, rules):
    """Returns (B, V) the potential, written a second time, 0 while tagged."""
    homes = np.array([rules.blue_home_m, rules.red_home_m])
    own, other = homes[[0, 0, 1, 1]], homes[[1, 1, 0, 0]]
    to_own, to_other = (np.linalg.norm(state.pos - x, axis=-1) / math.hypot(80.0, 50.0) for x in (own, other))
    return np.where(state.is_tagged, 0.0, np.where(state.has_flag, 1.0 - to_own, -to_other))


@pytest.mark.parametrize("discount", [0.99, 0.9, 1.0])
def test_the_order_of_policies_stays(sequences, discount):
    """All that a potential adds to a whole game is that of the start, and of the last step if only time is up."""
    plain, start, last, ends = returns(sequences, discount)
    shaped, _, _, again = returns(sequences, discount, potential=2.5, potential_discount=discount)
    assert (ends != RUNNING).all()
    assert (ends == again).all()
    assert {TIME_OUT} < set(ends.tolist())
    decided = ends != TIME_OUT
    assert 3 <= decided.sum() <= 21
    assert shaped[decided] - plain[decided] == pytest.approx(-2.5 * start[decided], abs=1e-9)
    assert shaped[~decided] - plain[~decided] == pytest.approx(-2.5 * (start - last)[~decided], abs=1e-9)
    assert np.abs(last[~decided]).max() > 1e-7
    for v in range(4):
        order = np.argsort(plain[decided, v])
        assert (np.diff(shaped[decided, v][order]) > -1e-9).all()
        assert np.ptp(plain[decided, v]) > 1e-3


def test_the_order_stays_where_the_result_is_paid(sequences):
    """There nothing follows the end on time either, and what a potential adds is that of the start in every game."""
    plain, start, last, ends = returns(sequences, 0.99, {"drawn": -2.0})
    shaped, *_ = returns(sequences, 0.99, {"drawn": -2.0}, potential=2.5, potential_discount=0.99)
    assert np.abs(last[ends == TIME_OUT]).max() > 1e-7
    assert shaped - plain == pytest.approx(-2.5 * start, abs=1e-9)


def test_another_discount_does_not_cancel(sequences):
    plain, start, _, ends = returns(sequences, 0.99)
    other, *_ = returns(sequences, 0.99, potential=2.5, potential_discount=0.9)
    decided = ends != TIME_OUT
    assert np.abs(other + 2.5 * start - plain)[decided].min() > 0.01


def test_the_environment_pays_the_same():
    """The PettingZoo environment and the batch are paid by the same function."""
    shaping = {"potential": 1.0, "team_share": 0.25}
    env = parallel_env("sparse", shaping=shaping, **RULES)
    env.reset(seed=1)
    batch = Batch(1, make_rules(**RULES), "sparse", shaping=shaping)
    batch.start([1])
    _, paid, *_ = env.step(dict.fromkeys(env.agents, 4))
    assert list(paid.values()) == batch.step([[4] * 4]).rewards[0].tolist()
    assert all(paid.values())


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"potential": -1.0}, "potential must be a finite number >= 0, but is -1.0"),
        ({"potential": math.inf}, "potential must be a finite number >= 0, but is inf"),
        ({"potential_discount": 1.5}, r"potential_discount must be a finite number in \[0, 1\], but is 1.5"),
        ({"potential_tagged": -2}, r"potential_tagged must be a finite number in \[-1, 1\], but is -2"),
        ({"team_share": True}, "team_share must be a finite number in .*, but is True"),
        ({"team_share": "half"}, "team_share must be a finite number in .*, but is 'half'"),
        ({"potentail": 1.0}, "shaping must be of .*, but has 'potentail'. Did you mean potential?"),
    ],
)
def test_what_is_refused(given, said):
    with pytest.raises(ValueError, match=said):
        make_shaping(given)
    with pytest.raises(ValueError, match=said):
        parallel_env(shaping=given)


def test_by_default_nothing_is_added():
    assert make_shaping() == Shaping(0.0, 0.99, 0.0, 0.0)
