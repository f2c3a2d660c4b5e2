"""Both ends of a worker process that plays the games of one PettingZoo environment."""

from __future__ import annotations

import multiprocessing
import os
import random
import signal
import sys
import threading
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from multiprocessing.util import Finalize
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from berteam_cli.acting import Policies
from berteam_cli.env.pettingzoo_game import played
from berteam_cli.env.pettingzoo_made import Facts, Game, Unfit, facts_of, made, said
from berteam_cli.outcomes import Ints
from berteam_cli.stopping import SIGNALS

LEAVE_S = 5.0  # for an environment to close


class Request(NamedTuple):
    """Games to play.

    Attributes:
        policies: how everybody acts; None: as in the request before.
        players: (B, V) row in ``policies`` of each player.
        seeds: of the B games.
        record: whether anyone will learn from the games.
    """

    policies: Policies | None
    players: Ints
    seeds: list[int]
    record: bool


class Failed(Exception):
    """Why an environment cannot be made or a game cannot be played, and the traceback of the worker process."""

    def __init__(self, why: str, trace: str) -> None:
        """Takes both; travels between processes."""
        super().__init__(why, trace)
        self.why, self.trace = why, trace


def serve(connection: Connection, game: Game) -> None:
    """Sends the Facts of the environment, then for each Request a Played for each game, until the connection ends.

    Sends Failed instead where something does not work, and plays no further game of that request.
    """
    leave_group()
    threading.Thread(target=end_with_parent, daemon=True).start()
    if game.folder not in sys.path:
        sys.path.append(game.folder)  # last, so that it hides nothing
    random.seed(0)  # an environment may draw when it is made, and must be the same in every process
    np.random.seed(0)  # noqa: NPY002
    try:
        env = made(game)
        facts = facts_of(env, game.teams)
    except Exception as error:  # whatever the environment may raise
        blamed = "" if isinstance(error, Unfit) else f"target={game.target}: "
        connection.send(Failed(blamed + said(error), traceback.format_exc()))
        return
    try:
        connection.send(facts)
        policies: Any = None  # the first request brings them
        while True:
            request = connection.recv()
            policies = request.policies or policies
            for rows, seed in zip(request.players, request.seeds, strict=True):
                try:
                    answer: Any = played(env, game, facts, policies, rows, seed, record=request.record)
                except Exception as error:
                    answer = Failed(said(error), traceback.format_exc())
                connection.send(answer)
                if isinstance(answer, Failed):
                    break
    except (EOFError, OSError):  # nobody asks any more
        with suppress(Exception):  # of foreign code, and nobody would read what it says
            env.close()


def leave_group() -> None:
    """Makes this process the first of a group of its own, with those that the environment may start.

    Ctrl-C goes to all processes of a group, but a run ends when its epoch does, and its workers with it.
    """
    os.setsid()
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)  # forgets those that came while the process started
    signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)
    for number in SIGNALS:
        signal.signal(number, signal.SIG_DFL)


def end_with_parent() -> None:
    """Ends this process and its group, whatever they do, when the one that started it has gone, however that went."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os.killpg(0, signal.SIGKILL)


class WorkerProcess:
    """A process that serves; for one thread at a time, but any may kill it."""

    def __init__(self, game: Game) -> None:
        """Starts it."""
        context = multiprocessing.get_context("spawn")
        self.game = game
        self.policies: Policies | None = None
        self.known: Facts | None = None
        self.connection, theirs = context.Pipe()
        self.process = context.Process(target=serve, args=(theirs, game))
        Finalize(self, kill, args=(self.process,), exitpriority=0)
        resource_tracker.ensure_running()  # process.start does it else, and lets signals through
        before = signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
        try:
            self.process.start()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        theirs.close()

    def facts(self) -> Facts:
        """Returns what its environment is like.

        Raises:
            Failed: it cannot be made.
        """
        if self.known is None:
            self.known = self.answer()
        return self.known

    def ask(self, policies: Policies, players: Ints, seeds: npt.NDArray[np.uint64], *, record: bool) -> None:
        """Asks for games, see ``Request``; sends ``policies`` only if they are others than before.

        Raises:
            Failed: the environment cannot be made, or the process has ended.
        """
        self.facts()
        news = None if policies is self.policies else policies
        try:
            self.connection.send(Request(news, players, seeds.tolist(), record))
        except OSError:
            raise self.ended() from None
        self.policies = policies

    def answer(self) -> Any:
        """Returns the next answer, a Played for each game asked for.

        Raises:
            Failed: there is none.
        """
        try:
            answer = self.connection.recv()
        except (EOFError, OSError):
            raise self.ended() from None
        if isinstance(answer, Failed):
            raise answer
        return answer

    def ended(self) -> Failed:
        """Returns what to raise where the process ended by itself."""
        self.process.join(LEAVE_S)
        return Failed(f"target={self.game.target}: its process ended with exit code {self.process.exitcode}.", "")

    def close(self) -> None:
        """Ends the process, which closes its environment before."""
        self.connection.close()
        self.process.join(LEAVE_S)
        kill(self.process)


def kill(process: SpawnProcess) -> None:
    """Ends a process and its group at once, if it was started; who waits for its answer gets Failed."""
    if process.pid is not None and process.is_alive():
        with suppress(ProcessLookupError):  # it has not made its group yet
            os.killpg(process.pid, signal.SIGKILL)
        process.kill()
        process.join()


class Processes:
    """Worker processes of one game, started when they are needed: as many as threads play at the same time.

    Attributes:
        idle: those that nobody uses.
        busy: those in use.
        stopped: whether no game is played any more.
    """

    def __init__(self, game: Game) -> None:
        """Starts none yet. They end when this object is dropped, at the latest when Python ends."""
        self.game = game
        self.idle: list[WorkerProcess] = []
        self.busy: set[WorkerProcess] = set()
        self.stopped = False
        Finalize(self, close, args=(self.idle,), exitpriority=1)  # before they are killed

    def __reduce__(self) -> tuple[Any, ...]:
        """Returns how it is made on another machine, which has processes of its own."""
        return Processes, (self.game,)

    @contextmanager
    def one(self) -> Iterator[WorkerProcess]:
        """Gives a process to whoever asks; if what is done with it fails, it ends."""
        try:
            worker = self.idle.pop()
        except IndexError:
            worker = WorkerProcess(self.game)
        self.busy.add(worker)
        try:
            if self.stopped:  # just now: it may not have seen this one
                kill(worker.process)
            yield worker
        except BaseException:
            kill(worker.process)
            raise
        finally:
            self.busy.discard(worker)
        self.idle.append(worker)

    def stop(self) -> None:
        """Ends the processes in use, for good."""
        self.stopped = True
        for worker in list(self.busy):
            kill(worker.process)


def close(idle: list[WorkerProcess]) -> None:
    """Ends processes that nobody uses."""
    for worker in idle:
        worker.connection.close()  # all of them first, so that they end together
    for worker in idle:
        worker.close()
    idle.clear()
