"""Machines of a Ray cluster, in Ray's eyes, which tests start on this one, and whose power they may cut.

They are started as a user would, by ``ray start``, each in a session of its own. Nothing of Ray runs in the tests'
own process, which Ray would end when it gives up.
"""

import os
import secrets
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

RAY = Path(sys.executable).parent / "ray"
STORE = 80 * 2**20  # bytes, of the objects of a machine
START = [str(RAY), "start", "--block", "--num-cpus=1", f"--object-store-memory={STORE}"]
QUIET = ["--include-dashboard=false", "--include-log-monitor=false"]
PATIENCE_S = 120.0


def variables(folder):
    """Returns the variables of a cluster whose files lie in ``folder``, which is short, as sockets want it."""
    return {
        "RAY_TMPDIR": folder,  # else /tmp/ray, which all Rays share
        "RAY_USAGE_STATS_ENABLED": "0",
        "RAY_AUTH_TOKEN": secrets.token_hex(),  # else Ray keeps one in the user's home
        "RAY_AUTH_MODE": "token",
    }


class Machine:
    """A machine of one processor: the first one of a cluster, or one that joins the cluster at ``address``.

    What it says is written to the file ``said``.
    """

    def __init__(self, said, address=None):
        words = [f"--address={address}"] if address else ["--head", "--port=0", *QUIET]
        with said.open("w") as out:
            self.process = subprocess.Popen(
                [*START, *words], stdout=out, stderr=subprocess.STDOUT, start_new_session=True
            )
        try:
            until(lambda: "Ray runtime started." in said.read_text() or self.process.poll() is not None, said.read_text)
            assert self.process.poll() is None, said.read_text()
        except BaseException:
            self.cut()
            raise

    def playing(self):
        """Returns the processes that play here."""
        return [process for process, name in processes(self.process.pid) if name.startswith("ray::play_slice")]

    def cut(self):
        """Ends all that runs here, at once."""
        while left := processes(self.process.pid):
            for process, _ in left:
                kill(process)
            self.process.poll()


def kill(process):
    with suppress(ProcessLookupError):  # it has just ended
        os.kill(process, signal.SIGKILL)


def processes(session):
    """Returns the processes of a session that have not ended, each with its name."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            state, _, _, sid = (folder / "stat").read_text().rpartition(")")[2].split()[:4]
            if int(sid) == session and state != "Z":
                found.append((int(folder.name), (folder / "cmdline").read_text()))
        except OSError:  # it has just ended
            continue
    return found


def until(condition, told):
    """Waits for ``condition()``; ``told()`` says what else has happened."""
    end = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end, told()
        time.sleep(0.05)
