"""Tables that are cut off."""

import pytest

from berteam_cli.command.inspect import read_table, whole_lines
from berteam_cli.errors import InputError

WHOLE = "epoch,island,probability\n0,a,0.5\n0,b,0.5\n"


@pytest.mark.parametrize(
    ("text", "left"),
    [
        (WHOLE, WHOLE),
        (WHOLE + "1,a,0.", WHOLE),  # no end
        (WHOLE + "1,a\n", WHOLE),  # too few cells
        ("epoch,island,probability\n", "epoch,island,probability\n"),
        ("epoch,isl", ""),
        (WHOLE + '1,"a, or b",0.5\n', WHOLE + '1,"a, or b",0.5\n'),
        (WHOLE + "1,,\n", WHOLE + "1,,\n"),
    ],
)
def test_whole_lines(text, left):
    assert text.encode()[: whole_lines(text.encode())] == left.encode()


@pytest.mark.parametrize("end", ["1,a,0.", "1,a\n"])
def test_a_table_that_is_cut_off(end, tmp_path):
    path = tmp_path / "island_distribution.csv"
    path.write_text(WHOLE + end)
    with pytest.raises(InputError, match=r"island_distribution.csv is cut off in the middle of line 4; .*anew\.$"):
        read_table(tmp_path, "island_distribution")
    assert len(read_table(tmp_path, "island_distribution", whole=False)) == 2
