"""Names that a spreadsheet, a terminal or a browser would obey."""

import csv
import json
import re
from html.parser import HTMLParser
from pathlib import Path

from berteam_cli.records import COLUMNS, write_table
from tests.hostile.conftest import changed

NAMES = (
    "=HYPERLINK(1)",
    "+1",
    "-1+cmd|' /C calc'!A0",
    "@SUM(1)",
    "a;=1+1",
    "\x1b[2J\x1b]0;x\x07",
    "a\nb",
    "[red]x[/red]",
    "<b>&\"'",
)


def test_names_of_folders_are_no_formulas_and_no_orders_to_a_terminal(run, berteam):
    folders = [str(run("hands", name)) for name in NAMES]
    for seed, folder in enumerate(folders):  # else they were one training, and could not be compared
        changed(Path(folder), "seed: 0\nteam_size", f"seed: {seed}\nteam_size")
    joined = ",".join("'" + name.replace("'", "\\'") + "'" for name in folders)
    words = ["tournament", f"run=[{joined}]", "top=1", "games_per_pair=2", "out=t"]
    out = berteam(*words).stdout + berteam("inspect", "t").stdout
    out += berteam("compare", *(f"./{name}" for name in folders), "games=40", "reference_games=10", "out=c").stdout
    for name in folders:
        out += berteam("inspect", f"./{name}").stdout
    assert "[red]x[/red]" in out
    assert all(line.isprintable() for line in out.split("\n"))
    for path in (*Path("t").glob("*.csv"), *Path("c").glob("*.csv")):
        with path.open(newline="") as file:
            cells = [cell for row in csv.reader(file) for cell in row]
        texts = [cell for cell in cells if not re.fullmatch(r"-?[0-9.e+-]+|-inf|", cell)]
        assert all(cell.isprintable() and not re.search(r"(^|;)[=+@-]", cell) for cell in texts), path


class Tags(HTMLParser):
    """Collects the tags of a page, and those of pages in it."""

    def __init__(self, page):
        super().__init__()
        self.tags, self.attributes = [], []
        self.feed(page)

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        for name, value in attributes:
            if name == "srcdoc":
                self.tags += Tags(value).tags
            self.attributes.append(name)


EVIL = '</script></pre></title>"><script>evil()</script><img src=x onerror=evil()>${x}<!--BODY-->'


def test_no_name_is_a_tag_on_a_page(run, berteam):
    folder = run("sailors")
    manifest = json.loads((folder / "manifest.json").read_text())
    manifest |= {"command": ["berteam", EVIL], "started": EVIL, "overrides": [EVIL], EVIL: EVIL, "resumed": [EVIL]}
    (folder / "manifest.json").write_text(json.dumps(manifest))
    changed(folder, "logger:", f"# {EVIL}\nlogger:")
    for table in ("agents", "team_distribution"):
        text = (folder / f"{table}.csv").read_text()
        (folder / f"{table}.csv").write_text(text.replace("attack_hard", f'"{EVIL}"'.replace('">', '"">')))
    rated = ((team, EVIL, 1000, 900, 1100, 9, 3, 3, 3, 0.5, int(team) + 1, "", "", 1, 2) for team in "01")
    write_table(folder / "elo.csv", COLUMNS["elo"], rated)
    other = folder.rename(EVIL.replace("/", "\u2215").replace("\u2215script", "script")[:200])
    berteam("report", str(other), "out=page")
    berteam("replay", str(other), "blue=0", "red=1", "out=evil.html")
    for path, scripts in (("page/report.html", 2), ("evil.html", 1)):  # a game has a script, the report one more
        page = Tags(Path(path).read_text())
        assert page.tags.count("script") == scripts
        assert "img" not in page.tags
        assert not any(name.startswith("on") for name in page.attributes)
        assert "evil()" in Path(path).read_text()
