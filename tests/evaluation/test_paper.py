"""The paper's numbers beside ours, read from tables worked by hand."""

import math
from pathlib import Path

import pytest

from berteam_cli.evaluation.paper import Reproduced, over_seeds, rows
from berteam_cli.records import COLUMNS, write_table


def table(folder, name, *lines):
    """Writes a table of which only the columns that ``lines`` name are filled."""
    folder.mkdir(parents=True, exist_ok=True)
    write_table(
        folder / f"{name}.csv", COLUMNS[name], [[line.get(c, math.nan) for c in COLUMNS[name]] for line in lines]
    )


def test_several_seeds_have_students_interval():
    found = over_seeds([Path("1"), Path("3"), Path("8")], lambda run: (float(str(run)), 0.0, 9.0))
    assert found == pytest.approx((4, 4 - 4.302653 * 13**0.5 / 3**0.5, 4 + 4.302653 * 13**0.5 / 3**0.5))
    assert over_seeds([Path("5")], lambda run: (float(str(run)), 2.0, 9.0)) == (5, 2, 9)


def test_the_first_experiment(tmp_path):
    best = ["2-5", "2-2", "2-3", "1-2", "0-2", "2-4", "2-6", "0-5"]
    elos = [{"team": x, "elo": 1300.0 - k, "elo_low": 1200.0, "elo_high": 1400.0} for k, x in enumerate(best)]
    table(tmp_path / "cup", "elo", *elos)
    for seed, share in ((0, 0.1), (1, 0.2)):
        early = {"epoch": 0, "team": "2-5", "probability": 1.0}
        late = [{"epoch": 9, "team": x, "probability": share if k == 0 else 0.05} for k, x in enumerate(best)]
        table(tmp_path / str(seed), "team_distribution", early, *late)
    runs = {("fixed", "berteam"): [tmp_path / "0", tmp_path / "1"]}
    found = {row[0]: row for row in rows("paper_fixed", Reproduced(runs, tmp_path / "cup", tmp_path))}
    assert len(found) == 17
    assert found["Elo of 2-2"] == ("Elo of 2-2", 1337.0, 1299.0, 1200.0, 1400.0, "Table 1")
    assert found["share of 2-5"][1:3] == pytest.approx((0.14, 0.15))
    assert found["share of 0-5"][2:5] == pytest.approx((0.05, 0.05, 0.05))
    assert found["share of the seven best teams"][2] == pytest.approx(0.15 + 6 * 0.05)


def test_the_second_experiment(tmp_path):
    place = tmp_path / "run" / "evaluation"
    table(place, "members", *({"agent": k, "group": "aggressive" if k < 2 else "defensive"} for k in range(5)))
    table(place, "composition", {"kind": "balanced", "probability": 0.7}, {"kind": "aggressive", "probability": 0.1})
    figures = [("best_elo", 1200.0), ("best_elo_replayed", 1100.0), ("expected_elo", 950.0)]
    table(place, "figures", *({"quantity": x, "value": y, "low": y - 1, "high": y + 1} for x, y in figures))
    table(place, "regression", {"quantity": "r_squared", "value": 0.5, "low": 0.4, "high": 0.6})
    table(place, "embeddings", {"group": "all", "cosine": -0.01})
    runs = {("coevolution", "berteam"): [tmp_path / "run"]}
    found = {row[0]: row[1:5] for row in rows("paper_coevolution", Reproduced(runs, tmp_path, tmp_path))}
    assert found["defensive members"][:2] == (36, 3)
    assert found["aggressive members"][:2] == (14, 2)
    assert found["share of balanced teams"][:2] == (0.75, 0.7)
    assert found["best Elo"] == (1017, 1100, 1099, 1101)  # not that which was lucky
    assert found["expected Elo"] == (930, 950, 949, 951)
    assert found["R^2 of probability on Elo"] == (0.25, 0.5, 0.4, 0.6)
    assert found["cosine of all"][1] == -0.01
    assert math.isnan(found["cosine of strong aggressive"][1])  # nobody was


def test_the_third_experiment(tmp_path):
    algorithms = [(o, s) for o in ("coevolution", "mapelites") for s in ("berteam", "mcaa")]
    runs = {x: [tmp_path / f"{x[0]}_{x[1]}_{seed}" for seed in (0, 1)] for x in algorithms}
    elos = {}
    for k, (optimizer, selector) in enumerate(algorithms):
        figures = {"mixed_elo": 900.0 + k, "mixed_elo_low": 800.0, "mixed_elo_high": 999.0, "epoch_s": 0.1 * k}
        elos[optimizer, selector] = {"algorithm": f"{selector} {optimizer}", "update_s": 0.5, **figures}
    table(tmp_path / "c", "comparison", *reversed(elos.values()))
    table(tmp_path / "c", "runs", *({"algorithm": elos[x]["algorithm"], "run": str(r)} for x in runs for r in runs[x]))
    found = {row[0]: row[1:5] for row in rows("paper_comparison", Reproduced(runs, tmp_path, tmp_path / "c"))}
    assert len(found) == 12
    assert found["Elo of mapelites and berteam"] == (883, 902, 800, 999)
    assert found["seconds an epoch of mapelites and mcaa"][:2] == pytest.approx((35, 0.3))
    assert found["seconds an update of coevolution and berteam"][:2] == (46, 0.5)
