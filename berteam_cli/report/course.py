"""Plots of how a run went: what was learnt, and where the time went."""

from __future__ import annotations

from typing import Any

import numpy as np

from berteam_cli.report.drawing import SERIES, Plot, binned, drawn, over_epochs, panels, pooled, short
from berteam_cli.report.source import Source

LEARNING = {
    "loss": "loss",
    "value_loss": "value loss",
    "entropy": "entropy of the policy (nat)",
    "q_value": "value of actions taken",
}
SELECTOR = {
    "loss": "loss",
    "buffer": "remembered",
    "effective_teams": "effective teams",
    "exploitability": "exploitability",
}
PARTS = {
    "play_s": "playing",
    "learn_s": "members' learning",
    "selector_s": "selector's learning",
    "record_s": "recording",
    "probe_s": "probing",
    "select_s": "choosing teams",
    "renew_s": "replacing",
    "evaluate_s": "looking",
}


def learning(source: Source) -> Plot:
    """Returns what the members' learning reports, by algorithm."""
    name, title = "learning", "How the members learn"
    table = source.table("learning")
    if table is None:
        return Plot(name, title, "There is nothing in learning.csv: nobody learns, or nobody has learnt yet.")
    means = table.groupby(["algorithm", "epoch"])[list(LEARNING)].mean()
    there = [figure for figure in LEARNING if means[figure].notna().any()]
    if not there:
        return Plot(name, title, "There is nothing in learning.csv: nobody has made an update yet.")
    figure, plots = panels(len(there), 1.0 + 1.45 * len(there))
    algorithms = list(means.index.unique("algorithm"))
    for k, algorithm in enumerate(algorithms):
        of = means.loc[algorithm]
        x, y = binned(of.index.to_numpy(), of[there].to_numpy(float))
        for plot, values in zip(plots, y.T, strict=True):
            known = np.isfinite(values)
            if known.any():
                plot.plot(x[known], values[known], color=SERIES[k % len(SERIES)], linewidth=1.3, label=short(algorithm))
    for plot, column in zip(plots, there, strict=True):
        plot.set_title(LEARNING[column])
    over_epochs(plots[-1])
    legend: dict[str, Any] = {}  # not every algorithm is in every panel
    for plot in plots:
        legend |= dict(zip(*plot.get_legend_handles_labels()[::-1], strict=True))
    figure.legend(list(legend.values()), list(legend), loc="outside lower left", ncols=4)
    says = (
        "Means over the members that learnt in an epoch, by algorithm. Losses of different algorithms are different "
        "quantities, and a smaller loss is no stronger player." + pooled(table.epoch.nunique())
    )
    return drawn(figure, name, title, says, f"Curves of {', '.join(there)} for {', '.join(map(str, algorithms))}.")


def selecting(source: Source) -> Plot:
    """Returns what the selector's learning reports."""
    name, title = "selector", "How the selector learns"
    table = source.table("selector")
    there = [] if table is None else [x for x in SELECTOR if table[x].notna().any()]
    if table is None or not there:
        return Plot(name, title, "There is nothing in selector.csv yet: berteam train writes it.")
    figure, plots = panels(len(there), 0.8 + 1.3 * len(there))
    for k, (plot, column) in enumerate(zip(plots, there, strict=True)):
        known = table[table[column].notna()]
        x, y = binned(known.epoch.to_numpy(), known[[column]].to_numpy(float))
        plot.plot(x, y[:, 0], color=SERIES[k], linewidth=1.3, marker="o" if len(x) == 1 else None)
        plot.set_title(SELECTOR[column])
        plot.set_ylim(bottom=0 if (y >= 0).all() and column != "loss" else None)
    over_epochs(plots[-1])
    says = (
        "Effective teams: as spread out as equal chances for so many. Exploitability: what the best answer wins on "
        "average. What the loss is and what is remembered depends on the selector (docs/selectors.md); some remember "
        "nothing." + pooled(max(int(table[x].notna().sum()) for x in there))
    )
    ends = ", ".join(f"{SELECTOR[x]} {table[x].dropna().iloc[-1]:.4g}" for x in there)
    return drawn(figure, name, title, says, f"Curves over the epochs; at the end {ends}.")


def timing(source: Source) -> Plot:
    """Returns the seconds of each part of an epoch, on top of each other."""
    name, title = "timing", "Where the time goes"
    table = source.table("timing")
    if table is None:
        return Plot(name, title, "There is nothing in timing.csv yet: berteam train writes it.")
    parts = {part: said for part, said in PARTS.items() if table[part].any()}
    x, y = binned(table.epoch.to_numpy(), table[list(parts)].fillna(0).to_numpy(float), 200)
    figure, (plot,) = panels()
    if len(x) > 1:
        whole = max(table[list(parts)].sum().sum(), 1e-12)
        labels = [f"{said} ({table[part].sum() / whole:.0%})" for part, said in parts.items()]
        plot.stackplot(x, y.T, labels=labels, colors=SERIES[: len(parts)])
        plot.set_xlim(x[0], x[-1])
        over_epochs(plot)
        figure.legend(loc="outside lower left", ncols=3)
    else:
        plot.bar(list(parts.values()), y[0], color=SERIES[0])
        plot.tick_params(axis="x", rotation=30)
    plot.set_ylabel("seconds an epoch")
    highest = float(y[len(y) > 2 :].sum(axis=1).max())
    plot.set_ylim(0, 1.1 * highest if highest > 0 else None)
    total = table[list(parts)].sum(axis=1)
    says = (
        f"{total.sum():,.0f} s in all, {total.median():.3g} s in the median epoch; the first, in which kernels are "
        "loaded, may be cut off. Seconds depend on the machine and on who else used it; the evaluation at the end is "
        "not among them."
    )
    return drawn(figure, name, title, says, f"Seconds an epoch by part; {total.median():.3g} in the median epoch.")
