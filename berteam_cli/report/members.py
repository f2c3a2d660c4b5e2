"""Plots of the members: how they behave, how fit they are, and whom the network takes to be alike."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from berteam_cli.errors import InputError, RunError
from berteam_cli.outcomes import Floats, Ints
from berteam_cli.report.drawing import LIGHT, SERIES, Plot, drawn, kept, over_epochs, panels, short
from berteam_cli.report.source import Source

LINES, ON_A_LINE = 60, 150
MARKS = 1500
BIN = 0.125
MARKERS = ("o", "s", "^", "D", "v", "P", "X")


def aggression(source: Source) -> Plot:
    """Returns how many members are how aggressive, in the groups of members.csv."""
    name, title = "aggression", "How aggressive the members are"
    values = behaviour(source)
    if values is None:
        says = "No member's aggression is known: `berteam evaluate RUN` measures it (in games of mctf)."
        return Plot(name, title, says)
    figure, (plot,) = panels(height_in=3.0)
    groups = {
        "defensive (below 1)": values[values < 1],
        "neutral (1)": values[values == 1],
        "aggressive (above 1)": values[values > 1],
    }
    bins = np.arange(0, max(values.max(), 1.0) + 2 * BIN, BIN)  # 1 is the border of two of them
    labels = [f"{label}: {len(group)}" for label, group in groups.items()]
    colors = [SERIES[0], SERIES[2], SERIES[1]]
    plot.hist([*groups.values()], bins.tolist(), stacked=True, color=colors, label=labels, edgecolor=LIGHT["card"])
    plot.axvline(1, color=LIGHT["pale"], linewidth=1, linestyle=":")
    plot.set(xlabel="aggression (below 1 defends, 1 neither, above attacks)", ylabel="members")
    ticks: Any = plot.yaxis.get_major_locator()  # matplotlib's own, which takes this
    ticks.set_params(integer=True)
    plot.legend()
    says = (
        f"{len(values)} members by what a team made only of each one did against the fixed teams. The border at 1 is "
        "a convention; who behaves alike need not play alike."
    )
    counts = ", ".join(f"{len(group)} {label}" for label, group in groups.items())
    return drawn(figure, name, title, says, f"Histogram: {counts}.")


def behaviour(source: Source) -> Floats | None:
    """Returns the members' aggression as last measured, None where it was not."""
    table = source.evaluated("members")
    if table is None and source.agents is not None:
        table = source.agents[source.agents.epoch == source.agents.epoch.max()]
    values = None if table is None else pd.to_numeric(table.aggression, errors="coerce").dropna().to_numpy(float)
    return None if values is None or not len(values) else values


def fitness(source: Source) -> Plot:
    """Returns the fitness of the members over the epochs, with who was replaced."""
    name, title = "fitness", "Fitness of the members"
    table = source.agents
    if table is None:
        return Plot(name, title, "There is no agents.csv: berteam train writes it.")
    table = table[~table.island.isin(source.exploiters)]  # who are not rated: their fitness stays where it began
    wide = table.pivot_table(index="epoch", columns="agent", values="fitness")
    wide = wide.iloc[kept(len(wide), ON_A_LINE)]
    figure, (plot,) = panels()
    some = wide.columns[kept(wide.shape[1], LINES)]
    plot.plot(wide.index, wide[some], color=LIGHT["rest"], linewidth=0.6, zorder=1)
    low, middle, high = np.nanquantile(wide.to_numpy(float), (0.1, 0.5, 0.9), axis=1)
    plot.fill_between(wide.index, low, high, color=SERIES[0], alpha=0.18, linewidth=0, label="10 to 90 % of members")
    plot.plot(wide.index, middle, color=SERIES[0], linewidth=2, label="median")
    replaced = source.table("generations")
    if replaced is not None:
        marks = replaced.iloc[kept(len(replaced), MARKS)]
        plot.plot(
            *(marks.epoch, marks.removed_fitness, "x"),
            **dict[str, Any](color=SERIES[3], markersize=4, alpha=0.7, label=f"replaced ({len(replaced):,})"),
        )
    scores = wide.max().max() <= 1
    over_epochs(plot)
    plot.set(ylabel="fitness (mean score)" if scores else "fitness (Elo points)")
    figure.legend(loc="outside lower left", ncols=3)
    says = (
        f"{len(some)} of {wide.shape[1]} members each as a faint line. Fitness is relative: it says who is fitter "
        "than others of the same epoch, and a level median does not mean that nobody learns."
    )
    alt = f"Median fitness {middle[0]:.4g} at first and {middle[-1]:.4g} at the end, over {len(wide.columns)} members."
    return drawn(figure, name, title, says, alt)


def embeddings(source: Source) -> Plot:
    """Returns the selector's vectors of the members in the plane in which they differ most."""
    name, title = "embeddings", "Whom the network takes to be alike"
    found = vectors(source)
    if isinstance(found, str):
        return Plot(name, title, found)
    members, values = found
    flat, shares = plane(values)
    last = None if source.agents is None else source.agents[source.agents.epoch == source.agents.epoch.max()]
    island = ["members"] * len(flat) if last is None else told(last, "island", members)
    manners = source.evaluated("members")
    manner = [""] * len(flat) if manners is None else told(manners, "group", members)
    both = [f"{home}, {way}" if way else home for home, way in zip(island, manner, strict=True)]
    homes, ways = list(dict.fromkeys(island)), list(dict.fromkeys(manner))
    figure, (plot,) = panels(height_in=4.2)
    for group in dict.fromkeys(both):
        x, y = flat[[name == group for name in both]].T
        first = both.index(group)
        color = SERIES[homes.index(island[first]) % len(SERIES)]
        marker = MARKERS[ways.index(manner[first]) if len(ways) > 1 else homes.index(island[first]) % len(MARKERS)]
        plot.plot(x, y, marker, color=color, markersize=6, label=short(group, 34), markeredgecolor=LIGHT["card"])
    for agent in range(len(flat)) if len(flat) <= LINES else ():
        at = (flat[agent, 0], flat[agent, 1])
        plot.annotate(str(members[agent]), at, (4, 3), textcoords="offset points", fontsize=7, color=LIGHT["pale"])
    plot.set(xlabel=f"first component ({shares[0]:.0%} of variance)", ylabel=f"second ({shares[1]:.0%})")
    figure.legend(loc="outside lower left", ncols=4)
    says = (
        f"The {values.shape[1]} numbers that stand for each member, in the two directions in which they differ most "
        f"({shares.sum():.0%} of the variance). Nearness here is not a proof: distances in the other directions are "
        "not shown; evaluation/embeddings.csv has the cosines in all of them."
    )
    return drawn(figure, name, title, says, f"Map of {len(flat)} members by island.")


def told(table: pd.DataFrame, column: str, members: Ints) -> list[str]:
    """Returns what ``table`` says of each of the ``members`` in ``column``, nothing where it does not."""
    return list(table.drop_duplicates("agent").set_index("agent")[column].reindex(members).fillna("").astype(str))


def vectors(source: Source) -> tuple[Ints, Floats] | str:
    """Returns (K,) the members that are rated and their (K, width) vectors, or why there are none."""
    from berteam_cli.population import rated  # noqa: PLC0415 (torch is not needed for tables)
    from berteam_cli.reading import last_state  # noqa: PLC0415 (as above)
    from berteam_cli.selector.embeddings import Embedding  # noqa: PLC0415 (as above)

    if not (source.folder / "checkpoint").exists():
        return "There is no checkpoint to read the selector from: berteam train writes it."
    try:
        parts, run = last_state(source.folder, trust=source.trust)
    except (InputError, RunError) as error:
        return f"The selector cannot be read: {error}"
    if not isinstance(parts.selector, Embedding):
        return "This selector has no vectors of members; selector=berteam has."
    members = np.flatnonzero(rated(parts.optimizer.islands))
    return (members, parts.selector.embeddings(run.selection)[members]) if len(members) > 2 else "Two are no map."


def plane(values: Floats) -> tuple[Floats, Floats]:
    """Returns (N, 2) the coordinates along the first two principal components, and (2,) their shares of variance."""
    centred = values - values.mean(axis=0)
    left, sizes, right = np.linalg.svd(centred, full_matrices=False)
    sign = np.sign(right[np.arange(2), np.abs(right[:2]).argmax(axis=1)])  # else the library's choice
    return left[:, :2] * sizes[:2] * sign, sizes[:2] ** 2 / max((sizes**2).sum(), 1e-300)
