"""Plots of how a run fared against the teams of fixed policies while it trained."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from berteam_cli.evaluation.sight import ALL, BEST_MEMBER, BEST_TEAM, CHOICE
from berteam_cli.outcomes import Ints
from berteam_cli.records import WATCHED_TABLE
from berteam_cli.report.drawing import LIGHT, SERIES, Plot, drawn, kept, over_epochs, panels, short
from berteam_cli.report.source import Source

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CALLED = {CHOICE: "the selector's choice", BEST_TEAM: "the best team", BEST_MEMBER: "the fittest member, in all places"}
RESULTS = {"wins": "won", "draws": "drawn", "losses": "lost"}


def elos(source: Source) -> Plot | None:
    """Returns the Elos against the epochs with their intervals, None where nobody looked at the run."""
    table = looks(source)
    if table is None:
        return None
    table = table[table.opponent == ALL]
    figure, (plot,) = panels()
    ends = []
    for k, (who, called) in enumerate(CALLED.items()):
        of = table[table.who == who].sort_values("epoch")
        if of.empty:
            continue
        of = of.iloc[kept(len(of))]
        plot.fill_between(of.epoch, of.elo_low, of.elo_high, color=SERIES[k], alpha=0.16, linewidth=0)
        plot.plot(of.epoch, of.elo, color=SERIES[k], linewidth=1.6, marker="o", markersize=3, label=called)
        ends.append(f"{called} {of.elo.iloc[0]:.0f} at first and {of.elo.iloc[-1]:.0f} at the end")
    plot.set_ylabel("Elo against the fixed teams")
    over_epochs(plot)
    figure.legend(loc="outside lower left", ncols=2)
    says = (
        "Elos from a few games after some epochs, with 95 % intervals: the mean of the teams that the selector drew, "
        "the fittest member in all places of a team, and the best of all of these, which one half of the games chose "
        "and the other half rates. Teams and games are others each time, so neighbouring points scatter."
    )
    return drawn(figure, "watched_elo", "Against fixed teams, while it trained", says, f"Elos: {'; '.join(ends)}.")


def looks(source: Source) -> pd.DataFrame | None:
    """Returns the table of all looks that are whole, None where there is none."""
    table = source.table(WATCHED_TABLE)
    if table is None:
        return None
    whole = table.epoch[(table.who == BEST_TEAM) & (table.opponent == ALL)]  # its row is a look's last
    return table[table.epoch.isin(whole)] if len(whole) else None


def results(source: Source) -> Plot | None:
    """Returns the shares of games won, drawn and lost against the epochs, None where nobody looked at the run."""
    table = looks(source)
    if table is None:
        return None
    table = table[table.who == CHOICE]
    opponents = [ALL, *some(table[table.opponent != ALL])]
    figure, plots = panels(len(opponents), 1.1 + 1.15 * len(opponents))
    for plot, opponent in zip(plots, opponents, strict=True):
        shares_of(plot, table[table.opponent == opponent].sort_values("epoch"))
        plot.set_title("against all of them" if opponent == ALL else f"against {short(opponent, 60)}")
    over_epochs(plots[-1])
    figure.legend(*plots[0].get_legend_handles_labels(), loc="outside lower left", ncols=3)
    says = (
        "Shares of the games of the selector's choice, against all teams of fixed policies and against a few: the two "
        "that it did worst against over all looks, the middle one and the one that it did best against. A point of one "
        "opponent rests on few games."
    )
    last = table[(table.opponent == ALL) & (table.epoch == table.epoch.max())]
    parts = ", ".join(f"{int(last[x].sum())} {said}" for x, said in RESULTS.items())
    title = "Won, drawn and lost, while it trained"
    return drawn(figure, "watched_results", title, says, f"Shares over the epochs; at the end {parts} against all.")


def shares_of(plot: Axes, of: pd.DataFrame) -> None:
    """Draws the shares won, drawn and lost on top of each other; with one look, as a bar."""
    of = of.iloc[kept(len(of))]
    shares = of[list(RESULTS)].to_numpy(float).T / of.games.to_numpy(float)
    colors = [SERIES[2], LIGHT["rest"], SERIES[3]]
    if len(of) > 1:
        plot.stackplot(of.epoch, shares, labels=RESULTS.values(), colors=colors)
        plot.set_xlim(of.epoch.iloc[0], of.epoch.iloc[-1])
    else:
        foot = 0.0
        for (share,), said, color in zip(shares, RESULTS.values(), colors, strict=True):
            plot.bar(of.epoch, share, bottom=foot, label=said, color=color, width=0.4)
            foot += float(share)
    plot.set_ylim(0, 1)
    plot.grid(visible=False)


def some(table: pd.DataFrame) -> list[str]:
    """Returns at most four opponents: two with the least mean score against them, the middle one and the last."""
    summed = table.groupby("opponent", sort=False)[["games", "wins", "draws"]].sum()
    scores = (summed.wins + 0.5 * summed.draws) / summed.games
    order = list(scores.sort_values(kind="stable").index)
    return [order[k] for k in at_places(len(order))]


def at_places(count: int) -> Ints:
    """Returns which of ``count`` in order are shown: the first two, the middle one and the last, each once."""
    if not count:
        return np.zeros(0, dtype=np.int64)
    return np.unique([0, min(1, count - 1), count // 2, count - 1])
