"""A real pseudo-terminal, and what somebody in front of it would see."""

import fcntl
import os
import pty
import select
import signal
import struct
import subprocess
import termios
import time

import pyte

from tests.command.conftest import BERTEAM

LINES = 60


class Terminal:
    """A process on a terminal of its own; the screen is emulated, so that what is drawn over is gone."""

    def __init__(self, command, folder, columns=80, ignored=(), **environment):
        self.master, slave = pty.openpty()
        fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", LINES, columns, 0, 0))
        clean = {k: v for k, v in os.environ.items() if k not in {"NO_COLOR", "FORCE_COLOR", "COLUMNS", "LINES"}}
        self.process = subprocess.Popen(
            [str(word) for word in command],
            cwd=folder,
            stdin=slave,
            stdout=slave,
            stderr=slave,
            start_new_session=True,
            env=clean | {"TERM": "xterm-256color"} | environment,
            preexec_fn=lambda: begun(ignored),  # noqa: PLW1509 (no threads run yet)
        )
        os.close(slave)
        self.screen = pyte.HistoryScreen(columns, LINES, history=1000)
        self.stream = pyte.ByteStream(self.screen)
        self.written = b""
        self.seen = []

    @property
    def lines(self):
        """All that stands on the screen and above it, without what is empty at the end."""
        above = ["".join(row[k].data for k in range(self.screen.columns)) for row in self.screen.history.top]
        return [line.rstrip() for line in (*above, *self.screen.display)]

    @property
    def text(self):
        return "\n".join(self.lines).strip()

    def read(self):
        """Takes what there is, or waits a second; returns whether more may come. Each sight is kept in ``seen``."""
        if not select.select([self.master], [], [], 1)[0]:
            return True
        try:
            found = os.read(self.master, 65536)
        except OSError:  # Linux says EIO when nobody has the other end any more
            return False
        self.written += found
        self.stream.feed(found)
        self.seen.append("\n".join(self.screen.display))
        return bool(found)

    def until(self, wanted, seconds=30):
        """Reads until ``wanted`` stands there."""
        ends = time.monotonic() + seconds
        while wanted not in self.text:
            assert time.monotonic() < ends, f"no {wanted!r} in:\n{self.text}"
            assert self.read(), f"ended without {wanted!r}:\n{self.text}"

    def type(self, text):
        os.write(self.master, text.encode())

    def end(self):
        """Reads to the end; returns the exit code."""
        while self.read():
            pass
        return self.process.wait(timeout=60)

    def close(self):
        os.close(self.master)
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()


def begun(ignored):
    """Takes the terminal, in the new process, and has it ignore signals, as nohup does."""
    fcntl.ioctl(0, termios.TIOCSCTTY, 0)
    for number in ignored:
        signal.signal(number, signal.SIG_IGN)


def berteam_on(folder, *words, **settings):
    return Terminal([BERTEAM, *words], folder, **settings)
