import math

import numpy as np
import pandas as pd
import pytest

from berteam_cli.records import COLUMNS, Tables, cell, team_name, write_table


def test_team_names():
    assert team_name(np.array([5, 2])) == "2-5"
    assert team_name([10, 9, 10]) == "9-10-10"


@pytest.mark.parametrize("value", [0.1, 1 / 3, 1e-300, np.float64(0.7) * 3, -0.0])
def test_floats_read_back_to_the_same_bits(value):
    assert float(cell(value)) == value
    assert cell(np.float64("nan")) == cell(math.nan) == ""
    assert cell(np.int64(3)) == 3


def test_tables_are_cut_back_to_where_a_checkpoint_was(tmp_path):
    tables = Tables(tmp_path)
    tables.add("selector", [(1, 0.5, 2, 3, math.nan, math.nan, math.nan)])
    sizes = tables.sizes()
    tables.add("selector", [(2, 0.25, 2, 3, 1.0, 0.0, 0.5)])
    tables.close()
    again = Tables(tmp_path, sizes)
    again.add("selector", [(2, 0.125, 1, 1, 2.0, 1.0, 0.5)])
    again.close()
    table = pd.read_csv(tmp_path / "selector.csv")
    assert list(table.columns) == list(COLUMNS["selector"])
    assert list(table.epoch) == [1, 2]
    assert list(table.loss) == [0.5, 0.125]


def test_rows_are_in_the_file_at_once(tmp_path):
    tables = Tables(tmp_path)
    tables.add("generations", [(3, "a,b", 1, 2, 1.0, 2.0, 9, "fitness")])
    assert pd.read_csv(tmp_path / "generations.csv").island[0] == "a,b"


def test_a_table_is_whole_or_not_there(tmp_path):
    def rows():
        yield (1, 2)
        raise RuntimeError

    with pytest.raises(RuntimeError):
        write_table(tmp_path / "x.csv", ("a", "b"), rows())
    assert not (tmp_path / "x.csv").exists()
