import re

import numpy as np
import pytest
from matplotlib.axes import Axes

from berteam_cli.report.drawing import POINTS, SERIES, binned, drawn, kept, panels, short, styled
from berteam_cli.report.members import plane
from berteam_cli.report.page import spoken
from berteam_cli.report.source import Source
from berteam_cli.report.strength import crosstable


def test_few_points_stay_as_they_are():
    x, y = np.array([1, 2, 5]), np.array([[1.0], [np.nan], [3.0]])
    at, means = binned(x, y)
    np.testing.assert_array_equal(at, x)
    np.testing.assert_array_equal(means, y)


def test_many_points_become_means_of_neighbours_that_are_known():
    at, means = binned(np.arange(1, 6), np.array([[1.0, 1], [3, np.nan], [5, np.nan], [7, np.nan], [9, 4]]), most=3)
    np.testing.assert_array_equal(at, [1.5, 3.5, 5])
    np.testing.assert_array_equal(means, [[2, 1], [6, np.nan], [9, 4]])


@pytest.mark.parametrize("count", [1, 7, POINTS, 8001])
def test_the_ends_are_kept(count):
    chosen = kept(count)
    assert len(chosen) == min(count, POINTS)
    assert chosen[0] == 0
    assert chosen[-1] == count - 1
    assert (np.diff(chosen) > 0).all()


def test_principal_components():
    rng = np.random.default_rng(0)
    values = rng.normal(size=(40, 6)) * [5, 3, 1, 1, 1, 1]
    flat, shares = plane(values)
    spread = np.sort(np.linalg.eigvalsh(np.cov(values.T)))[::-1]
    np.testing.assert_allclose(flat.var(axis=0, ddof=1), spread[:2])
    np.testing.assert_allclose(shares, spread[:2] / spread.sum())
    np.testing.assert_allclose(plane(values + 7)[0], flat, atol=1e-9)


def test_who_beats_whom_is_what_the_crosstable_says(tmp_path, monkeypatch):
    """Of three sides, where a pair's wins and draws would not tell."""
    (tmp_path / "crosstable.csv").write_text("team,1,0\n1,,0.8333\n0,0.1667,\n")
    shown, mesh = [], Axes.pcolormesh

    def noted(plot, *cells, **how):
        shown.append(cells[-1])
        return mesh(plot, *cells, **how)

    monkeypatch.setattr(Axes, "pcolormesh", noted)
    with styled():
        assert crosstable(Source(tmp_path, {"status": "done"})).alt == "Heat map of mean scores among 2 teams."
    np.testing.assert_array_equal(shown[0].filled(-1), [[-1, 0.8333], [0.1667, -1]])


def test_a_drawing_follows_the_page_and_shares_no_identifier():
    with styled():
        svgs = []
        for name in ("one", "two"):
            figure, (plot,) = panels()
            plot.plot([0, 1], [0, 1], "o-", color=SERIES[0], label="$x_1$ </svg>")
            plot.legend()
            svgs.append(drawn(figure, name, "", "", "").svg)
    first, second = (set(re.findall(r' id="([^"]*)"', svg)) for svg in svgs)
    assert first
    assert first.isdisjoint(second)
    for svg, ids in zip(svgs, (first, second), strict=True):
        assert set(re.findall(r'(?:url\(#|href="#)([^)"]+)', svg)) == ids
        assert "var(--s0)" in svg
        assert "var(--ink)" in svg
        assert SERIES[0] not in svg
        assert "$x_1$ &lt;/svg&gt;" in svg
        assert "http" not in svg


def test_words():
    assert short("a\n b", 9) == "a b"
    assert short("abcdef", 4) == "abc…"
    assert spoken("say `a <b>` & c") == "say <code>a &lt;b&gt;</code> &amp; c"
