"""The map of what an archive keeps, from tables made up."""

import numpy as np
import pytest

from berteam_cli.records import COLUMNS
from berteam_cli.report.archive import borders, cells
from berteam_cli.report.drawing import styled
from berteam_cli.report.source import Source


def plotted(folder, rows):
    lines = [",".join(COLUMNS["archive_cells"]), *(",".join(map(str, row)) for row in rows)]
    (folder / "archive_cells.csv").write_text("\n".join(lines) + "\n")
    with styled():
        return cells(Source(folder, {"status": "done"}))


def test_a_run_without_an_archive_has_no_map(tmp_path):
    assert cells(Source(tmp_path, {"status": "done"})) is None


GRID = [(2, "a", k, x, "", y, "", "") for k, (x, y) in enumerate([(0.5, 0.1), (0.5, 0.3), (1.5, 0.1), (1.5, 0.3)])]
AROUND = [(2, "a", k, x, "", y, "", "") for k, (x, y) in enumerate([(0.5, 0.1), (0.7, 0.3), (1.5, 0.2)])]
STRIP = [(2, "a", k, "", x, "", "", "") for k, x in enumerate([0.7, 0.1, 0.2])]


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        (GRID, "Map of 4 cells by aggression and spread, 2 of them with a member."),
        (AROUND, "Map of 3 cells by aggression and spread, 2 of them with a member."),
        (STRIP, "Map of 3 cells by advance, 2 of them with a member."),
    ],
)
def test_cells_of_any_kind_are_drawn(rows, said, tmp_path):
    earlier = [(0, *row[1:]) for row in rows]
    full = [(*row[:-2], 7, 1000 + k) if k < 2 else row for k, row in enumerate(rows)]
    other_island = [(*row[:1], "b", *row[2:]) for row in rows]
    plot = plotted(tmp_path, [*earlier, *full, *other_island])
    assert plot.alt == said
    assert plot.png
    assert "<svg" in plot.svg


def test_an_empty_archive_is_told_in_words(tmp_path):
    plot = plotted(tmp_path, GRID)
    assert not plot.svg
    assert "No member was measured" in plot.says


def test_borders_are_half_the_way():
    np.testing.assert_allclose(borders(np.array([1.0, 3.0, 4.0])), [0, 2, 3.5, 4.5])
    np.testing.assert_allclose(borders(np.array([2.0])), [1.5, 2.5])
