"""Plots of what the selector would choose."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from berteam_cli.report.drawing import LIGHT, SERIES, Plot, drawn, kept, over_epochs, panels, short
from berteam_cli.report.source import Source

TOP = 10


def teams(source: Source) -> Plot:
    """Returns the distribution over teams against the epochs."""
    name, title = "teams", "Which teams the selector chooses"
    table = source.table("team_distribution")
    if table is None:
        return Plot(name, title, f"There is no team_distribution.csv: {trains(source)}")
    says = (
        "Probability of each unordered team, without noise for new members and rules for captains; the ten most "
        "probable at the end are told apart. What is likely is not what is strong: compare with the Elos."
    )
    names = {team: team_label(source, team) for team in table.team.unique()} if source.called else {}
    return stacked(table, "team", names, name, title, says, "probability of the team")


def captains(source: Source) -> Plot:
    """Returns the distribution over first members against the epochs."""
    name, title = "captains", "Whom it chooses first"
    table = source.table("captain_distribution")
    if table is None:
        return Plot(name, title, f"There is no captain_distribution.csv: {trains(source)}")
    says = (
        "Probability of the first member that the selector itself would choose for a team. It is a captain only "
        "under selector.captain=berteam, and being first says nothing of who is strong."
    )
    names = {agent: short(f"{agent} {source.called.get(agent, '')}") for agent in table.agent.unique()}
    return stacked(table, "agent", names, name, title, says, "probability of the member")


def islands(source: Source) -> Plot | None:
    """Returns the distribution over islands against the epochs, None where there is one island."""
    table = source.table("island_distribution")
    if table is None or table.island.nunique() < 2:
        return None
    says = "The same first choices, summed over the members of each island. Larger islands begin with larger shares."
    return stacked(table, "island", {}, "islands", "From which islands", says, "probability of the island")


def trains(source: Source) -> str:
    """Returns which command makes the tables that a training run has."""
    return "berteam train writes it" + ("." if source.elo is None else "; this folder may be a tournament's.")


def team_label(source: Source, team: str) -> str:
    """Returns a team by index and by name."""
    members = [source.called.get(int(m)) for m in str(team).split("-") if m.isdecimal()]
    return short(f"{team} {' + '.join(map(str, members))}" if members and all(members) else str(team), 34)


def stacked(table: pd.DataFrame, key: str, names: dict[Any, str], name: str, title: str, says: str, axis: str) -> Plot:
    """Returns shares over the epochs as areas on top of each other, the largest at the end lowest."""
    epochs = np.sort(table.epoch.unique())
    epochs = epochs[kept(len(epochs))]
    last = table[table.epoch == table.epoch.max()]
    top = list(last[last[key] != "other"].nlargest(TOP, "probability")[key])
    told = table[table.epoch.isin(epochs) & table[key].isin(top)]
    shares = told.pivot_table(index="epoch", columns=key, values="probability").reindex(index=epochs, columns=top)
    heights = [shares[x].fillna(0).to_numpy() for x in top]
    labels, colors = [short(names.get(x, x), 34) for x in top], list(SERIES[: len(top)])
    if table[key].nunique() > len(top):
        heights.append(np.clip(1 - np.sum(heights, axis=0), 0, 1))
        labels.append("all others")
        colors.append(LIGHT["rest"])
    figure, (plot,) = panels(height_in=4.2 if len(labels) > 4 else 3.7)
    if len(epochs) > 1:
        plot.stackplot(epochs, heights, labels=labels, colors=colors, linewidth=0.4, edgecolor=LIGHT["card"])
        plot.set_xlim(epochs[0], epochs[-1])
        over_epochs(plot)
    else:
        foot = 0.0
        for height, label, color in zip(heights, labels, colors, strict=True):
            plot.bar([str(epochs[0])], height, bottom=foot, label=label, color=color, width=0.4)
            foot += float(height[0])
    plot.set(ylabel=axis, ylim=(0, 1))
    plot.grid(visible=False)
    figure.legend(loc="outside lower left", ncols=2 if max(map(len, labels)) > 16 else 4)
    likeliest = f"{labels[0]} with {heights[0][-1]:.0%}" if labels else "nobody"
    return drawn(
        figure, name, title, says, f"{axis}, stacked over {len(epochs)} records; at the end first {likeliest}."
    )
