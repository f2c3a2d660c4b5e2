"""The plot of what MAP-Elites keeps: the fittest member of each cell of behaviours."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from berteam_cli.outcomes import BEHAVIOURS, Floats
from berteam_cli.report.drawing import LIGHT, Plot, drawn, panels
from berteam_cli.report.source import Source

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOURS = "viridis"


def cells(source: Source) -> Plot | None:
    """Returns the cells after the last record, coloured by the fittest in them; None for a run without an archive."""
    table = source.table("archive_cells")
    if table is None:
        return None
    name, title = "archive", "The fittest of each behaviour"
    last = table[table.epoch == table.epoch.max()]
    if last.fitness.isna().all():
        return Plot(name, title, "No member was measured yet: MAP-Elites begins when one is older than protect_new.")
    axes = [name for name in BEHAVIOURS if last[name].notna().any()][:2]
    best = last.groupby(axes, as_index=False).fitness.max()  # over islands, and over a third behaviour
    figure, (plot,) = panels(height_in=1.6 if len(axes) == 1 else 3.7)
    if len(axes) == 1:
        drew = strip(plot, best[axes[0]].to_numpy(float), best.fitness.to_numpy(float))
        plot.set(xlabel=axes[0], yticks=[])
    else:
        drew = tiles(plot, best, axes)
        plot.set(xlabel=axes[0], ylabel=axes[1])
    plot.grid(visible=False)
    figure.colorbar(drew, ax=plot, label="fitness of the fittest")
    known = int(best.fitness.notna().sum())
    says = (
        f"Each cell of behaviours after epoch {last.epoch.iloc[0]}, coloured by the fitness of the fittest member in "
        "it over all islands; cells without a member are blank. Fitness is relative to the population of that epoch."
    )
    if last[list(BEHAVIOURS)].notna().any().sum() > 2:
        says += " A third behaviour is left out: of its cells the fittest is shown."
    alt = f"Map of {len(best)} cells by {' and '.join(axes)}, {known} of them with a member."
    return drawn(figure, name, title, says, alt)


def strip(plot: Axes, centres: Floats, fitness: Floats) -> Any:
    """Draws cells of one behaviour side by side, each as far as half the way to its neighbours."""
    return plot.pcolormesh(borders(centres), [0.0, 1.0], np.ma.masked_invalid(fitness[np.newaxis]), cmap=COLOURS)


def tiles(plot: Axes, best: pd.DataFrame, axes: list[str]) -> Any:
    """Draws the cells of a grid as tiles, those around other centres as dots at the centres."""
    wide = best.pivot_table(index=axes[1], columns=axes[0], values="fitness", dropna=False)
    if wide.size == len(best):
        x, y = borders(wide.columns.to_numpy(float)), borders(wide.index.to_numpy(float))
        return plot.pcolormesh(x, y, np.ma.masked_invalid(wide.to_numpy(float)), cmap=COLOURS)
    empty, full = best[best.fitness.isna()], best[best.fitness.notna()]
    plot.plot(empty[axes[0]], empty[axes[1]], "o", color=LIGHT["rest"], markersize=3, markerfacecolor="none")
    return plot.scatter(full[axes[0]], full[axes[1]], c=full.fitness, cmap=COLOURS, s=70)


def borders(centres: Floats) -> Floats:
    """Returns (K + 1,) the ends of cells around (K,) ascending centres."""
    if len(centres) == 1:
        return centres[0] + np.array([-0.5, 0.5])
    middle = (centres[1:] + centres[:-1]) / 2
    return np.concatenate([[2 * centres[0] - middle[0]], middle, [2 * centres[-1] - middle[-1]]])
