import re

import numpy as np
import pytest

from berteam_cli.selector.constraints import allowed

ISLANDS, OWNERS = ["fast", "slow"], np.array([0, 0, 1, 1, 1])


def test_islands_members_and_everybody_by_hand():
    rows = allowed([None, "slow", ["fast", 4], 3], ISLANDS, OWNERS, 4)
    assert rows.astype(int).tolist() == [[1, 1, 1, 1, 1], [0, 0, 1, 1, 1], [1, 1, 0, 0, 1], [0, 0, 0, 1, 0]]


@pytest.mark.parametrize(
    ("places", "said"),
    [
        ("slow", "entry for each of the 2 places, but is slow"),
        (["slow"], "entry for each of the 2 places, but has 1"),
        (["slow", []], "[1] must leave somebody for the place, but allows nobody"),
        (["slwo", None], "[0] must name islands (fast, slow) or members (0 to 4), but has slwo. Did you mean slow?"),
        ([None, [0, 5]], "[1] must name islands (fast, slow) or members (0 to 4), but has 5."),
        ([None, -1], "but has -1"),
        ([None, True], "but has True"),
        ([None, 0.5], "but has 0.5"),
    ],
)
def test_what_cannot_be_is_refused(places, said):
    with pytest.raises(ValueError, match=re.escape(said)):
        allowed(places, ISLANDS, OWNERS, 2)
