"""What a terminal shows of a run while it trains."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from rich.console import Console, ConsoleOptions, RenderResult
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table

from berteam_cli.evaluation.sight import Sight
from berteam_cli.optimizer.fitness import CaptainElo
from berteam_cli.pace import Pace, spoken
from berteam_cli.population import names, rated
from berteam_cli.records import team_name
from berteam_cli.selector.base import TeamDistribution
from berteam_cli.terminal import console, interactive
from berteam_cli.training import Parts, Run

A_SECOND = 2  # drawings, of 3 to 6 ms each
WIDE = 100  # columns that hold two figures beside each other
UNKNOWN = "-"


class View:
    """The figures of a run as they are now.

    To tell it of an epoch costs nothing; what it shows is worked out when it is drawn, from states that nobody changes.
    """

    def __init__(self, parts: Parts, epochs: int, pace: Pace, run: Run) -> None:
        """Takes what the run is made of, and how far it is; what has happened before is told as an epoch is."""
        self.parts, self.epochs, self.pace = parts, epochs, pace
        self.run, self.replaced = run, 0
        self.recorded: tuple[int, TeamDistribution] | None = None
        self.sight: Sight | None = None

    def tell(self, run: Run, replaced: int, distribution: TeamDistribution | None, sight: Sight | None = None) -> None:
        """Takes the run after an epoch and the members it replaced; its distribution if that was recorded.

        And what was seen of it against the fixed teams, if it was looked at.
        """
        self.run = run
        self.replaced += replaced
        self.sight = sight or self.sight
        if distribution is not None:
            self.recorded = run.epoch, distribution

    def figures(self) -> dict[str, str]:
        """Returns what is shown, each under its name; UNKNOWN where it is not known yet."""
        each, games = self.pace.each, self.parts.games_per_epoch
        known = not math.isnan(each)
        left = each * (self.epochs - self.run.epoch) - (time.monotonic() - self.pace.at) if known else math.nan
        label, best = self.best()
        effective, favourite = self.chosen()
        return {
            "games": f"{self.run.played:,}, {rate(games / each)} a second" if known else f"{self.run.played:,}",
            "time left": spoken(max(left, 0.0)) if known else UNKNOWN,
            label: best,
            "effective teams": effective,
            "favourite team": favourite,
            "replacements": f"{self.replaced:,}",
        }

    def best(self) -> tuple[str, str]:
        """Returns what members are rated by while they train, and the fittest by that."""
        rule, people = self.parts.optimizer.fitness, self.run.population
        elo = isinstance(rule, CaptainElo)
        label = "best Elo" if elo else "best mean score"
        if not self.run.played:
            return label, UNKNOWN
        fittest = int(np.argmax(np.where(rated(self.parts.optimizer.islands), people.fitness, -np.inf)))
        value = rule.shown(people.fitness)[fittest]
        called = names(self.parts.optimizer.islands, people)[fittest]
        return label, f"{value:,.0f} ({called})" if elo else f"{value:.3f} ({called})"

    def chosen(self) -> tuple[str, str]:
        """Returns how many teams the selector in effect chooses from, and which it likes best, as last recorded."""
        if self.recorded is None:
            return UNKNOWN, UNKNOWN
        epoch, distribution = self.recorded
        entropy = distribution.entropy
        effective = UNKNOWN if math.isnan(entropy) else f"{math.exp(entropy):,.1f} (epoch {epoch})"
        if not len(distribution.teams):
            return effective, UNKNOWN
        likeliest = int(np.argmax(distribution.probability))
        return effective, f"{team_name(distribution.teams[likeliest])} ({distribution.probability[likeliest]:.3f})"

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """Draws the bar of epochs, and below it the figures, one or two beside each other."""
        done, wide = self.run.epoch, options.max_width >= WIDE
        epoch = Table.grid(padding=(0, 2))
        bar = ProgressBar(total=max(self.epochs, 1), completed=done, width=min(40, max(options.max_width // 3, 5)))
        epoch.add_row("epoch", f"{done:,} of {self.epochs:,}", bar)
        yield epoch
        grid = Table.grid(padding=(0, 2))
        cells = [cell for name, value in self.figures().items() for cell in (f"[dim]{name}[/dim]", value)]
        beside = 4 if wide else 2
        for first in range(0, len(cells), beside):
            grid.add_row(*cells[first : first + beside])
        yield grid
        if self.sight is not None:
            yield f"[dim]against the fixed teams:[/dim] {self.sight.spoken()}"


def rate(value: float) -> str:
    """Returns how many a second, as it is read."""
    return f"{value:,.0f}" if value >= 10 else f"{value:.2f}"


@contextmanager
def shown(view: View) -> Iterator[None]:
    """Shows ``view`` on a terminal as long as what is inside runs; leaves no trace of it. Elsewhere does nothing."""
    if not interactive():
        yield
        return
    with Live(view, console=console(), refresh_per_second=A_SECOND, transient=True):
        yield
