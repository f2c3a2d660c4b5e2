"""Long work tells how far it is."""

import io
import logging

import pytest
from rich.console import Console

from berteam_cli import progress as module
from berteam_cli.progress import progress


@pytest.fixture
def clock(monkeypatch):
    """A clock that stands still until it is set."""
    now = {"s": 0.0}
    monkeypatch.setattr(module.time, "monotonic", lambda: now["s"])
    return now


@pytest.fixture
def told(monkeypatch):
    """The lines of the log."""
    lines, log, handler = [], logging.getLogger("berteam"), logging.Handler()
    handler.emit = lambda record: lines.append(record.getMessage())
    monkeypatch.setattr(log, "handlers", [handler])
    monkeypatch.setattr(log, "level", logging.INFO)
    log.manager._clear_cache()
    yield lines
    log.manager._clear_cache()


def test_lines_come_after_two_seconds_and_then_every_ten(clock, told):
    with progress("Rating 28 teams", 4000) as tell:
        for second in range(1, 41):
            clock["s"] = float(second)
            tell(100)
    assert told == [
        f"Rating 28 teams: {done:,} of 4,000 games, 100 a second, {left} s left"
        for done, left in ((200, 38), (1200, 28), (2200, 18), (3200, 8))
    ]


def test_nothing_is_said_of_quick_work(clock, told):
    with progress("Quick", 10) as tell:
        clock["s"] = 1.9
        tell(10)
    assert not told


def test_a_terminal_has_a_bar_with_rate_and_time(clock, monkeypatch):
    screen = io.StringIO()
    monkeypatch.setattr(module, "console", lambda: Console(file=screen, force_terminal=True, width=100))
    monkeypatch.setattr(module, "interactive", lambda: True)
    with progress("Comparing", 500, "games") as tell:
        clock["s"] = 1.0
        tell(100)
        assert screen.getvalue() == ""
        clock["s"] = 4.0
        tell(100)
        clock["s"] = 5.0
        tell(100)
    said = screen.getvalue()
    assert "Comparing" in said
    assert "300/500" in said
    assert "60/s" in said
