import resource
from dataclasses import asdict, replace

import numpy as np
import pytest
import torch

from berteam_cli import build, memory
from berteam_cli.acting import fixed_policies
from berteam_cli.config import checked
from berteam_cli.env.base import blank_trajectories, trajectory_bytes
from berteam_cli.errors import InputError
from berteam_cli.games import pairings
from berteam_cli.learner.stacked_dqn import StackedDqn
from tests.makers import mctf
from tests.test_config import composed


@pytest.mark.parametrize("learner", ["ppo", "dqn"])
def test_what_is_told_is_what_is_taken(learner):
    parts = build.parts(checked(composed("population=ppo6", f"learner={learner}", "learner.network=[20,7]")))
    (island,) = parts.optimizer.islands
    state = island.learner.init(6, np.random.default_rng(0))
    if learner == "dqn":
        state.collected[:] = island.learner.buffer_size  # of a replay buffer only what is filled is given away
    taken = sum(x.numel() * x.element_size() for x in island.learner.tensors(state).values())
    assert island.learner.state_bytes(6) == taken
    assert trajectory_bytes(parts.games.env, 16) == sum(x.nbytes for x in parts.room)


def test_more_sides_take_more_room():
    words = ["env=rps", "env.sides=3", "population=ppo6"]
    parts = build.parts(checked(composed(*words, "learner.n_steps=8", "learner.minibatch_size=4")))
    assert parts.room.actions.shape == (16, 6, 1)
    assert trajectory_bytes(parts.games.env, 16) == sum(x.nbytes for x in parts.room)


def test_the_trajectories_of_an_epoch_go_where_those_of_the_last_one_went():
    games = mctf(max_time_s=20.0)
    room = blank_trajectories(games.env, 2)
    lineups = pairings(np.zeros((2, 2), int), np.ones((2, 2), int))
    _, first = games.play(fixed_policies(range(7)), lineups, 0, record=True, room=room)
    _, second = games.play(fixed_policies(range(7)), lineups, 1, record=True, room=room)
    assert np.shares_memory(first.observations, second.observations)
    assert first.observations is room.observations


def limited(monkeypatch, learner, setting, limit):
    monkeypatch.setattr(memory, "available", lambda: limit)
    words = ["population=ppo6", f"learner={learner}", setting]
    return build.parts(checked(composed(*words)))


@pytest.mark.parametrize(("learner", "key", "step"), [("dqn", "buffer_size", 1), ("ppo", "n_steps", 64)])
def test_the_largest_buffer_that_is_said_to_fit_does(learner, key, step, monkeypatch):
    limit = 2 * 2**30
    with pytest.raises(InputError) as refused:
        limited(monkeypatch, learner, f"learner.{key}=64000000", limit)
    fits = int(str(refused.value).split("<= ")[1].split(",")[0]) // step * step
    limited(monkeypatch, learner, f"learner.{key}={fits}", limit)
    with pytest.raises(InputError):
        limited(monkeypatch, learner, f"learner.{key}={fits + step}", limit)


def test_members_on_a_gpu_must_fit_beside_it_too(monkeypatch):
    """They are made there, and a checkpoint is written from there."""
    islands = build.parts(checked(composed("population=ppo6", "learner=dqn"))).optimizer.islands
    on_gpu = replace(islands[0], learner=StackedDqn(**asdict(islands[0].learner), device="cuda"))
    taken = memory.state_bytes(on_gpu)
    monkeypatch.setattr(torch.cuda, "mem_get_info", lambda: (2 * taken, 2 * taken))
    monkeypatch.setattr(memory, "available", lambda: memory.BASE + 2 * taken)
    memory.check_memory((on_gpu,), [])
    monkeypatch.setattr(memory, "available", lambda: memory.BASE + 2 * taken - 2)
    with pytest.raises(InputError, match=r"buffer_size must be <= \d+"):
        memory.check_memory((on_gpu,), [])


@pytest.mark.parametrize("more", [[], ["selector.observations.use=previous_game"]])
def test_as_many_games_as_are_said_to_fit_do(more, monkeypatch):
    monkeypatch.setattr(memory, "available", lambda: 2 * 2**30)

    def made(games):
        return build.parts(checked(composed("population=ppo6", f"games_per_epoch={games}", *more)))

    with pytest.raises(InputError, match=r"games_per_epoch must be <= \d+, but is 10000: ") as refused:
        made(10_000)
    fits = int(str(refused.value).split("<= ")[1].split(",")[0]) // 2 * 2
    monkeypatch.setattr(build, "blank_trajectories", lambda env, games: None)  # nothing is to be taken
    made(fits)
    with pytest.raises(InputError):
        made(fits + 10)


@pytest.mark.parametrize("rings", ["shared", "per_side"])
def test_what_winners_saw_is_counted(rings, monkeypatch):
    words = [
        "population=fixed_policies",
        "optimizer=fixed",
        "selector.observations.use=self",
        f"selector.dataset={rings}",
    ]

    def made(capacity):
        return build.parts(checked(composed(*words, f"selector.capacity={capacity}")))

    chooses = made(50).selector
    held = chooses.init(np.random.default_rng(0)).winners
    assert chooses.seen_bytes == sum(ring.held.rows.nbytes for ring in held)
    monkeypatch.setattr(memory, "available", lambda: 2 * 2**30)
    with pytest.raises(InputError, match=r"selector.capacity must be <= \d+, but is 1000000: ") as refused:
        made(10**6)
    fits = int(str(refused.value).split("<= ")[1].split(",")[0])
    made(fits)
    with pytest.raises(InputError):
        made(fits + 1)


def test_what_a_process_is_limited_to_counts():
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    whole = memory.available()
    assert whole > 2**28
    try:
        resource.setrlimit(resource.RLIMIT_AS, (whole // 2, hard))
        assert memory.available() == whole // 2
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def test_sizes_are_read_with_ease():
    assert [memory.spoken(x) for x in (310 * 2**20, 2.5 * 2**30, 3000 * 2**30)] == ["310 MiB", "2.5 GiB", "3,000.0 GiB"]
