"""Runs as one page."""

import json
import re
import shutil
import sys

import pytest

from berteam_cli import cli
from berteam_cli.command.evaluate import Look
from tests.browser import needs_chromium, opened
from tests.command.conftest import SMALL_BERTEAM, TINY
from tests.long_run import long_run

EVIL = "</script><script>document.body.dataset.evil=1</script>$x_1$<!--BODY-->"
DARK_CARD, LIGHT_CARD = "rgb(26, 34, 41)", "rgb(254, 254, 255)"


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """A run of learners with everything a report shows; copied before it is changed."""
    folder = tmp_path_factory.mktemp("trained") / "run"
    words = [*TINY, *SMALL_BERTEAM, "population=mixed4x3", "optimizer=mapelites", f"out={folder}"]
    words += ["evaluation.games_per_pair=1", "evaluation.games=140"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["berteam"])
        cli.run("train", words)
        cli.run("report", [str(folder)])
    return folder


def page_of(folder):
    return (folder / "report" / "report.html").read_text(encoding="utf-8")


def test_everything_is_there(trained):
    page = page_of(trained)
    outside = re.sub(r'srcdoc="[^"]*"', "", page)
    assert not re.search(r"https?:|//[a-z]|\bsrc=|<link|@import|url\((?!#)|fetch\(|XMLHttpRequest", outside)
    assert not re.search(r"<!--[A-Z]+-->|/\*[A-Z]+\*/", outside)
    assert "default-src 'none'" in page
    names = {path.stem for path in (trained / "report").glob("*.png")}
    assert names >= {"elo", "teams", "captains", "islands", "fitness", "aggression", "embeddings", "selector", "timing"}
    assert set(re.findall(r'<figure class="plot" id="run1-(\w+)"', page)) == names
    assert "berteam tournament run=RUN" in page  # who beats whom
    assert page.count("<iframe ") == 1
    ids = re.findall(r'\bid="([^"]+)"', outside)
    assert len(ids) == len(set(ids))
    assert {link for link in re.findall(r'<a [^>]*href="#([^"]+)"', page)} <= set(ids)


@needs_chromium
def test_in_a_browser(trained, tmp_path):
    with opened((trained / "report" / "report.html").as_uri(), tmp_path) as tab:
        for width in (400, 1280):
            tab.send("Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1, mobile=False)
            for theme, card in (("light", LIGHT_CARD), ("dark", DARK_CARD)):
                tab.send("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": theme}])
                assert tab.ask("document.documentElement.scrollWidth") <= width
                assert tab.ask("getComputedStyle(document.querySelector('figure')).backgroundColor") == card
                pale = tab.ask("getComputedStyle(document.querySelector('figcaption')).color")
                assert tab.ask("getComputedStyle(document.querySelector('#run1-selector svg text')).fill") == pale
        tab.press("Tab", 9)
        assert tab.ask("document.activeElement.className") == "skip"
        visited = []
        while len(visited) < 200 and "IFRAME" not in visited:
            tab.press("Tab", 9)
            visited.append(tab.ask("document.activeElement.tagName"))
        assert "A" in visited
        assert visited[-1] == "IFRAME"
        tab.send("Emulation.setEmulatedMedia", media="print")
        shown = "getComputedStyle(document.querySelector('{}')).display"
        assert [tab.ask(shown.format(x)) for x in ("nav", "iframe", ".printed")] == ["none", "none", "block"]
        tab.ask("dispatchEvent(new Event('beforeprint'))")
        assert tab.ask("document.querySelectorAll('details:not([open])').length") == 0
        tab.ask("dispatchEvent(new Event('afterprint'))")
        assert tab.ask("document.querySelectorAll('details[open]').length") == 0
        assert tab.errors == []
        assert [address[:5] for address in tab.asked] == ["file:"]


@needs_chromium
def test_names_cannot_leave_their_place(berteam, tmp_path):
    long_run(tmp_path / "run", 20, name=EVIL)
    berteam("report", "run")
    with opened((tmp_path / "run" / "report" / "report.html").as_uri(), tmp_path) as tab:
        assert tab.ask("document.body.dataset.evil === undefined")
        assert tab.ask("document.querySelectorAll('script').length") == 1
        assert EVIL[:12] in tab.ask("document.querySelector('#run1-elo svg').textContent")
        assert tab.errors == []


def test_several_runs_and_a_comparison(berteam, tmp_path):
    for name in ("one", "two"):
        long_run(tmp_path / name, 20)
    (tmp_path / "both").mkdir()
    (tmp_path / "both" / "comparison.csv").write_text("algorithm,expected_elo\n<berteam>,1040.25\n")
    berteam("report", "one", "two", "compare=both", "out=page")
    page = (tmp_path / "page" / "report.html").read_text()
    assert "<td>&lt;berteam&gt;</td><td>1,040</td>" in page
    assert page.count('<section id="run') == 2
    assert '<section id="overview">' in page
    assert (tmp_path / "page" / "run2_elo.png").exists()
    ids = re.findall(r'\bid="([^"]+)"', page)
    assert len(ids) == len(set(ids))


def test_as_far_as_it_got(berteam, tmp_path):
    long_run(tmp_path / "run", 20, status="running")
    with (tmp_path / "run" / "selector.csv").open("a") as table:
        table.write("21,2.")
    berteam("report", "run")
    assert "as far as it got" in page_of(tmp_path / "run")
    facts = json.loads((tmp_path / "run" / "manifest.json").read_text())
    (tmp_path / "run" / "manifest.json").write_text(json.dumps(facts | {"status": "done"}))
    error = berteam("report", "run", code=2).stderr
    assert re.fullmatch(
        r"berteam: run/selector.csv is cut off in the middle of line 22; have it written anew.\n", error
    )


def test_a_run_that_has_just_begun(berteam, tmp_path):
    (tmp_path / "run").mkdir()
    facts = {"status": "running", "started": "", "command": []}
    (tmp_path / "run" / "manifest.json").write_text(json.dumps(facts))
    berteam("report", "run")
    page = page_of(tmp_path / "run")
    assert "<figure" not in page
    assert "berteam evaluate RUN" in page
    assert "<h3>What is not here</h3>" in page


def test_a_tournament(berteam, tmp_path):
    berteam("tournament", "env=rps", "team_size=1", "out=run")
    berteam("report", "run")
    assert (tmp_path / "run" / "report" / "crosstable.png").exists()
    assert (tmp_path / "run" / "report" / "elo.png").exists()


def test_without_matplotlib(berteam, tmp_path, monkeypatch):
    long_run(tmp_path / "run", 20)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    error = berteam("report", "run", code=2).stderr
    assert error.endswith("not installed: pip install 'berteam-cli[report]'.\n")
    assert not (tmp_path / "run" / "report").exists()


def interrupted(look):
    raise KeyboardInterrupt


def test_an_evaluation_of_an_earlier_epoch_is_left_out(berteam, tmp_path, monkeypatch):
    """And so it is where a newer one was broken off, as its tables are still the earlier one's."""
    words = ["env=rps", "population=ppo6", "selector=mcaa", "games_per_epoch=4", "evaluation.games=400"]
    berteam("train", *words, "epochs=2", "out=run")
    berteam("evaluate", "run")
    assert "Next: berteam report run" in berteam("inspect", "run").stdout
    assert "Next: berteam evaluate run" in berteam("resume", "run", "epochs=4").stdout
    berteam("report", "run")
    page = (tmp_path / "run" / "report" / "report.html").read_text()
    assert "looked at this run after epoch 2; it has gone on since" in page
    assert "Regression" not in page
    with monkeypatch.context() as broken:
        broken.setattr(Look, "all", interrupted)
        berteam("evaluate", "run", code=130)
    assert "Next: berteam evaluate run" in berteam("inspect", "run").stdout
    berteam("report", "run", "on_exists=overwrite")
    page = (tmp_path / "run" / "report" / "report.html").read_text()
    assert "looked at this run after epoch 2; it has gone on since" in page
    berteam("evaluate", "run")
    berteam("report", "run", "on_exists=overwrite")
    assert "it has gone on since" not in (tmp_path / "run" / "report" / "report.html").read_text()
    # Without checkpoints, which may be removed to save room, nothing says that it went on; other folders are none.
    shutil.rmtree(tmp_path / "run" / "checkpoint")
    (tmp_path / "run" / "checkpoint" / "epoch_odd").mkdir(parents=True)
    berteam("report", "run", "on_exists=overwrite")
    assert "it has gone on since" not in (tmp_path / "run" / "report" / "report.html").read_text()
    assert "Next: berteam report run" in berteam("inspect", "run").stdout
