"""Saves a run so that it can go on: tensors as safetensors, the rest as JSON, nothing that runs code when read."""

from __future__ import annotations

import contextlib
import json
import logging
import os
import shutil
import zlib
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, TypeVar

import torch
from safetensors import SafetensorError
from safetensors.torch import load_file, save_file

from berteam_cli.errors import InputError, RunError
from berteam_cli.fitting import check_run, check_said
from berteam_cli.opponents import pool
from berteam_cli.opponents.league import League
from berteam_cli.population import ARRAYS, Island, Population
from berteam_cli.tensors import below
from berteam_cli.training import Parts, Run

log = logging.getLogger("berteam")
T = TypeVar("T")

SCHEMA = 6  # raised when a file of an older version could be misread
KEPT = 2
DAMAGES = (
    *(OSError, ValueError, KeyError, IndexError, TypeError, AttributeError, OverflowError),
    *(RuntimeError, RecursionError, MemoryError, SafetensorError),
)
"""What reading raises for files that are cut, changed or made up."""


@dataclass(frozen=True)
class Saved:
    """What a checkpoint holds.

    Attributes:
        run: the state of the run.
        table_sizes: bytes of each growing table at that moment.
        seconds: the run had taken.
    """

    run: Run
    table_sizes: dict[str, int]
    seconds: float


def save(folder: Path, saved: Saved, parts: Parts) -> None:
    """Saves a run under ``folder``/checkpoint; the last two are kept.

    The files are written under another name first: whoever interrupts this leaves the older checkpoints as they were.
    Those of later epochs, which a run leaves that had to go back before one, are removed.

    Raises:
        OSError: there is no room.
    """
    place = folder / "checkpoint"
    final, part = place / f"epoch_{saved.run.epoch:08d}", place / "part"
    shutil.rmtree(part, ignore_errors=True)
    part.mkdir(parents=True)
    try:
        write(part, saved, parts)
    except BaseException:
        shutil.rmtree(part, ignore_errors=True)
        raise
    shutil.rmtree(final, ignore_errors=True)
    os.replace(part, final)
    sync(place)
    whole = sorted(place.glob("epoch_*"))
    here = whole.index(final)
    for other in (*whole[: max(0, here + 1 - KEPT)], *whole[here + 1 :]):
        shutil.rmtree(other)
    pool.pruned(folder / pool.POOL, pooled(place))


def pooled(place: Path) -> set[str]:
    """Returns the files of the pool that the checkpoints in folder ``place`` need, as far as they can be read."""
    needed: set[str] = set()
    for state in place.glob("epoch_*/state.json"):
        with contextlib.suppress(*DAMAGES):
            needed |= set(json.loads(state.read_text(encoding="utf-8"))["pool"])
    return needed


def write(part: Path, saved: Saved, parts: Parts) -> None:
    """Writes the files of a checkpoint into folder ``part``; they are on the disk then.

    Raises:
        OSError: there is no room.
    """
    run = saved.run
    try:
        save_file(tensors_of(run, parts), part / "tensors.safetensors")
    except SafetensorError as error:  # as the library calls a full disk
        raise OSError(f"{part} cannot be written: {error}") from error
    said = {
        "schema": SCHEMA,
        "epoch": run.epoch,
        "played": run.played,
        "steps": run.steps,
        "seconds": saved.seconds,
        "table_sizes": saved.table_sizes,
        "pool": pool.names(run.league),
        "crc32": file_sum(part / "tensors.safetensors"),
        **origins(parts.optimizer.islands),
    }
    said["checksum"] = state_sum(said)
    (part / "state.json").write_text(json.dumps(said, indent=1) + "\n", encoding="utf-8")
    for file in part.iterdir():
        with file.open("rb") as opened:
            os.fsync(opened.fileno())
    sync(part)


def origins(islands: tuple[Island, ...]) -> dict[str, Any]:
    """Returns who the members of another run are, whom no config names; nothing where there are none."""
    said = [
        {"island": x.name, "algorithm": x.learner.algorithm, **asdict(x.origin)}
        for x in islands
        if x.origin is not None
    ]
    return {"origins": said} if said else {}


def sync(folder: Path) -> None:
    """Makes sure that the names in ``folder`` are on the disk, where the system can say so."""
    with contextlib.suppress(OSError):
        opened = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(opened)
        finally:
            os.close(opened)


def load(folder: Path, parts: Parts) -> Saved:
    """Returns the newest checkpoint under ``folder`` that is whole.

    Raises:
        RunError: there is none.
    """
    return newest_whole(folder, lambda place: read(place, parts))


def newest_whole(folder: Path, reading: Callable[[Path], T]) -> T:
    """Returns what ``reading`` gives of the newest checkpoint under ``folder`` that it can read.

    Raises:
        RunError: there is none.
    """
    damage = "there is none"
    for place in sorted((folder / "checkpoint").glob("epoch_*"), reverse=True):
        try:
            return reading(place)
        except DAMAGES as error:
            damage = f"{place.name} is damaged: {error}"
            log.warning("Checkpoint %s; the one before is tried.", damage)
    raise RunError(f"{folder} has no checkpoint to go on from ({damage}).")


def check_schema(folder: Path) -> None:
    """Checks that this version reads the checkpoints under ``folder``, as far as they can be read at all.

    Raises:
        InputError: they are another version's.
    """
    for place in (folder / "checkpoint").glob("epoch_*"):
        with contextlib.suppress(*DAMAGES):
            if (schema := json.loads((place / "state.json").read_text(encoding="utf-8"))["schema"]) != SCHEMA:
                raise InputError(
                    f"{folder} is a run of another version of berteam, whose checkpoints (schema {schema}, "
                    f"not {SCHEMA}) this one does not read; use that version, or begin anew with on_exists=overwrite."
                )


def read(place: Path, parts: Parts) -> Saved:
    """Returns the checkpoint in folder ``place``.

    Raises:
        ValueError: it is of another version or was changed since it was written.
    """
    said = said_of(place)
    tensors = tensors_in(place, said)
    minds = tuple(
        island.learner.restored(below(tensors, f"island.{i}.")) for i, island in enumerate(parts.optimizer.islands)
    )
    arrays = {name: tensors[f"population.{name}"].numpy() for name in ARRAYS}
    selection = parts.selector.restored(below(tensors, "selector."))
    league = None
    if isinstance(parts.opponents, League):
        league = pool.restored(below(tensors, "league."), place.parent.parent / pool.POOL)
    run = Run(said["epoch"], Population(minds=minds, **arrays), selection, said["played"], said["steps"], league)
    check_run(run, parts)
    return Saved(run, said["table_sizes"], said["seconds"])


def said_of(place: Path) -> dict[str, Any]:
    """Returns what the checkpoint in folder ``place`` says beside its tensors.

    Raises:
        ValueError: it is of another version or was changed since it was written.
    """
    said: dict[str, Any] = json.loads((place / "state.json").read_text(encoding="utf-8"))
    if said["schema"] != SCHEMA:
        raise ValueError(f"its schema is {said['schema']}, this version reads {SCHEMA}")
    check_said(said)
    if state_sum(said) != said["checksum"]:
        raise ValueError("its checksum is wrong")
    return said


def tensors_in(place: Path, said: dict[str, Any]) -> dict[str, torch.Tensor]:
    """Returns all tensors of the checkpoint in folder ``place``, which has ``said`` what it holds.

    Raises:
        ValueError: they were changed since they were written.
    """
    if file_sum(place / "tensors.safetensors") != said["crc32"]:
        raise ValueError("its checksum is wrong")
    # In memory of their own: by where a tensor lies torch chooses its kernels, and so the last bits of what comes out.
    return {name: tensor.clone() for name, tensor in load_file(place / "tensors.safetensors").items()}


def tensors_of(run: Run, parts: Parts) -> dict[str, torch.Tensor]:
    """Returns all tensors of a run by name, on the processor and each with memory of its own."""
    tensors = {f"population.{name}": torch.from_numpy(getattr(run.population, name)) for name in ARRAYS}
    for i, (island, mind) in enumerate(zip(parts.optimizer.islands, run.population.minds, strict=True)):
        tensors |= {f"island.{i}.{name}": tensor for name, tensor in island.learner.tensors(mind).items()}
    tensors |= {f"selector.{name}": tensor for name, tensor in parts.selector.tensors(run.selection).items()}
    tensors |= {f"league.{name}": tensor for name, tensor in parts.opponents.tensors(run.league).items()}
    return {name: alone(tensor.detach().cpu().contiguous()) for name, tensor in tensors.items()}


def alone(tensor: torch.Tensor) -> torch.Tensor:
    """Returns ``tensor``, or a copy where it is part of a larger one, whose memory another part may share."""
    whole = tensor.untyped_storage().nbytes() == tensor.nbytes
    return tensor if whole else tensor.clone()


def state_sum(said: dict[str, Any]) -> int:
    """Returns the checksum of what a state says, itself left out."""
    rest = {key: value for key, value in said.items() if key != "checksum"}
    return zlib.crc32(json.dumps(rest, sort_keys=True).encode())


def file_sum(path: Path) -> int:
    """Returns the checksum of a file: CRC-32, which sees damage as well as any and takes a tenth of SHA-256's time."""
    found = 0
    with path.open("rb") as file:
        while block := file.read(2**22):
            found = zlib.crc32(block, found)
    return found
