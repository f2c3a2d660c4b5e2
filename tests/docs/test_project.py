"""What the project says of itself is the same everywhere, and links lead somewhere."""

import re
import tomllib
from urllib.parse import unquote

import pytest
import yaml

import berteam_cli
from tests.docs.pages import PAGES, ROOT


def test_one_version_and_one_licence():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    newest = re.search(r"^## ([\d.]+)$", (ROOT / "CHANGELOG.md").read_text(), flags=re.M)[1]
    assert project["version"] == berteam_cli.__version__ == str(citation["version"])
    assert newest == project["version"] or newest > project["version"]  # what comes next is written before it has come
    assert project["license"] == citation["license"] == "MIT"
    assert (ROOT / "LICENSE").read_text().startswith("MIT License")
    assert citation["preferred-citation"]["title"] in " ".join((ROOT / "README.md").read_text().split())


def anchor(heading):
    """Returns what a link to a heading says behind #."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_links_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)\s]+)\)", page.read_text()):
        if target.startswith("http"):
            continue
        name, _, place = unquote(target).partition("#")
        path = page.parent / name if name else page
        assert path.exists(), target
        if place:
            headings = re.findall(r"^#+ (.*)$", path.read_text(), flags=re.M)
            assert place in [anchor(x) for x in headings], target
