"""Games on the machines of a Ray cluster: the driver's end, and what runs there.

Whole slices of games travel: the game's settings, the policies, who plays and the seeds there, the results back. Every
game draws from its own seed, so it is the same wherever and however often it is played. Nothing of Ray is imported
before somebody asks for it, and nothing of torch where games are played.
"""

from __future__ import annotations

import logging
import os
import pickle
import signal
import sys
import threading
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache, lru_cache
from importlib.metadata import version
from itertools import islice
from typing import Any, NamedTuple

import numpy.typing as npt
from llvmlite.binding import get_host_cpu_name

from berteam_cli.acting import Policies
from berteam_cli.env.base import Env, Results, blank_results
from berteam_cli.errors import InputError, RunError
from berteam_cli.outcomes import Ints

log = logging.getLogger("berteam")

GAMES_A_TASK = 64  # at most: some tenths of a second, which is what the death of a worker may lose
TASKS_A_PROCESSOR = 4  # at least, where there are so many games: enough that processors end together
AHEAD = 16  # tasks a processor that are asked for at once: some seconds' work, which is done in vain if one fails
QUIET = {
    "RAY_USAGE_STATS_ENABLED": "0",  # nothing is sent anywhere
    "RAY_NUM_REDIS_GET_RETRIES": "1",  # of 40 s each, to find a cluster; Ray takes 20
    "RAY_IGNORE_UNHANDLED_ERRORS": "1",  # of the other tasks, when one has failed; that one is told
}
LIVES = 20  # deaths of workers and machines that a task outlives
PATIENCE_S = 60.0  # without a result, before that is told


class Call(NamedTuple):
    """What the tasks of one batch of games share.

    Attributes:
        folder: where the command runs; modules of the user's may be there.
        env: the game, pickled.
        players, policies, seeds: as of ``Env.play``.
        record: whether anyone will learn from the games.
        versions: of what results depend on.
    """

    folder: str
    env: bytes
    players: Ints
    policies: Policies
    seeds: npt.NDArray[Any]
    record: bool
    versions: dict[str, str]


def play_slice(packed: bytes, start: int, stop: int) -> tuple[str, list[npt.NDArray[Any]]]:
    """Plays games ``start`` to ``stop - 1`` of a pickled Call; runs in a process that Ray started.

    Returns the kind of processor, and these rows of each array of Results.

    Raises:
        RunError: this machine has other versions, or a game cannot be played.
    """
    call: Call = pickle.loads(packed)  # arrays of Ray's own store cannot be written to, and compiled games may not care
    here = versions()
    for package, wanted in call.versions.items():
        if here[package] != wanted:
            raise RunError(f"A machine of the Ray cluster has {package} {here[package]}, this one {wanted}.")
    if call.folder not in sys.path:
        sys.path.append(call.folder)
    results = blank_results(game(call.env), len(call.seeds), record=call.record)
    game(call.env).play(range(start, stop), call.players, call.policies, call.seeds, results)
    return get_host_cpu_name(), [column[start:stop] for column in results]


@lru_cache(maxsize=1)
def game(packed: bytes) -> Env:
    """Returns the pickled game; the last one is kept, as a reward of the user's takes seconds to compile."""
    return pickle.loads(packed)


@cache
def versions() -> dict[str, str]:
    """Returns the versions of the packages that decide how a game goes."""
    return {package: version(package) for package in ("berteam-cli", "numpy", "numba")}


class Cluster:
    """A Ray cluster that this process is connected to, until it ends.

    Attributes:
        size: machines and processors, as it was told last.
        strange: kinds of processors other than this machine's that have played.
    """

    def __init__(self) -> None:
        """Connects to the cluster at RAY_ADDRESS, or starts one of this machine alone.

        Raises:
            InputError: Ray is not installed, or there is no cluster at that address.
        """
        connect()
        self.size = (0, 0)
        self.strange: set[str] = set()

    def play(self, env: Env, players: Ints, policies: Policies, seeds: npt.NDArray[Any], results: Results) -> None:
        """Plays all games, and fills ``results``; see ``Env.play``.

        A task whose worker or machine dies is given to another. When one fails, those asked for by then are left to
        end by themselves: to cancel a task of Ray's that is just ending may end the process that cancels it.

        Raises:
            RunError: a game cannot be played, or workers died too often.
        """
        import ray  # noqa: PLC0415 (an extra)

        processors = self.processors()
        each = slice_size(len(seeds), processors)
        record = len(results.actions) > 0
        call = Call(os.getcwd(), pickle.dumps(env), players, policies, seeds, record, versions())
        packed = ray.put(pickle.dumps(call))
        task = ray.remote(num_cpus=1, max_retries=LIVES)(play_slice)
        starts = range(0, len(seeds), each)
        asked = (task.remote(packed, start, min(start + each, len(seeds))) for start in starts)
        pending = deque(islice(asked, AHEAD * processors))
        for start in starts:
            processor, played = self.waited(pending.popleft())
            pending.extend(islice(asked, 1))
            self.look(processor)
            columns: tuple[Any, ...] = results
            for column, part in zip(columns, played, strict=True):
                column[start : start + len(part)] = part

    def waited(self, reference: Any) -> Any:
        """Returns what a task gave.

        Raises:
            RunError: it cannot be done.
        """
        from ray import exceptions, get  # noqa: PLC0415 (an extra)

        while True:
            try:
                return get(reference, timeout=PATIENCE_S)
            except exceptions.GetTimeoutError:
                log.warning("The Ray cluster has given nothing for %g s; it is waited for.", PATIENCE_S)
                self.processors()
            except exceptions.RayTaskError as error:
                if isinstance(error.cause, RunError):
                    raise RunError(str(error.cause)) from None
                raise
            except exceptions.RayError as error:
                said = str(error).strip().splitlines()[0].rstrip(".")
                raise RunError(f"The Ray cluster cannot play games: {type(error).__name__}: {said}.") from error

    def processors(self) -> int:
        """Returns how many there are, at least 1, and tells if that has changed."""
        import ray  # noqa: PLC0415 (an extra)

        machines = [node for node in ray.nodes() if node["Alive"]]
        size = len(machines), int(sum(node["Resources"].get("CPU", 0) for node in machines))
        if size != self.size:
            self.size = size
            log.info("Games are played by Ray on %d machine(s) with %d processor(s).", *size)
        return max(size[1], 1)

    def look(self, processor: str) -> None:
        """Warns of a kind of processor that is not this one's, once."""
        if processor != get_host_cpu_name() and processor not in self.strange:
            self.strange.add(processor)
            log.warning(
                "A machine of the Ray cluster has a %s processor, this one a %s: "
                "the same seed may not give the same bytes.",
                *(processor, get_host_cpu_name()),
            )


def slice_size(games: int, processors: int) -> int:
    """Returns how many games a task plays."""
    return min(GAMES_A_TASK, max(1, games // (TASKS_A_PROCESSOR * processors)))


def connect() -> None:
    """Connects this process to Ray, unless it is; what it started itself ends with it.

    Raises:
        InputError: Ray is not installed, or there is no cluster at RAY_ADDRESS.
    """
    for name, value in QUIET.items():
        os.environ.setdefault(name, value)
    try:
        from ray import init, is_initialized  # noqa: PLC0415 (an extra)
    except ImportError as error:
        raise InputError(
            "workers=ray needs the package ray, which is not installed: pip install 'berteam-cli[ray]'."
        ) from error
    from berteam_cli.workers import available_cores  # noqa: PLC0415 (torch, which no machine needs that only plays)

    if is_initialized():
        return
    address = os.environ.get("RAY_ADDRESS")
    quiet: dict[str, Any] = {"logging_level": logging.ERROR, "log_to_driver": False, "include_dashboard": False}
    try:
        with own_handler():
            if address:
                init("auto", **quiet)
            else:
                init("local", num_cpus=available_cores(), **quiet)
    except Exception as error:  # of many kinds, for a wrong port, another version, a missing token
        said = str(error).strip().splitlines()[0].rstrip(".")
        where = f"there is none at RAY_ADDRESS={address}" if address else "none can be started here"
        raise InputError(f"workers=ray needs a Ray cluster, but {where}: {type(error).__name__}: {said}.") from error


@contextmanager
def own_handler() -> Iterator[None]:
    """Keeps what SIGTERM does, which Ray changes."""
    before = signal.getsignal(signal.SIGTERM)
    try:
        yield
    finally:
        if threading.current_thread() is threading.main_thread():
            signal.signal(signal.SIGTERM, before)
