"""Plays games of any rules and writes them as recorded games are written."""

import json

import numpy as np

from mctf.kernel import RUNNING, TIME_OUT, finished, step
from mctf.observe import normalise, observation_size, observe, ranges
from mctf.recording import STATE
from mctf.replaying import REWARD
from mctf.rewards import TERMS, rewards
from mctf.scripted import PAPER, act
from mctf.start import reset
from mctf.state import empty

POLICIES = (*PAPER, "scripted")
"""The last drives to its own flag, as nothing else touches the keep-out circle so surely."""
HELD_STEPS = 8
"""How long a random action is held."""
DTYPES = {"oob": np.int64, "action": np.int16, "policy": np.int8, "episode": np.int32, "episode_step": np.int32}


def record(rules, lineups, steps, seed=0, one_environment=False):
    """Returns the arrays of one episode for each line-up, a list of names of ``POLICIES``, blue's first.

    An episode is at most ``steps`` long. In ``one_environment`` the heading controllers remember the one before.
    """
    rng = np.random.default_rng(seed)
    rules = rules._replace(pid_reset=not one_environment)
    state = empty(1, rules)
    raw = np.zeros((state.pos.shape[1], observation_size(rules)))
    rows = []
    for episode, lineup in enumerate(lineups):
        policies = [POLICIES.index(name) for name in lineup]
        reset(state, 0, rules)
        for row in range(steps + 1):
            over = finished(state, 0, rules)
            observe(state, 0, rules, raw)
            actions = [pilot(name, state, v, raw, rules, rng, row, rows) for v, name in enumerate(lineup)]
            last = row == steps or over != RUNNING
            now = {"action": [-1] * len(actions) if last else actions, "policy": policies, "episode": episode}
            now |= {"episode_step": row, "truncated": over == TIME_OUT, "terminated": over not in (RUNNING, TIME_OUT)}
            rows.append(perceived(state, raw, rules) | now)
            if last:
                break
            step(state, 0, np.array(actions, np.int64), rules)
    arrays = {name: np.stack([np.asarray(row[name], DTYPES.get(name)) for row in rows]) for name in rows[0]}
    return arrays | {"meta": np.array(json.dumps(settings(rules)))}


def pilot(name, state, v, raw, rules, rng, row, rows):
    if name == "scripted":
        bearing = raw[v, 2]
        return 4 if abs(bearing) < 10.0 else 3 if bearing > 0.0 else 5
    if name == "random":
        return int(rng.integers(17)) if row % HELD_STEPS == 0 else rows[-1]["action"][v]
    return act(PAPER.index(name), state, 0, v, raw[v], rules)


def perceived(state, raw, rules):
    seen, earned = np.zeros(raw.shape, np.float32), np.zeros(len(raw))
    normalise(raw, ranges(rules), rules, seen)
    rewards(REWARD, state, 0, rules, raw, raw, np.zeros(len(TERMS)), earned)
    return {name: getattr(state, name)[0].copy() for name in STATE} | {"obs": seen, "reward": earned}


def settings(rules):
    return {
        "team_size": rules.blue_size,
        "sim_speedup_factor": rules.substeps,
        "world_size": [rules.width_m, rules.height_m],
        "max_time": rules.max_time_s,
        "max_score": rules.max_score,
        "flag_keepout": rules.flag_keepout_m,
        "tau": rules.tau_s,
        "catch_radius": rules.catch_radius_m,
        "agent_radius": rules.agent_radius_m,
        "tagging_cooldown": rules.tagging_cooldown_s,
        "max_speed": rules.max_speed,
        "policies": POLICIES,
        "reward": "custom_rew2",
    }
