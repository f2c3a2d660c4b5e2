"""docs/config.md: what the script makes is what lies there, and every key of every config is in it."""

import re
import runpy

import pytest
from omegaconf import OmegaConf

from berteam_cli.compose import keys
from berteam_cli.config import SCHEMAS
from tests.docs.pages import ROOT
from tests.test_config import all_choices, composed

PAGE = (ROOT / "docs" / "config.md").read_text()


def test_the_page_is_of_this_tree():
    page = runpy.run_path(str(ROOT / "docs" / "config_reference.py"))["page"]()
    assert page == PAGE, "make docs writes docs/config.md anew"


@pytest.mark.parametrize("command", SCHEMAS["command"])
def test_every_key_of_every_command_is_there(command):
    missing = OmegaConf.to_container(composed(command=command), structured_config_mode="dict")
    section = PAGE.partition(f"## berteam {command}\n")[2].partition("\n## ")[0]
    told = re.findall(r"^\| `([\w.]+)` \|", section, flags=re.M)
    assert {x.split(".")[0] for x in told} == {x for x in missing if x not in SCHEMAS}


@pytest.mark.parametrize("group", sorted({group for group, _ in all_choices()} - {"population", "experiment"}))
def test_every_key_of_every_choice_is_there(group):
    for _, choice in (x for x in all_choices() if x[0] == group):
        section = PAGE.partition(f"### {group}={choice}\n")[2].partition("\n##")[0]
        told = re.findall(rf"^\| `{group}\.([\w.]+)` \|", section, flags=re.M)
        based = re.search(rf"All keys of `{group}=(\w+)`", section)
        if based:
            told += re.findall(
                rf"^\| `{group}\.([\w.]+)` \|",
                PAGE.partition(f"### {group}={based[1]}\n")[2].partition("\n##")[0],
                flags=re.M,
            )
        known = [x for x in keys(composed(command=f"{group}/{choice}")[group]) if x != "name"]
        leaves = {x for x in known if not any(y.startswith(f"{x}.") for y in known)}
        assert set(told) == leaves


def test_types_bounds_and_defaults_by_hand():
    for line in (
        "| `epochs` | `200` | whole number >= 0 | Rounds of selecting, playing, learning and replacing. |",
        "| `env.tau_s` | `0.1` | number > 0 | Length of a sub-step of the physics. |",
        "| `env.starts` | `null` | `quarter`, `midway`, `random`, null | Where games start:",
        "| `learner.clip_range_vf` | `null` | number > 0, or null | ",
        "| `selector.observations.drop_input` | `0.5` | number >= 0, <= 1 | ",
        "| `runs` | must be given | list of words | ",
    ):
        assert f"\n{line}" in PAGE
