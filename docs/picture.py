"""Draws what a run learnt: python docs/picture.py RUN picture.png."""

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import pandas as pd

TOP = 8


def draw(run: Path, picture: Path) -> None:
    """Draws how likely the selector makes each team over the epochs, beside how strong they truly are."""
    teams = pd.read_csv(run / "team_distribution.csv", dtype={"team": str})
    elo = pd.read_csv(run / "elo.csv", dtype={"team": str}).set_index("team")
    over_time = teams.pivot_table(index="epoch", columns="team", values="probability")
    top = over_time.iloc[-1].nlargest(TOP).index

    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.6), width_ratios=(1.2, 1), layout="constrained")
    shares = [over_time[team] for team in top] + [1 - over_time[top].sum(axis=1)]
    palette = plt.get_cmap("tab10").colors
    colors = [*(palette[k] for k in (0, 1, 2, 3, 4, 5, 6, 9)), "lightgray"]  # without its grey
    left.stackplot(over_time.index, shares, labels=[elo.members.get(t, t) for t in top] + ["other"], colors=colors)
    left.set(xlabel="epoch", ylabel="probability of the team", xlim=(0, over_time.index.max()), ylim=(0, 1))
    figure.legend(loc="outside lower left", fontsize=8, ncols=5, frameon=False)
    left.set_title("What the selector chooses")

    error = [elo.elo - elo.elo_low, elo.elo_high - elo.elo]
    right.errorbar(elo.probability, elo.elo, yerr=error, fmt="o", color="0.6", ecolor="0.85", markersize=4, zorder=1)
    for team, color in zip(top, colors, strict=False):
        if team in elo.index:
            right.plot(elo.probability[team], elo.elo[team], "o", color=color, markersize=8, zorder=3)
    right.set(xlabel="probability after the last epoch", ylabel="Elo", xscale="log")
    right.set_title("And how strong those teams are, with 95 % intervals")
    figure.savefig(picture, dpi=110)


if __name__ == "__main__":
    draw(Path(sys.argv[1]), Path(sys.argv[2]))
