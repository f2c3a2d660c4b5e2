"""The check of recorded games passes what the kernel plays by any rules, and finds every number that was changed."""

import json

import numpy as np
import pytest

from mctf.check import main
from mctf.play import play_scripted
from mctf.recording import SHAPES
from mctf.rules import make_rules
from mctf.scripted import NAMES
from mctf.tournament import OUTCOMES
from tests.mctf.record import POLICIES, record


def eventful():
    """Returns a small recording with everything in it, k = 20 on a small field: 58 rows of 2 s."""
    rules = make_rules(
        substeps=20,
        world_size_m=(60.0, 40.0),
        flag_keepout_m=3.0,
        catch_radius_m=6.0,
        agent_radius_m=1.0,
        tagging_cooldown_s=7.0,
        max_time_s=60.0,
    )
    lineups = [
        ["random", "attack_hard", "scripted", "random"],
        ["attack_easy", "random", "attack_medium", "defend_hard"],
    ]
    return record(rules, lineups, steps=100, seed=2, one_environment=True)


EVENTFUL = eventful()
STARTS = np.flatnonzero(EVENTFUL["episode_step"] == 0)
EDGES = sorted({*STARTS, *(STARTS + 1), *(STARTS[1:] - 1), len(EVENTFUL["episode"]) - 1})


def status(tmp_path, arrays):
    path = tmp_path / "games.npz"
    np.savez(path, **arrays)
    return main([str(path)])


def test_everything_happens_in_the_small_recording(tmp_path, capsys):
    assert status(tmp_path, EVENTFUL) == 0
    for name in ("is_tagged", "has_flag", "capture", "oob", "terminated", "truncated"):
        assert EVENTFUL[name].any(), name
    assert (EVENTFUL["tagged_opponent"] >= 0).any()
    assert EVENTFUL["heading_error_prev"][STARTS[1]].any()
    out = capsys.readouterr().out
    assert "2 of 2 replayed to their end as recorded" in out
    assert "with keep-out contact: positions within 0 m" in out


@pytest.mark.parametrize("one_environment", [False, True])
@pytest.mark.parametrize(
    ("team_size", "substeps", "keepout", "world", "others"),
    [
        (1, 1, 0.0, (160.0, 80.0), {}),
        (2, 4, 5.0, (90.0, 50.0), {"max_speed": 1.2, "tau_s": 0.05}),
        (4, 3, 12.0, (150.0, 60.0), {"max_score": 3, "catch_radius_m": 20.0}),
        (7, 20, 0.0, (120.0, 200.0), {"agent_radius_m": 0.0}),
        (10, 10, 12.0, (300.0, 120.0), {"tagging_cooldown_s": 3.0, "max_score": 99}),
    ],
)
def test_games_of_any_rules_pass(tmp_path, capsys, team_size, substeps, keepout, world, others, one_environment):
    rules = make_rules(
        team_size=team_size, substeps=substeps, flag_keepout_m=keepout, world_size_m=world, max_time_s=90.0, **others
    )
    lineups = np.random.default_rng(team_size).choice(POLICIES, (3, 2 * team_size)).tolist()
    arrays = record(rules, lineups, steps=120, seed=team_size, one_environment=one_environment)
    assert status(tmp_path, arrays) == 0
    assert "3 of 3 replayed to their end as recorded" in capsys.readouterr().out


def test_tables_of_unequal_teams(tmp_path, capsys):
    policies = np.array([[1, 0, 2, 3], [4, 2, 2, 2], [5, 0, 1, 0]])
    rules = make_rules(team_size=(1, 3))
    state = play_scripted(policies, np.zeros(3, np.uint64), rules)
    path = tmp_path / "games.csv"
    lines = [",".join(["blue_0", "red_0", "red_1", "red_2", *OUTCOMES])]
    for b, (lineup, score) in enumerate(zip(policies, state.score, strict=True)):
        numbers = [*score[:, 0], *score[:, 2], *score[:, 1], state.steps[b], int(score[:, 0].max() == 0)]
        lines.append(",".join([*(NAMES[policy] for policy in lineup), *map(str, numbers)]))
    path.write_text("\n".join(lines))
    assert main([str(path)]) == 0
    assert "3 of 3 games end with the same" in capsys.readouterr().out


def test_limits_that_a_text_names(tmp_path):
    rules = make_rules(team_size=1, max_time_s=20.0, max_score=7)
    arrays = record(rules, [["random", "scripted"], ["scripted", "random"]], steps=99)

    def told(limit):
        meta = json.loads(str(arrays["meta"])) | {"max_time": limit, "max_score": "1, then 7"}
        return status(tmp_path, arrays | {"meta": np.array(json.dumps(meta))})

    assert told("20, then 400") == 0
    assert told("19, then 400") == 1
    assert told("20.5, then 400") == 1
    assert told("none") == 2
    assert status(tmp_path, arrays | {"truncated": arrays["truncated"] & False}) == 1


def neighbours(value):
    """Returns what one number may be changed to: more than any tolerance away."""
    if value.dtype.kind == "b":
        return [~value]
    return [value - 1, value + 1] if value.dtype.kind == "i" else [value - 1e-3, value + 1e-3]


def ignored(name, index):
    """Whether no step depends on the number: what a pilot wants whose vehicle drives home by itself."""
    vehicle = EVENTFUL["policy"][index] if name == "action" else 0
    return name == "action" and EVENTFUL["is_tagged"][index] and POLICIES[vehicle] in ("random", "scripted")


@pytest.mark.parametrize("name", SHAPES)
def test_one_changed_number_is_found(tmp_path, name):
    rng = np.random.default_rng(list(SHAPES).index(name))
    shape = EVENTFUL[name].shape
    rows = [*EDGES, *rng.integers(shape[0], size=6)]
    for row in rows:
        index = (row, *(int(rng.integers(size)) for size in shape[1:]))
        for value in neighbours(EVENTFUL[name][index]):
            changed = EVENTFUL[name].copy()
            changed[index] = value
            if not ignored(name, index):
                assert status(tmp_path, EVENTFUL | {name: changed}) in (1, 2), (name, index, value)


def with_setting(name, change, arrays=EVENTFUL):
    meta = json.loads(str(arrays["meta"]))
    meta[name] = change(meta[name])
    return arrays | {"meta": np.array(json.dumps(meta))}


@pytest.mark.parametrize(
    ("name", "change"),
    [
        *((name, lambda x, by=by: x + by) for by in (-1, 1) for name in ("team_size", "sim_speedup_factor")),
        *((name, lambda x, by=by: x + by) for by in (-1e-3, 1e-3) for name in ("tau", "max_speed", "tagging_cooldown")),
        *((name, lambda x, by=by: x + by) for by in (-0.5, 0.5) for name in ("flag_keepout", "agent_radius")),
        *((name, lambda x, by=by: x + by) for by in (-1, 1) for name in ("catch_radius",)),
        ("world_size", lambda x: [x[0] + 1e-3, x[1]]),
        ("world_size", lambda x: [x[0], x[1] - 1e-3]),
        ("max_time", lambda x: x + 1e-3),
        ("max_time", lambda x: x - 2.0),
        ("max_score", lambda x: x + 1),
        ("max_score", lambda x: x - 1),
        ("team_size", lambda x: x + 0.5),
        ("sim_speedup_factor", lambda x: 10**9),
    ],
)
def test_a_changed_setting_is_found(tmp_path, name, change):
    assert status(tmp_path, with_setting(name, change)) in (1, 2)


def test_settings_that_decide_nothing_cannot_be_found(tmp_path):
    arrays = record(make_rules(team_size=1, flag_keepout_m=0.0), [["random", "random"]], steps=30)
    assert status(tmp_path, arrays) == 0
    for name in ("max_time", "max_score", "catch_radius", "agent_radius"):
        assert status(tmp_path, with_setting(name, lambda x: x + 1, arrays)) == 0


def drifting(arrays, vehicle, first, metres=9e-7):
    """Returns a recording in which a vehicle is moved a little farther in each step from row ``first`` on."""
    moved = np.maximum(np.arange(len(arrays["pos"])) - first, 0) * metres
    changed = dict(arrays)
    for name in ("pos", "prev_pos"):
        changed[name] = arrays[name].copy()
        changed[name][:, vehicle, 0] += moved
    return changed


def test_a_drift_too_small_for_one_step_is_found_over_the_episode(tmp_path, capsys):
    arrays = record(make_rules(team_size=1, flag_keepout_m=0.0), [["random", "random"]], steps=200, seed=1)
    assert status(tmp_path, drifting(arrays, 0, 0)) == 1
    out = capsys.readouterr().out
    assert "13 discrete fields equal" in out
    assert "0 of 1 replayed to their end" in out
    assert "episode 0 fails with no keep-out contact before: 89 agent-steps, the first in step 112 (row 112)" in out
    assert "agent 0, number 0, field pos: recorded " in out


def touching(**rules):
    """Returns an episode of 250 steps in which vehicle 0 touches its keep-out circle, and who is never tagged."""
    arrays = record(make_rules(**rules), [["scripted", "random", "random", "random"]], steps=250, seed=3)
    return arrays, int(np.flatnonzero(~arrays["is_tagged"].any(axis=0))[-1])


def test_little_may_differ_after_keep_out_contact(tmp_path, capsys):
    arrays, vehicle = touching()
    assert status(tmp_path, drifting(arrays, vehicle, 125)) == 0
    out = capsys.readouterr().out
    assert "1 with keep-out contact: positions within 0.00011 m, 14 of 1000 agent-steps differ (1.40%)" in out
    assert "episode 0 differs within what is allowed: 14 agent-steps, the first in step 237 (row 237), agent" in out
    assert status(tmp_path, drifting(arrays, vehicle, 60)) == 1
    assert "too many agent-steps differ with keep-out contact: 7.90%, allowed 3%" in capsys.readouterr().out


def test_nothing_may_differ_before_keep_out_contact(tmp_path, capsys):
    arrays, vehicle = touching(world_size_m=(2000.0, 1000.0))
    assert status(tmp_path, arrays) == 0
    assert status(tmp_path, drifting(arrays, vehicle, 110)) == 0
    assert status(tmp_path, drifting(arrays, vehicle, 0)) == 1
    assert "episode 0 fails with no keep-out contact before: 139 agent-steps" in capsys.readouterr().out


def test_why_an_episode_with_contact_fails(tmp_path, capsys):
    arrays, vehicle = touching()
    arrays["pos"][-1, vehicle, 1] += 0.06
    arrays["score"][-1, 1, 0] += 1
    assert status(tmp_path, arrays) == 1
    out = capsys.readouterr().out
    assert vehicle == 3
    assert (
        "episode 0 fails by up to 0.06 m, allowed 0.05 m: 2 agent-steps, the first in step 250 (row 250), agent 3"
        in out
    )
    assert "; captures at its end: recorded (0, 1), computed (0, 0)" in out
    assert "0 of 1 replayed to their end" in out
