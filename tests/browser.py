"""A page in headless Chromium, driven over a pipe; nothing is fetched from anywhere."""

import json
import os
import shutil
import subprocess
import time
from contextlib import contextmanager

import pytest

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
FLAGS = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--hide-scrollbars"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync", "--disable-dev-shm-usage"),
    *("--remote-debugging-pipe", "--window-size=1280,800"),
)
LONG_S = 60

needs_chromium = pytest.mark.skipif(
    CHROMIUM is None, reason="no chromium on this machine (Debian: apt-get install chromium)"
)


class Tab:
    """A page that is open; ``errors`` are what went wrong in it, ``asked`` the addresses it wanted."""

    def __init__(self, orders, answers):
        self.orders, self.answers, self.number, self.session = orders, answers, 0, None
        self.rest, self.errors, self.asked = b"", [], []

    def send(self, method, **params):
        self.number += 1
        order = {"id": self.number, "method": method, "params": params}
        if self.session:
            order["sessionId"] = self.session
        os.write(self.orders, json.dumps(order).encode() + b"\0")
        while True:
            said = self.read()
            if said.get("id") == self.number:
                assert "error" not in said, said
                return said["result"]

    def read(self):
        while b"\0" not in self.rest:
            part = os.read(self.answers, 1 << 16)
            assert part, "the browser has gone"
            self.rest += part
        text, self.rest = self.rest.split(b"\0", 1)
        said = json.loads(text)
        if said.get("method") in {"Runtime.exceptionThrown", "Log.entryAdded"}:
            self.errors.append(said["params"])
        if said.get("method") == "Network.requestWillBeSent":
            self.asked.append(said["params"]["request"]["url"])
        return said

    def open(self, address):
        target = self.send("Target.createTarget", url="about:blank")["targetId"]
        self.session = self.send("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Runtime", "Log", "Network", "Page"):
            self.send(f"{domain}.enable")
        self.send("Page.navigate", url=address)
        self.until("document.readyState === 'complete'")

    def ask(self, expression):
        """Returns the value of a JavaScript expression in the page."""
        said = self.send("Runtime.evaluate", expression=expression, returnByValue=True)
        assert "exceptionDetails" not in said, said["exceptionDetails"]
        return said["result"].get("value")

    def until(self, expression):
        """Waits until a JavaScript expression is true."""
        give_up = time.monotonic() + LONG_S
        while not self.ask(expression):
            assert time.monotonic() < give_up, f"{expression} is not true after {LONG_S} s"
            time.sleep(0.02)

    def press(self, key, code, shift=False):
        common = {"key": key, "code": key if key != " " else "Space", "windowsVirtualKeyCode": code}
        for kind in ("keyDown", "keyUp"):
            self.send("Input.dispatchKeyEvent", type=kind, modifiers=8 if shift else 0, **common)


@contextmanager
def opened(address, folder, *flags):
    """Opens an address in a browser of its own, whose profile is in ``folder``."""
    ours_in, theirs_out = os.pipe()
    theirs_in, ours_out = os.pipe()
    profile = f"--user-data-dir={folder / 'profile'}"
    process = subprocess.Popen(
        ["bash", "-c", f'exec "$@" 3<&{theirs_in} 4>&{theirs_out}', "bash", CHROMIUM, *FLAGS, profile, *flags],
        pass_fds=(theirs_in, theirs_out),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    os.close(theirs_in)
    os.close(theirs_out)
    tab = Tab(ours_out, ours_in)
    try:
        tab.open(address)
        yield tab
    finally:
        process.terminate()
        process.wait(LONG_S)
        os.close(ours_in)
        os.close(ours_out)
