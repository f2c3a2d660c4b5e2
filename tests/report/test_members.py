"""Plots of the members, from tables made up."""

import json

from berteam_cli.evaluation.manners import group
from berteam_cli.records import COLUMNS
from berteam_cli.report.drawing import styled
from berteam_cli.report.members import aggression, fitness
from berteam_cli.report.source import Source


def test_who_does_neither_is_neutral_in_the_histogram_as_in_the_table(tmp_path):
    measured = [0.0, 0.99, 1.0, 1.0, 1.0, 1.01]
    assert [group(x) for x in measured] == ["defensive"] * 2 + ["neutral"] * 3 + ["aggressive"]
    evaluation = tmp_path / "evaluation"
    evaluation.mkdir()
    rows = "".join(f"{agent},{x}\n" for agent, x in enumerate(measured))
    (evaluation / "members.csv").write_text("agent,aggression\n" + rows)
    (evaluation / "manifest.json").write_text(json.dumps({"status": "done", "epoch": 7}))
    with styled():
        plot = aggression(Source(tmp_path, {"status": "done"}))
    assert plot.alt == "Histogram: 2 defensive (below 1), 3 neutral (1), 1 aggressive (above 1)."
    assert "neutral (1): 3" in plot.svg


def test_who_is_not_rated_is_not_among_the_fit(tmp_path):
    """Exploiters keep the fitness that they began with, and the median would be theirs."""
    (tmp_path / "config.yaml").write_text("opponents: {exploiters: [spies]}\n")
    lines = [",".join(COLUMNS["agents"])]
    for epoch in (0, 5):
        for agent in range(9):
            island, fit = ("spies", 1000) if agent > 2 else ("main", 1000 + 10 * epoch)
            told = {"epoch": epoch, "agent": agent, "island": island, "fitness": fit}
            lines.append(",".join(str(told.get(column, "")) for column in COLUMNS["agents"]))
    (tmp_path / "agents.csv").write_text("\n".join(lines) + "\n")
    with styled():
        plot = fitness(Source(tmp_path, {"status": "done"}))
    assert plot.alt == "Median fitness 1000 at first and 1050 at the end, over 3 members."
