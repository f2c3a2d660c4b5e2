"""What docs/results/ says of sweeps, and that its sweeps are of this version's keys."""

import sys

import numpy as np
import pandas as pd
import pytest
import yaml

from berteam_cli.compose import check, prepare
from tests.docs.pages import ROOT

RESULTS = ROOT / "docs" / "results"


@pytest.fixture
def scripts(monkeypatch):
    monkeypatch.syspath_prepend(str(RESULTS))
    yield __import__("tables"), __import__("selection")
    for name in ("tables", "selection"):
        sys.modules.pop(name)


def test_an_interval_is_student_s(scripts):
    tables, _ = scripts
    # Mean 2, deviation 1, t of 2 degrees of freedom 4.303: 4.303 / √3 = 2.484.
    assert tables.spoken(np.array([1.0, 2.0, 3.0]), 2) == "2.00 ± 2.48"
    assert tables.spoken(np.array([7.0, np.nan])) == "7"
    assert tables.spoken(np.array([np.nan])) == ""


def test_selectors_are_compared_population_by_population(scripts):
    _, selection = scripts
    elos = pd.DataFrame({"berteam": [1010.0, 1110.0], "uniform": [1000.0, 1100.0]}, index=["a", "b"])
    elos.index.name = "population"
    assert "| berteam - uniform | 2 | 10 ± 0 |" in selection.compared(elos)


def test_the_sweeps_can_be_run():
    prepare()
    for path in sorted(RESULTS.glob("*.yaml")):
        plan = yaml.safe_load(path.read_text())
        listed = plan.get("list", [[]])
        for variant in [listed[0], *(x for x in listed if any("." not in word.split("=")[0] for word in x))]:
            first = [f"{key}={values[0]}" for key, values in plan.get("sweep", {}).items()]
            config = check("train", [*plan["overrides"], *variant, *first], lambda config, keys: None)
            assert config.evaluation.games_per_pair > 0
