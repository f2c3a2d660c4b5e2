"""Plots of how strong teams are."""

from __future__ import annotations

from typing import Any

import numpy as np

from berteam_cli.report.drawing import SERIES, Plot, drawn, kept, panels, short
from berteam_cli.report.source import Source

STRONGEST = 20
CELLS = 28
DOTS, FEW = 2000, 100
RATES = "`berteam evaluate RUN` rates all teams, and so does the end of a training with evaluation.games above 0."


def elos(source: Source) -> Plot:
    """Returns the Elos of the strongest teams with their intervals."""
    name, title = "elo", "The strongest teams"
    if source.elo is None:
        return Plot(name, title, f"No team was rated yet. {RATES}")
    best = source.elo.head(STRONGEST)
    figure, (plot,) = panels(height_in=1.1 + 0.19 * len(best))
    places = np.arange(len(best))
    reach = np.abs(np.stack([best.elo - best.elo_low, best.elo_high - best.elo]))
    plot.errorbar(best.elo, places, xerr=reach, fmt="o", color=SERIES[0], ecolor=SERIES[0], markersize=4, linewidth=1.2)
    plot.set_yticks(places, [short(f"{x.team}  {x.members}", 44) for x in best.itertuples()])
    plot.set(xlabel="Elo (400 points are odds of ten to one)", ylim=(len(best) - 0.4, -0.6))
    plot.grid(visible=False, axis="y")
    says = (
        f"{len(best)} of {len(source.elo):,} rated teams with 95 % intervals. Teams whose intervals overlap widely may "
        "be equally strong, and the best of many is partly lucky: rate it again before quoting its Elo."
    )
    first = best.iloc[0]
    alt = f"Elos from {best.elo.min():.0f} to {best.elo.max():.0f}; first {first.team} with {first.elo:.0f}."
    return drawn(figure, name, title, says, alt)


def against_probability(source: Source) -> Plot:
    """Returns the Elos of teams against how probable the selector makes them."""
    name, title = "elo_probability", "Does it choose the strong ones?"
    table = source.elo
    if table is not None:
        table = table[(table.probability > 0) & np.isfinite(table.elo)]
    if table is None or len(table) < 3 or table.elo.nunique() < 2:
        return Plot(name, title, f"Fewer than three rated teams have a probability. {RATES}")
    elo, chance = table.elo.to_numpy(float), np.log10(table.probability.to_numpy(float))
    slope, foot = np.polyfit(elo, chance, 1)
    explained = np.corrcoef(elo, chance)[0, 1] ** 2 if chance.std() > 0 else 0.0
    dots = kept(len(elo), DOTS)
    figure, (plot,) = panels()
    look: dict[str, Any] = {"alpha": 0.85, "markersize": 5} if len(dots) < FEW else {"alpha": 0.5, "markersize": 3.5}
    plot.plot(elo[dots], 10 ** chance[dots], "o", color=SERIES[0], markeredgewidth=0, **look)
    ends = np.array([elo.min(), elo.max()])
    plot.plot(ends, 10 ** (foot + slope * ends), color=SERIES[3], linewidth=1.8)
    plot.set(xlabel="Elo", ylabel="probability", yscale="log")
    plot.yaxis.set_major_formatter("{x:g}")
    plot.yaxis.set_minor_formatter("")
    fit = f"log10 P rises by {400 * slope:.2f} in 400 Elo; R² = {explained:.2f}"
    plot.set_title(fit, color=SERIES[3])
    says = (
        f"Each of {len(table):,} rated teams, and the line of least squares. A selector that chose by odds of winning "
        "would rise by 1 in 400 Elo. The noise of the Elos flattens the line and lowers R²; teams rated because they "
        "are probable are no random sample."
    )
    regression = source.evaluated("regression")
    if regression is not None:
        of = regression.set_index("quantity")
        slope, explains = (of.loc[x, ["value", "low", "high"]].astype(float) for x in ("slope", "r_squared"))
        says += (
            f" Of the probability itself, over all rated teams: {100 * slope.value:.2g} in 100 Elo "
            f"({100 * slope.low:.2g} to {100 * slope.high:.2g}), R² {explains.value:.2f} "
            f"({explains.low:.2f} to {explains.high:.2f})."
        )
    return drawn(figure, name, title, says, f"Scatter of {len(table)} teams: {fit}.")


def crosstable(source: Source) -> Plot:
    """Returns the mean scores of teams against each other, as crosstable.csv has them."""
    name, title = "crosstable", "Who beats whom"
    table = source.table("crosstable")
    if table is None:
        says = "The teams have not all played each other: `berteam tournament run=RUN top=20` has its best ones do so."
        return Plot(name, title, f"{says} Report the tournament's folder then.")
    scores = table.set_index("team")
    order = list(scores.index[:CELLS])
    cells = scores.reindex(index=order, columns=order).to_numpy(float)
    figure, (plot,) = panels(height_in=2.0 + 0.14 * len(order))
    drawn_cells = plot.pcolormesh(np.ma.masked_invalid(cells), cmap="PuOr", vmin=0, vmax=1, rasterized=False)
    ticks = np.arange(len(order)) + 0.5
    plot.set_xticks(ticks, [short(x, 14) for x in order], rotation=90)
    plot.set_yticks(ticks, [short(x, 14) for x in order])
    plot.set(xlabel="opponent", ylabel="team, the strongest on top", ylim=(len(order), 0), aspect="equal")
    plot.grid(visible=False)
    figure.colorbar(drawn_cells, ax=plot, label="mean score (1 win, 0 loss)", shrink=0.8)
    says = (
        "Mean score of the team in the row against the one in the column, over all sides. Games of players without "
        "chance are copies of each other, so a full cell may rest on few different games."
    )
    return drawn(figure, name, title, says, f"Heat map of mean scores among {len(order)} teams.")
