"""Environments of the user's own, in worker processes of the real thing."""

import logging

import numpy as np
import pytest

from berteam_cli.acting import fixed_policies, joined
from berteam_cli.env.pettingzoo import Pettingzoo
from berteam_cli.env.pettingzoo_game import played
from berteam_cli.env.pettingzoo_made import Facts, Game, Unfit, facts_of, places
from berteam_cli.env.pettingzoo_worker import close
from berteam_cli.errors import RunError
from berteam_cli.evaluation.reference import table_name
from berteam_cli.games import Games, pairings
from berteam_cli.workers import Workers
from tests.env import games_for_tests
from tests.env.games_for_tests import Contest, Faulty, Guess, Late, spaces
from tests.makers import mctf, random_networks

HERE = games_for_tests.__name__
LIVES = {"lives": {"left_1": 2, "right_0": 4}, "cut": {"right_1": 3}}


def zoo(target, workers=1, score="reward", **options):
    env = Pettingzoo(options.get("team_size", 1), target, options, {}, 1000, score)
    return Games(env, Workers(workers))


def anyone(games, team_size=1):
    """Returns line-ups of teams of policy 0 alone."""
    nobody_else = np.zeros((games, team_size), dtype=int)
    return pairings(nobody_else, nobody_else)


def alone(env, score="reward", max_steps=50, seed=5):
    """Returns one game of random players, played in this process."""
    game = Game("here:here", {}, {}, max_steps, score, "")
    facts = facts_of(env, {})
    rows = np.zeros(len(facts.agents), dtype=np.int64)
    return played(env, game, facts, fixed_policies([0]), rows, seed, record=True)


@pytest.fixture(scope="module")
def pairs():
    """Games of two against two, and what it takes to play them again."""
    games = zoo(f"{HERE}:Contest", 2, team_size=2, **LIVES)
    rng = np.random.default_rng(1)
    lineups = pairings(rng.integers(5, size=(12, 2)), rng.integers(5, size=(12, 2)))
    policies = joined([random_networks(4, games.env), fixed_policies([0])])
    return games, lineups, policies, games.play(policies, lineups, 7, record=True)


def test_a_game_is_what_the_environment_gives_for_its_seed_and_the_same_actions(pairs):
    _, _, _, (outcomes, seen) = pairs
    for b, seed in enumerate(outcomes.seeds):
        env = Contest(team_size=2, **LIVES)
        rows = {agent: 4 * b + v for v, agent in enumerate(env.possible_agents)}
        observations, _ = env.reset(seed=int(seed) >> 33)
        totals = dict.fromkeys(rows, 0.0)
        moment = 0
        while env.agents:
            for agent, observation in observations.items():
                np.testing.assert_array_equal(
                    seen.observations[rows[agent], 0, moment], observation.ravel().astype("f4")
                )
            actions = {agent: int(seen.actions[rows[agent], 0, moment]) for agent in env.agents}
            observations, rewards, *_ = env.step(actions)
            for agent, reward in rewards.items():
                assert seen.rewards[rows[agent], 0, moment] == np.float32(reward)
                totals[agent] += reward
            moment += 1
        assert outcomes.steps[b] == moment == 6
        gap = totals["left_0"] + totals["left_1"] - totals["right_0"] - totals["right_1"]
        assert outcomes.scores[b].tolist() == ([1, 0] if gap > 0 else [0, 1])
    assert len(set(outcomes.scores[:, 0])) == 2


def test_who_leaves_early_has_a_trajectory_of_its_own_length(pairs):
    _, lineups, _, (_, seen) = pairs
    np.testing.assert_array_equal(seen.members[:, 0], lineups.teams.ravel())
    np.testing.assert_array_equal(seen.lengths.reshape(12, 4), np.tile([6, 2, 4, 3], (12, 1)))
    # Two die, one is cut off, and time runs out for the last one.
    np.testing.assert_array_equal(seen.terminated.reshape(12, 4), np.tile([False, True, True, False], (12, 1)))
    trajectories = seen.trajectories(0, 5)
    assert sum(map(len, trajectories.values())) == 48
    assert {player for played in trajectories.values() for _, player in played} == {0}


def test_neither_the_number_of_workers_nor_what_was_played_before_changes_anything(pairs):
    games, lineups, policies, (outcomes, seen) = pairs
    alone = Games(games.env, Workers(1))
    for again in (games, alone):
        twice, seen_twice = again.play(policies, lineups, 7, record=True)
        np.testing.assert_array_equal(twice.scores, outcomes.scores)
        for k, length in enumerate(seen.lengths):
            for name in ("observations", "actions", "rewards"):
                a, b = (getattr(x, name)[k, 0, :length] for x in (seen, seen_twice))
                np.testing.assert_array_equal(a, b)
    unseen, nothing = alone.play(policies, lineups, 7)
    np.testing.assert_array_equal(unseen.scores, outcomes.scores)
    assert nothing.observations.size == len(nothing.lengths) == 0


def test_new_weights_are_played_at_once(pairs):
    games, lineups, policies, (_, seen) = pairs
    others = joined([random_networks(4, games.env, seed=1), fixed_policies([0])])
    changed = games.play(others, lineups, 7, record=True)[1]
    back = games.play(policies, lineups, 7, record=True)[1]
    assert (changed.actions[:, 0, 0] != seen.actions[:, 0, 0]).any()
    np.testing.assert_array_equal(back.actions[:, 0, 0], seen.actions[:, 0, 0])


def test_few_games_are_shared_by_all_processes():
    games = zoo(f"{HERE}:Contest", 2)
    games.play(fixed_policies([0]), anyone(4), 0)
    assert len(games.env.processes.idle) == 2
    games.play(fixed_policies([0]), anyone(100), 0)
    assert len(games.env.processes.idle) == 2


def test_environments_that_share_pythons_generators_are_repeatable_too(capfd):
    """Also where they draw when they are made, and from their spaces, whichever process plays them."""
    games = [zoo(f"{HERE}:Careless", 2), zoo(f"{HERE}:Careless", 1, pay={0: 1.5})]
    first, *others = (
        x.play(fixed_policies([0]), anyone(6), 3, record=True)[1].observations for x in (games[0], *games)
    )
    for other in others:
        np.testing.assert_array_equal(first[:, :, :6], other[:, :, :6])
    assert len({game[:, :6].tobytes() for game in first}) == 12
    for x in games:
        close(x.env.processes.idle)
    assert capfd.readouterr().err == ""


def test_games_with_numbers_for_keys_have_a_fingerprint_and_others_another():
    mixed, other = (zoo(f"{HERE}:Careless", pay={0: 1.5, "a": a}).env for a in (1.0, 2.0))
    assert table_name(mixed) == table_name(mixed) != table_name(other)


def test_mctf_through_pettingzoo_is_mctf():
    """Networks and random players; the field is so small and they so fast that some capture by chance."""
    rules = {"world_size_m": [60.0, 60.0], "flag_keepout_m": 0.0, "max_speed": 3.0, "tagging_cooldown_s": 200.0}
    direct = mctf(1, **rules)
    wrapped = zoo("mctf:parallel_env", 2, "info:team_captures", team_size=2, **rules)
    rng = np.random.default_rng(0)
    lineups = pairings(rng.integers(5, size=(20, 2)), rng.integers(5, size=(20, 2)))
    networks, random = random_networks(4, direct.env), direct.env.fixed_policies.index("random")
    expected, theirs = direct.play(joined([networks, fixed_policies([random])]), lineups, 4, record=True)
    outcomes, ours = wrapped.play(joined([networks, fixed_policies([0])]), lineups, 4, record=True)
    assert {0.0, 1.0} <= set(expected.scores[:, 0])
    np.testing.assert_array_equal(outcomes.scores, expected.scores)
    np.testing.assert_array_equal(outcomes.steps, expected.steps)
    np.testing.assert_array_equal(ours.lengths, np.repeat(theirs.lengths, 4))
    np.testing.assert_array_equal(ours.terminated, np.repeat(theirs.terminated, 4))
    for k, length in enumerate(ours.lengths):
        for name, more in (("observations", 1), ("actions", 0), ("rewards", 0)):
            a, b = getattr(ours, name)[k, 0], getattr(theirs, name)[k // 4, k % 4]
            np.testing.assert_array_equal(a[: length + more], b[: length + more])


@pytest.mark.parametrize(
    ("left", "right", "score", "gap"),
    [
        ([1, 0, 2], [0, 2, 0], "reward", 1),
        ([1, 0, 0], [0, 2, 0], "reward", -1),
        ([1, 0, 2], [0, 3, 0], "reward", 0),
        ([0.1] * 10, [1.0] + [0.0] * 9, "reward", 0),  # added without rounding
        ([1, 0, 0], [0, 0, 0], "info:points", -1),
    ],
)
def test_the_team_with_more_wins(left, right, score, gap):
    env = Contest(time=len(left), wages={"left_0": left, "right_0": right})
    assert np.sign(alone(env, score).gap) == gap


def test_a_long_game_is_cut_off():
    cut = alone(Contest(time=100), max_steps=7)
    assert cut.steps == 7
    assert cut.lengths == [7, 7]
    assert cut.terminated == [False, False]
    assert len(cut.observations[0]) == 8


def test_one_of_n_is_seen_as_n_numbers_and_actions_are_counted_from_zero():
    env = Guess()
    assert facts_of(env, {}) == Facts(("left_0", "right_0"), 4, 3)
    game = alone(env)
    assert game.terminated == [True, True]
    for seen, actions in zip(game.observations, game.actions, strict=True):
        np.testing.assert_array_equal(np.sort(seen, axis=1), [[0, 0, 0, 1]] * 2)
        assert 0 <= actions[0] < 3


def test_random_players_take_every_action_equally_often():
    actions = np.concatenate(alone(Contest(time=3000), max_steps=3000).actions)
    np.testing.assert_allclose(np.bincount(actions) / 6000, 1 / 3, atol=0.03)


def test_teams():
    assert places(["a", "b", "c", "d"], {}) == ("a", "b", "c", "d")
    assert places(["a", "b", "c", "d"], {"red": ["d", "a"], "blue": ["c", "b"]}) == ("c", "b", "d", "a")


@pytest.mark.parametrize(
    ("teams", "said"),
    [
        ({"blue": ["a", "b"]}, "teams must be {blue"),
        ({"blue": "ab", "red": "cd"}, "teams must be {blue"),
        ({"blue": [], "red": []}, "teams must be {blue"),
        ({"blue": ["a", "b"], "green": ["c", "d"]}, "teams must be {blue"),
        ({"blue": ["a", "b"], "red": ["c", "dd"]}, "teams has 'dd', but the agents are a, b, c, d. Did you mean d?"),
        ({"blue": ["a", "b"], "red": ["c", "c"]}, "teams must hold every agent once, but holds c 2 times"),
        ({"blue": ["a", "b"], "red": ["c"]}, "teams must hold every agent once, but holds d 0 times"),
        ({"blue": ["a"], "red": ["b", "c", "d"]}, "teams must be of equal size, but blue has 1 and red has 3"),
    ],
)
def test_teams_that_are_refused(teams, said):
    with pytest.raises(Unfit) as refused:
        places(["a", "b", "c", "d"], teams)
    assert str(refused.value).startswith(said)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"seeing": "dict"}, "agent agent_1 has the observation space Dict('at': Discrete(2)); only Box and Discrete"),
        ({"seeing": "many"}, "agent agent_1 has the observation space MultiDiscrete"),
        ({"seeing": "large"}, "agent agent_0 has observations of 4 numbers and agent agent_1 has observations of 5"),
        ({"acting": "real"}, "agent agent_1 has the action space Box"),
        ({"acting": "two"}, "agent agent_0 has 3 actions and agent agent_1 has 2 actions"),
        ({"agents": 3}, "teams must be of equal size, but blue has 1 and red has 2"),
        ({"agents": 0}, "teams must be {blue"),
    ],
)
def test_agents_that_are_refused(settings, said):
    with pytest.raises(Unfit) as refused:
        facts_of(spaces(**settings), {})
    assert said in str(refused.value)


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        ("reward", "the reward of agent left_0 must be a finite number of 32 bits, but is nan"),
        ("observation", "the observation of agent left_0 must be finite and in Box"),
        ("shape", "the observation of agent left_0 must be finite and in Box"),
        ("silent", "rewards must have an entry for agent left_0, but has only ['right_0']"),
        ("vanish", "agent left_0 is in the game again after it had left"),
    ],
)
def test_environments_that_break_their_word(fault, said):
    with pytest.raises(Unfit) as broken:
        alone(Faulty(fault))
    assert said in str(broken.value)


@pytest.mark.parametrize("kind", [float, np.float32])
@pytest.mark.parametrize(
    ("blue", "red", "winner"),
    [
        ([0.1, 0.2], [0.3, 0.0], 0),
        ([0.3, 0.0], [0.2, 0.1], 0),
        ([0.1, 0.2], [0.3, 0.01], -1),
        ([9_000_001, 0], [9_000_000, 0], 1),
        ([0, 0], [0, 0], 0),
    ],
)
def test_equal_fractions_are_a_draw_and_whole_numbers_are_exact(blue, red, winner, kind):
    wages = {"left_0": list(map(kind, blue)), "right_0": list(map(kind, red))}
    assert np.sign(alone(Contest(time=2, wages=wages)).gap) == winner


def test_agents_that_are_numbers_are_named_in_what_is_refused():
    with pytest.raises(Unfit, match=r"teams has 7, but the agents are 0, 1, 2, 3\."):
        places([0, 1, 2, 3], {"blue": [0, 7], "red": [1, 3]})
    assert places([0, 1, 2, 3], {"blue": [0, 2], "red": [1, 3]}) == (0, 2, 1, 3)


def test_a_reward_is_a_number_of_32_bits():
    most = float(np.finfo(np.float32).max)
    assert alone(Contest(time=2, wages={"left_0": [most, -most]})).rewards[0] == [most, -most]
    with pytest.raises(Unfit, match=r"the reward of agent left_0 must be a finite number of 32 bits, but is -3.5e\+38"):
        alone(Contest(time=2, wages={"left_0": [0.0, -3.5e38]}))


def test_an_info_that_decides_must_be_there():
    with pytest.raises(Unfit, match=r"env.score=info:wins: the last info of agent left_0 has only \['points'\]"):
        alone(Contest(), "info:wins")


def test_every_agent_must_be_there_at_the_start():
    with pytest.raises(Unfit, match="agent right_0 is not in the game after reset"):
        alone(Late())


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        (
            "raise",
            r"game 0, of seed \d+, cannot be played: KeyError: 'the ball is gone' \(games_for_tests.py, line \d+",
        ),
        ("exit", r"game 0, of seed \d+, cannot be played: target=.*:Faulty: its process ended with exit code 7"),
    ],
)
def test_a_failing_environment_fails_the_run_and_its_process_ends(fault, said, caplog):
    games = zoo(f"{HERE}:Faulty", fault=fault)
    log = logging.getLogger("berteam")
    log.addHandler(caplog.handler)
    try:
        with pytest.raises(RunError, match=said):
            games.play(fixed_policies([0]), anyone(3), 0)
    finally:
        log.removeHandler(caplog.handler)
    assert ("Traceback" in caplog.text) == (fault == "raise")
    assert games.env.processes.idle == []
