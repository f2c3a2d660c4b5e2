"""A folder like that of a long training run, made in a moment: its tables hold chance, in the right shapes."""

import json

import numpy as np
import pandas as pd

from berteam_cli.records import COLUMNS

MEMBERS = 50


def long_run(folder, epochs, every=10, status="done", name="learner"):
    """Writes a run of 50 members, 1,275 teams of two, recorded each ``every`` epochs."""
    folder.mkdir()
    rng = np.random.default_rng(3)
    first, second = np.triu_indices(MEMBERS)
    teams = np.array([f"{a}-{b}" for a, b in zip(first, second, strict=True)])
    records = np.arange(0, epochs + 1, every)
    drift = np.cumsum(rng.normal(0, 0.1, (len(records), len(teams))), axis=0)
    chances = np.exp(drift) / np.exp(drift).sum(axis=1, keepdims=True)
    shares = np.stack([np.bincount(first, row, MEMBERS) for row in chances])
    fitness = 1000 + np.cumsum(rng.normal(0, 5, (len(records), MEMBERS)), axis=0)
    elo = 1000 + 60 * drift[-1] + rng.normal(0, 30, len(teams))
    order = np.argsort(-elo)
    done = np.arange(1, epochs + 1)

    def table(called, /, **columns):
        frame = pd.DataFrame(columns)
        frame.reindex(columns=list(COLUMNS[called])).to_csv(folder / f"{called}.csv", index=False)

    def each(values, count):
        return np.repeat(values, count)

    known = {"epoch": each(records, len(teams)), "team": np.tile(teams, len(records))}
    table("team_distribution", **known, probability=chances.ravel(), error=0.0)
    of_members = {"epoch": each(records, MEMBERS), "agent": np.tile(np.arange(MEMBERS), len(records))}
    table("captain_distribution", **of_members, probability=shares.ravel())
    islands = {"name": name, "island": np.where(of_members["agent"] < 25, "ppo", "dqn"), "algorithm": "ppo"}
    manner = np.tile(rng.gamma(3, 0.35, MEMBERS), len(records))
    table("agents", **of_members, **islands, fitness=fitness.ravel(), aggression=manner)
    halves = np.stack([shares[:, :25].sum(axis=1), shares[:, 25:].sum(axis=1)], axis=1)
    table(
        "island_distribution",
        **{"epoch": each(records, 2), "island": np.tile(["ppo", "dqn"], len(records)), "probability": halves.ravel()},
    )
    table("selector", epoch=done, loss=3 + rng.normal(0, 0.1, epochs), buffer=np.minimum(done * 20, 10000))
    spent = {part: rng.gamma(2, 0.05, epochs) for part in COLUMNS["timing"] if part.endswith("_s")}
    table("timing", epoch=done, env_steps=10500, **spent)
    learnt = {"epoch": each(done, MEMBERS), "agent": np.tile(np.arange(MEMBERS), epochs), "algorithm": "ppo"}
    size = epochs * MEMBERS
    table("learning", **learnt, loss=rng.normal(0, 1, size), value_loss=rng.gamma(1, 1, size), entropy=2.0)
    table("generations", epoch=done, island="ppo", removed=0, parent=1, removed_fitness=900 + rng.normal(0, 50, epochs))
    members = [f"{name} + {name}"] * len(teams)
    rated = {"team": teams[order], "members": members, "elo": elo[order], "probability": chances[-1][order]}
    table("elo", **rated, elo_low=elo[order] - 60, elo_high=elo[order] + 60, rank=np.arange(1, len(teams) + 1))
    best = {"best_team": teams[order[0]], "best_elo": elo.max()}
    table(
        "summary",
        expected_elo=[1040.0],
        expected_elo_low=1000.0,
        expected_elo_high=1080.0,
        games=8,
        wall_s=99.0,
        **best,
    )
    facts = {"status": status, "started": "2026-01-31T12:00:00+00:00", "command": ["berteam", "train"], "seed": 0}
    (folder / "manifest.json").write_text(json.dumps(facts))
    (folder / "config.yaml").write_text("epochs: 8000\nselector:\n  name: berteam\n")
