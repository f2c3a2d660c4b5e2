"""Plots of the members, from tables made up."""

import json

from berteam_cli.evaluation.manners import group
from berteam_cli.report.drawing import styled
from berteam_cli.report.members import aggression
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
