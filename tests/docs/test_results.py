"""What docs/results/ says of sweeps, and that its sweeps are of this version's keys."""

import sys

import numpy as np
import pandas as pd
import pytest
import yaml

from berteam_cli.compose import check, prepare
from tests.docs.pages import ROOT

RESULTS = ROOT / "docs" / "results"
SCRIPTS = ("tables", "selection", "roles")


@pytest.fixture
def scripts(monkeypatch):
    monkeypatch.syspath_prepend(str(RESULTS))
    yield tuple(__import__(name) for name in SCRIPTS)
    for name in SCRIPTS:
        sys.modules.pop(name)


def test_an_interval_is_student_s(scripts):
    tables, *_ = scripts
    # Mean 2, deviation 1, t of 2 degrees of freedom 4.303: 4.303 / √3 = 2.484.
    assert tables.spoken(np.array([1.0, 2.0, 3.0]), 2) == "2.00 ± 2.48"
    assert tables.spoken(np.array([7.0, np.nan])) == "7"
    assert tables.spoken(np.array([np.nan])) == ""


def test_selectors_are_compared_population_by_population(scripts):
    _, selection, _ = scripts
    elos = pd.DataFrame({"berteam": [1010.0, 1110.0], "uniform": [1000.0, 1100.0]}, index=["a", "b"])
    elos.index.name = "population"
    assert "| berteam - uniform | 2 | 10 ± 0 |" in selection.compared(elos)


def test_roles_are_what_members_add_to_their_teams(scripts):
    *_, roles = scripts
    rng = np.random.default_rng(0)
    grabs, tags = np.array([0.5, 0.0, 0.25]), np.array([0.0, 2.0, 1.0])
    teams = {side: rng.integers(3, size=(40, 2)) for side in ("blue", "red")}
    games = pd.DataFrame({side: ["-".join(map(str, team)) for team in of] for side, of in teams.items()})
    for side, of in teams.items():
        games[f"{side}_grabs"], games[f"{side}_tags"] = grabs[of].sum(axis=1), tags[of].sum(axis=1)
        games[f"{side}_captures"], games[f"{side}_score"] = 0.0, 0.5
    found = roles.roles(games[games.index >= 10])
    assert found["grabs"].to_list() == pytest.approx(grabs)
    assert found["tags"].to_list() == pytest.approx(tags, abs=1e-12)
    assert found["score"].to_list() == pytest.approx([0.25] * 3)
    late = np.concatenate([of[10:] for of in teams.values()])
    assert found["share of places"].to_list() == pytest.approx(np.bincount(late.ravel(), minlength=3) / late.size)
    assert "| 1 | " in roles.shown(found)


def test_the_sweeps_can_be_run():
    prepare()
    for path in sorted(RESULTS.glob("*.yaml")):
        plan = yaml.safe_load(path.read_text())
        listed = plan.get("list", [[]])
        for variant in [listed[0], *(x for x in listed if any("." not in word.split("=")[0] for word in x))]:
            first = [f"{key}={values[0]}" for key, values in plan.get("sweep", {}).items()]
            config = check("train", [*plan["overrides"], *variant, *first], lambda config, keys: None)
            assert config.evaluation.games_per_pair > 0
