"""Prints how whole runs of the paper's setting went, as tables of Markdown: python docs/results/whole.py [RUN ...].

With runs, their rows in the tables beside this file (paper_whole.csv, _looks.csv and _games.csv) are written first: a
run takes the place of the one of its variant and seed. A variant is what a run was called with, but for its seed; the
columns of each table begin with these two.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pandas as pd
from curves import of_choice
from tables import markdown, spoken

from berteam_cli.folder import read_manifest

HERE = Path(__file__).parent
SPAN = 500  # epochs that a column of the courses holds
NAMES = {"berteam": "BERTeam", "mcaa": "MCAA", "coevolution": "coevolution", "mapelites": "MAP-Elites"}
PAPER = {  # its expected Elos after the whole run
    "experiment=paper_comparison selector=berteam optimizer=coevolution": "919",
    "experiment=paper_comparison selector=mcaa optimizer=coevolution": "817",
    "experiment=paper_comparison selector=berteam optimizer=mapelites": "883",
    "experiment=paper_comparison selector=mcaa optimizer=mapelites": "809",
}
TABLES = {"runs": "paper_whole.csv", "looks": "paper_whole_looks.csv", "games": "paper_whole_games.csv"}


def called(run: Path) -> tuple[str, int]:
    """Returns the variant of a run and its seed."""
    manifest = read_manifest(run)
    said = dict(word.split("=", 1) for word in manifest["command"][1:] if "=" in word)
    words = {"experiment": said["experiment"], "selector": "berteam", "optimizer": "coevolution"} | said
    kept = [key for key in words if key in ("experiment", "selector", "optimizer") or key.startswith("optimizer.")]
    return " ".join(f"{key}={words[key]}" for key in kept), int(manifest["seed"])


def ended(run: Path) -> pd.DataFrame:
    """Returns what a run came to: its summary, its best team's interval, the games of those rated, who was replaced."""
    summary, elo, clones = (pd.read_csv(run / f"{table}.csv") for table in ("summary", "elo", "generations"))
    return summary.assign(
        best_elo_low=elo.elo_low[0],
        best_elo_high=elo.elo_high[0],
        **{f"rated_{x}": elo[x].sum() for x in ("games", "wins", "draws", "losses")},
        replaced=len(clones),
        places_replaced=clones.removed.nunique(),
        removed_fitter=(clones.removed_fitness > clones.parent_fitness).sum(),
    )


def spans(epochs: pd.Series | pd.Index) -> pd.Series:
    """Returns for each epoch from 1 on the last one of its column."""
    return (-(-epochs // SPAN) * SPAN).rename("to_epoch")


def own_games(run: Path) -> pd.DataFrame:
    """Returns what happened in the training's own games, a row for each span."""
    games = pd.read_csv(run / "games.csv")
    sums = {x: games[f"blue_{x}"] + games[f"red_{x}"] for x in ("captures", "grabs", "tags")}
    happened = pd.DataFrame({"games": 1, "decided": games.blue_score != 0.5, **sums})
    return happened.groupby(spans(games.epoch)).sum().astype(int).reset_index()


def merged(table: pd.DataFrame, rows: pd.DataFrame) -> pd.DataFrame:
    """Returns a table with the rows of one run; variants stand in the order in which they came, seeds by size."""
    variant, seed = rows[["variant", "seed"]].iloc[0]
    kept = table[(table.variant != variant) | (table.seed != seed)]
    order = list(dict.fromkeys([*table.variant, variant]))
    ranked = {"variant": order.index, "seed": int}
    return pd.concat([kept, rows]).sort_values(list(ranked), key=lambda column: column.map(ranked[column.name]))


def gather(run: Path) -> None:
    """Writes a run's rows into the tables beside this file."""
    looks = pd.read_csv(run / "evaluation.csv")
    of_run = {"runs": ended(run), "looks": looks[looks.opponent == "all"], "games": own_games(run)}
    variant, seed = called(run)
    for name, rows in of_run.items():
        rows.insert(0, "variant", variant)
        rows.insert(1, "seed", seed)
        merged(pd.read_csv(HERE / TABLES[name]), rows).to_csv(HERE / TABLES[name], index=False)


def named(variant: str) -> str:
    """Returns what a variant is called on the page."""
    said = dict(word.split("=", 1) for word in variant.split())
    return f"{NAMES[said['selector']]}, " + (
        "nobody cloned" if said.get("optimizer.replacements") == "0" else NAMES[said["optimizer"]]
    )


def ends(runs: pd.DataFrame, games: pd.DataFrame) -> pd.DataFrame:
    """Returns the table of what each variant came to, its seeds side by side."""
    rows = []
    for variant, of_variant in runs.groupby("variant", sort=False):
        last = games[(games.variant == variant) & (games.to_epoch == games.to_epoch.max())].set_index("seed")
        bounds = of_variant[["expected_elo", "expected_elo_low", "expected_elo_high"]].to_numpy()
        elos = [f"{elo:.0f} [{low:.0f}, {high:.0f}]" for elo, low, high in bounds]
        rated = of_variant[["rated_wins", "rated_draws", "rated_losses"]].sum()
        rows.append(
            {
                "selector, optimizer": named(variant),
                "the paper": PAPER.get(variant, ""),
                "expected Elo, seed by seed": "; ".join(elos),
                "mean": spoken(of_variant.expected_elo.to_numpy()) if len(elos) > 1 else "",
                "games of the teams rated: won / drawn / lost": " / ".join(f"{x:,}" for x in rated),
                "own games decided in the last 500 epochs": ", ".join(f"{x:.3f}" for x in last.decided / last.games),
            }
        )
    return pd.DataFrame(rows)


def since(of_run: pd.DataFrame) -> Any:
    """Returns the looks of a run at its choice after the first, by the spans in which they fall."""
    choice = of_choice(of_run).loc[1:]
    return choice.groupby(spans(choice.index))


def courses(looks: pd.DataFrame, games: pd.DataFrame) -> pd.DataFrame:
    """Returns the table of how each run went: mean Elo of its looks, share of their games won, of own games decided."""
    rows = []
    for (variant, seed), of_run in looks.groupby(["variant", "seed"], sort=False):
        looked = since(of_run)
        own = games[(games.variant == variant) & (games.seed == seed)].set_index("to_epoch")
        shares = zip(looked.elo.mean(), looked.wins.sum() / looked.games.sum(), own.decided / own.games, strict=True)
        cells = [f"{elo:.0f} / {won:.2f} / {decided:.3f}" for elo, won, decided in shares]
        columns = [f"to {epoch:,}" for epoch in own.index]
        rows.append({"": f"{named(variant)}, {seed}"} | dict(zip(columns, cells, strict=True)))
    return pd.DataFrame(rows)


def coevolution(looks: pd.DataFrame, games: pd.DataFrame) -> pd.DataFrame:
    """Returns the table of how the runs of one variant went, a row for each span, its seeds side by side."""
    rows = []
    for seed, of_run in looks.groupby("seed"):
        looked = since(of_run)
        own = games[games.seed == seed].set_index("to_epoch")
        cells = {
            "expected Elo of the choice": looked.elo.mean().map("{:.0f}".format),
            "won": looked.wins.sum().map("{:,}".format),
            "lost": looked.losses.sum().map("{:,}".format),
            "own games decided": (own.decided / own.games).map("{:.4f}".format),
            "grabs in an own game": (own.grabs / own.games).map("{:.3f}".format),
        }
        rows.append(pd.DataFrame(cells))
    joined = pd.concat(rows).groupby(level=0).agg("; ".join)
    joined.insert(0, "to epoch", [f"{epoch:,}" for epoch in joined.index])
    return joined


def shown(*tables: pd.DataFrame) -> str:
    """Returns the page's tables; ``tables`` are those of runs, looks and games."""
    _, *of_coevolution = (table[table.variant.str.contains("paper_coevolution")] for table in tables)
    runs, looks, games = (table[table.variant.str.contains("paper_comparison")] for table in tables)
    found = coevolution(*of_coevolution), ends(runs, games), courses(looks, games)
    return "\n\n".join(map(markdown, found))


if __name__ == "__main__":
    for name in sys.argv[1:]:
        gather(Path(name))
    print(shown(*(pd.read_csv(HERE / file) for file in TABLES.values())))
