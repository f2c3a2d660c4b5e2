"""The files of the pool, and what a checkpoint does when one is not what it was."""

import resource
from dataclasses import replace

import numpy as np
import pytest

from berteam_cli import checkpoint
from berteam_cli.checkpoint import Saved
from berteam_cli.errors import InputError, RunError
from berteam_cli.fitting import check_run
from berteam_cli.opponents import pool
from berteam_cli.training import begin, epoch
from tests.opponents.makers import EXPLOITERS, FOUR, parts


@pytest.fixture(scope="module")
def made():
    words = ["opponents.snapshot_every=1", "opponents.pool_size=3", "opponents.exploiter_epochs=2"]
    return parts(*EXPLOITERS, *words, population=FOUR)


@pytest.fixture
def runs(made, tmp_path):
    """Four saved epochs; returns the runs."""
    run = begin(made)
    kept = []
    for _ in range(4):
        run, _ = epoch(run, made)
        run = replace(run, league=pool.on_disk(run.league, tmp_path / "pool"))
        checkpoint.save(tmp_path, Saved(run, {}, 0.0), made)
        kept.append(run)
    return kept


def everything(league):
    return [(x.key, x.record, x.members.tolist(), [column.tobytes() for column in x.policies]) for x in league.pool]


def test_a_pool_comes_back_whole(runs, made, tmp_path):
    back = checkpoint.load(tmp_path, made).run
    assert everything(back.league) == everything(runs[3].league)
    assert back.league.attempts == runs[3].league.attempts
    for snapshot in back.league.pool:
        assert isinstance(snapshot.policies.weights.base, np.memmap)


def test_only_what_the_two_checkpoints_need_stays(runs, tmp_path):
    needed = set(pool.names(runs[3].league)) | set(pool.names(runs[2].league))
    assert {path.name for path in (tmp_path / "pool").iterdir()} == needed
    assert len(runs[3].league.pool) == 3


def test_files_of_others_stay(runs, made, tmp_path):
    """As a file system over a network keeps one that is removed while it is read."""
    (tmp_path / "pool" / ".nfs0001").touch()
    (tmp_path / "pool" / "00000099.part").touch()
    checkpoint.save(tmp_path, Saved(epoch(runs[3], made)[0], {}, 0.0), made)
    assert (tmp_path / "pool" / ".nfs0001").exists()
    assert not (tmp_path / "pool" / "00000099.part").exists()


def test_a_pool_has_as_many_files_open_as_it_needs_and_may():
    before = resource.getrlimit(resource.RLIMIT_NOFILE)
    soft = min(before[1], 1000) - 300 if before[1] != resource.RLIM_INFINITY else 700
    try:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, before[1]))
        pool.check_files(soft - 256)
        assert resource.getrlimit(resource.RLIMIT_NOFILE)[0] == soft
        pool.check_files(soft)
        assert resource.getrlimit(resource.RLIMIT_NOFILE)[0] == soft + 256
        with pytest.raises(InputError, match=r"opponents.pool_size must be smaller: .* the \d+ that \d+ of them need"):
            pool.check_files(2**62)
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, before)


def test_a_pool_is_as_large_as_the_run_can_make_it(made):
    """Of four epochs: the beginning and each of them, and of either kind of exploiters one an epoch at most."""
    league = made.opponents
    assert replace(league, past=replace(league.past, pool_size=100)).most_snapshots(4) == 13
    assert league.most_snapshots(4) == 3


def test_what_is_on_the_disk_is_what_was_in_memory(made, tmp_path):
    fresh = begin(made).league
    kept = pool.on_disk(fresh, tmp_path / "pool")
    assert everything(kept) == everything(fresh)
    assert pool.on_disk(kept, tmp_path / "pool") is kept


@pytest.mark.parametrize("damage", ["flip", "cut", "gone", "other"])
def test_a_checkpoint_whose_snapshot_is_damaged_is_passed_over(damage, runs, made, tmp_path):
    newest = max(set(pool.names(runs[3].league)) - set(pool.names(runs[2].league)))
    path = tmp_path / "pool" / newest
    raw = bytearray(path.read_bytes())
    if damage == "flip":
        raw[len(raw) // 2] ^= 1
        path.write_bytes(raw)
    elif damage == "cut":
        path.write_bytes(raw[:-100])
    elif damage == "gone":
        path.unlink()
    else:
        np.save(path, np.zeros(5))
    assert checkpoint.load(tmp_path, made).run.epoch == 3
    for path in (tmp_path / "pool").iterdir():
        path.unlink()
    with pytest.raises(RunError, match="no checkpoint to go on from"):
        checkpoint.load(tmp_path, made)


def test_a_pool_of_another_game_is_not_played(runs, made):
    """Compiled games look at no bounds."""
    check_run(runs[3], made)
    first, *others = runs[3].league.pool
    sizes = first.policies.sizes.copy()
    sizes[:, 0] += 1
    wide = replace(first, policies=first.policies._replace(sizes=sizes))
    with pytest.raises(ValueError, match="none of this game"):
        check_run(replace(runs[3], league=replace(runs[3].league, pool=(wide, *others))), made)
    strange = replace(first, members=first.members + 12)
    with pytest.raises(ValueError, match="pool names members that there are not"):
        check_run(replace(runs[3], league=replace(runs[3].league, pool=(strange, *others))), made)
    with pytest.raises(ValueError, match="exploiters are of other islands"):
        check_run(replace(runs[3], league=replace(runs[3].league, attempts=())), made)
