import math

import numpy as np
import pytest

import mctf
from mctf.rules import make_rules


def test_defaults_are_the_papers():
    rules = make_rules()
    assert (rules.blue_size, rules.red_size, rules.width_m, rules.height_m, rules.substeps, rules.max_time_s) == (
        2,
        2,
        200,
        100,
        10,
        420,
    )
    assert rules.untag_radius_m == rules.catch_radius_m == 10.0
    assert make_rules(untag_radius_m=15).untag_radius_m == 15.0


def test_types_are_always_the_same():  # else every mixture would be compiled anew
    odd = make_rules(
        "clean", 2.0, [[100, 40], [20, 40]], 1, 9, world_size_m=[160, 80], max_score=3.0, oob_counts_as_tag=np.False_
    )
    assert [type(value) for value in odd] == [type(value) for value in make_rules()]


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("team_size", 0),
        ("team_size", 1.5),
        ("team_size", "2"),
        ("team_size", None),
        ("substeps", 0),
        ("substeps", math.inf),
        ("max_score", -1),
        ("catch_radius_m", math.nan),
        ("catch_radius_m", 0),
        ("flag_keepout_m", -1),
        ("agent_radius_m", -0.1),
        ("untag_radius_m", math.inf),
        ("max_speed", 0.0),
        ("tau_s", "0.1"),
        ("max_time_s", math.nan),
        ("tagging_cooldown_s", [30]),
        ("oob_counts_as_tag", 2),
        ("stale_side", "yes"),
        ("world_size_m", 200),
        ("world_size_m", (200,)),
        ("world_size_m", "ab"),
        ("world_size_m", (200, math.nan)),
        ("world_size_m", (50, 100)),
        ("world_size_m", (200, 14)),
        ("profile", "latest"),
    ],
)
def test_what_is_not_allowed_is_named(name, value):
    with pytest.raises(ValueError, match=name) as caught:
        make_rules(**{name: value})
    shown = value[1] if name == "world_size_m" and isinstance(value, tuple) and len(value) == 2 else value
    assert "must be" in str(caught.value)
    assert str(shown) in str(caught.value) or f"{value[0]:g}" in str(caught.value)


def test_package_has_what_it_says():
    for name in mctf.__all__:
        assert callable(getattr(mctf, name))
    with pytest.raises(AttributeError):
        _ = mctf.nothing
