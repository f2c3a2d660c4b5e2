"""The files of the pool: a snapshot each, which is written once and never changed, and read where it is met.

So a checkpoint only says which of them are its own. What a run wrote after its last checkpoint is written again, to the
same bytes, when it goes on from there.
"""

from __future__ import annotations

import os
import resource
import zlib
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from berteam_cli.acting import DEEPEST, Policies
from berteam_cli.errors import InputError
from berteam_cli.opponents.exploiters import Attempt
from berteam_cli.opponents.league import LeagueState
from berteam_cli.opponents.past import Snapshot
from berteam_cli.opponents.record import Record

OTHER_FILES = 256  # that may be open beside those of the pool
POOL = "pool"
"""The folder in a run's, where its snapshots are."""
KEPT = tuple(name for name in Policies._fields if name != "pay")  # nobody pays the past


def row_type(weights: int) -> npt.DTypeLike:
    """Returns what a member is in a file: its place in the population, then its row of Policies."""
    return [
        *(("member", "<i8"), ("sizes", "<i4", (DEEPEST + 2,)), ("epsilon", "<f4"), ("fixed", "<i2")),
        *(("kind", "i1"), ("tanh", "?"), ("weights", "<f4", (weights,))),
    ]


def file_name(epoch: int, island: int) -> str:
    """Returns the name of a snapshot's file; ``island`` as of Snapshot."""
    return f"{epoch:08d}.npy" if island < 0 else f"{epoch:08d}_{island}.npy"


def names(state: LeagueState | None) -> list[str]:
    """Returns the files that ``state`` needs."""
    return [file_name(*snapshot.key) for snapshot in state.pool] if state else []


def on_disk(state: LeagueState | None, folder: Path) -> LeagueState | None:
    """Returns ``state`` with every snapshot in a file of ``folder``, and no longer in memory.

    Raises:
        OSError: there is no room.
    """
    if state is None or all(snapshot.checksum for snapshot in state.pool):
        return state
    folder.mkdir(exist_ok=True)
    return replace(state, pool=tuple(x if x.checksum else written(x, folder) for x in state.pool))


def written(snapshot: Snapshot, folder: Path) -> Snapshot:
    """Writes a snapshot; returns it as it lies in its file.

    Raises:
        OSError: there is no room.
    """
    rows = np.zeros(len(snapshot.members), dtype=row_type(snapshot.policies.weights.shape[1]))
    rows["member"] = snapshot.members
    for name in KEPT:
        rows[name] = getattr(snapshot.policies, name)
    path = folder / file_name(*snapshot.key)
    part = path.with_suffix(".part")
    try:
        with part.open("wb") as file:
            np.save(file, rows, allow_pickle=False)
            file.flush()
            os.fsync(file.fileno())
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)
    return opened(folder, snapshot.epoch, snapshot.island, snapshot.record)


def opened(folder: Path, epoch: int, island: int, record: Record) -> Snapshot:
    """Returns the snapshot in its file of ``folder``, mapped into memory.

    Raises:
        OSError: there is none.
        ValueError: the file holds something else.
    """
    rows = np.load(folder / file_name(epoch, island), mmap_mode="r", allow_pickle=False)
    weights = rows.dtype["weights"].shape[0] if rows.dtype.names else 0
    if rows.dtype != np.dtype(row_type(weights)) or rows.ndim != 1 or not len(rows):
        raise ValueError(f"{file_name(epoch, island)} is no snapshot")
    policies = Policies(**{name: rows[name] for name in KEPT}, pay=np.zeros((len(rows), 0)))
    return Snapshot(epoch, island, rows["member"], policies, record, checksum(rows))


def checksum(rows: npt.NDArray[Any]) -> int:
    """Returns CRC-32 of a snapshot's rows; never 0, which stands for none."""
    return zlib.crc32(rows.view(np.uint8).data) or 1


def restored(tensors: dict[str, Any], folder: Path) -> LeagueState:
    """Returns the state of a league whose tensors these are, with the pool in ``folder``.

    Raises:
        OSError: a snapshot is not there.
        ValueError: one is another than it was.
    """
    pool = []
    for (epoch, island, wanted), record in zip(tensors["pool"].tolist(), tensors["pool_records"].tolist(), strict=True):
        snapshot = opened(folder, epoch, island, Record(*record))
        if snapshot.checksum != wanted:
            raise ValueError(f"{file_name(epoch, island)} is not what it was")
        pool.append(snapshot)
    begun = zip(tensors["attempts"].tolist(), tensors["attempt_records"].tolist(), strict=True)
    return LeagueState(tuple(pool), tuple(Attempt(island, epoch, Record(*record)) for (island, epoch), record in begun))


def pruned(folder: Path, needed: Iterable[str]) -> None:
    """Removes the files of ``folder`` that no checkpoint needs any more; others are not the pool's.

    (Of a file that is removed while it is read a file system over a network may keep one of another name.)
    """
    if folder.is_dir():
        for name in {path.name for path in folder.iterdir() if path.suffix in (".npy", ".part")} - set(needed):
            (folder / name).unlink()


def check_files(snapshots: int) -> None:
    """Checks that so many ``snapshots`` may be open, a file each, and asks the system for as many.

    Raises:
        InputError: they may not.
    """
    needed = snapshots + OTHER_FILES
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if soft == resource.RLIM_INFINITY or needed <= soft:
        return
    try:
        resource.setrlimit(resource.RLIMIT_NOFILE, (needed, hard))
    except (ValueError, OSError):  # more than `hard`, or than the system has for a process
        raise InputError(
            f"opponents.pool_size must be smaller: a snapshot is an open file, and this machine does not allow a "
            f"process the {needed} that {snapshots} of them need (ulimit -Hn says {hard})."
        ) from None
