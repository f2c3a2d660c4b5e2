"""Only one process writes in a folder at a time."""

from __future__ import annotations

import fcntl
import logging
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from berteam_cli.errors import InputError, RunError
from berteam_cli.folder import LOG, MANIFEST, check_links, missing

log = logging.getLogger("berteam")


@contextmanager
def held(folder: Path) -> Iterator[None]:
    """Keeps ``folder`` for this process, and makes it if it is not there.

    The lock is one of the system's on the folder's log, which ends with the process, however that ends. What is
    refused inside leaves no folder that was made for it.

    Raises:
        InputError: another process writes there, or nobody can.
        RunError: it could not be written any more.
    """
    made = missing(folder)
    if os.path.exists(folder / MANIFEST):  # False for a name that no folder can have
        check_links(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        file = (folder / LOG).open("a", encoding="utf-8")
    except OSError as error:
        forget(made)
        raise InputError(f"out={folder} cannot be written: {error.strerror or error}.") from error
    with file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise InputError(
                f"{folder} is in use: another process is writing there; wait for its end, or choose another folder."
            ) from None
        except OSError as error:  # some network file systems
            log.warning("%s cannot be locked (%s); start no second process there.", folder, error.strerror)
        try:
            yield
        except InputError:
            if made:
                shutil.rmtree(folder)
                forget(made)
            raise
        except OSError as error:
            raise RunError(f"{folder} cannot be written: {error}.") from error


def in_use(folder: Path) -> bool:
    """Returns whether a process is writing in ``folder``, as far as its file system can tell."""
    with suppress(OSError), (folder / LOG).open("r", encoding="utf-8") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
    return False


def forget(made: list[Path]) -> None:
    """Removes the folders ``made``, outermost first in the list, as far as nothing lies there."""
    for path in reversed(made):
        with suppress(OSError):
            path.rmdir()
