"""The versions of the game: what every number and switch is unless it is given.

Whatever two versions differ in is one entry here and one field of ``rules.Rules``; ``docs/mctf.md`` has the table.
"""

from types import MappingProxyType
from typing import Any

PYQUATICUS_2024_06 = MappingProxyType(
    {
        # The paper's numbers
        "world_size_m": (200.0, 100.0),
        "flag_keepout_m": 5.0,
        "catch_radius_m": 10.0,
        "agent_radius_m": 2.0,
        "tau_s": 0.1,
        "substeps": 10,
        "max_time_s": 420.0,
        "max_score": 1,
        "tagging_cooldown_s": 30.0,
        # Motion
        "dynamics": "heron_2024",
        "accel_rule": "overshoot",
        "turn_loss_rule": "subtract",
        "reverse_steering": True,
        "speed_is_mean": False,
        "first_kick": True,
        "pid_reset": True,
        "float32": True,
        "action_speed": "fixed",
        "missing_action": "heading",
        # The world
        "blue_side": "right",
        "starts": "quarter",
        "wall_rule": "bounce",
        "oob_counts_as_tag": True,
        "wall_tags": False,
        "keepout_rule": "before",
        # Events
        "stale_side": True,
        "grab_from_own_side": True,
        "tag_at_zero": False,
        "oob_may_tag": True,
        "capture_first_only": True,
        "untag_at_keepout": False,
        "tie_at_max": "red",
        "clock_overruns": True,
        # What is seen, and the fixed policies
        "obs_margin_m": 10.0,
        "obs_line_range": "half",
        "obs_clipped": False,
        "field_points": "fixed",
        "field_point_reach_m": 0.3,
        "policy_version": "2024",
    }
)
"""Pyquaticus of June 2024 (commit 847b53b), bug for bug, with the numbers of the paper's experiments."""

PYQUATICUS_2025_11 = MappingProxyType(
    dict(PYQUATICUS_2024_06)
    | {
        "world_size_m": (160.0, 80.0),
        "flag_keepout_m": 3.0,
        "substeps": 1,
        "max_time_s": 600.0,
        "max_score": 20,
        "tagging_cooldown_s": 60.0,
        "dynamics": "heron",
        "accel_rule": "limit",
        "turn_loss_rule": "multiply",
        "reverse_steering": False,
        "speed_is_mean": True,
        "first_kick": False,
        "float32": False,
        "action_speed": "share",
        "missing_action": "stop",
        "blue_side": "left",
        "starts": "midway",
        "wall_rule": "drive_back",
        "oob_counts_as_tag": False,
        "wall_tags": True,
        "keepout_rule": "after",
        "grab_from_own_side": False,
        "tag_at_zero": True,
        "oob_may_tag": False,
        "capture_first_only": False,
        "clock_overruns": False,
        "obs_margin_m": 0.0,
        "obs_line_range": "diagonal",
        "obs_clipped": True,
        "field_points": "scaled",
        "field_point_reach_m": 2.0,
        "policy_version": "2025",
    }
)
"""Pyquaticus of November 2025 (commit c0a3691) with its own defaults; events right for any team size."""

CLEAN = MappingProxyType(
    dict(PYQUATICUS_2024_06)
    | {
        "accel_rule": "limit",
        "turn_loss_rule": "multiply",
        "reverse_steering": False,
        "first_kick": False,
        "float32": False,
        "action_speed": "share",
        "missing_action": "stop",
        "oob_counts_as_tag": False,
        "stale_side": False,
        "tag_at_zero": True,
        "oob_may_tag": False,
        "capture_first_only": False,
        "untag_at_keepout": True,
        "tie_at_max": "draw",
        "clock_overruns": False,
        "obs_clipped": True,
        "field_points": "scaled",
        "policy_version": "repaired",
    }
)
"""The rules of June 2024 with their mistakes repaired."""

PROFILES: MappingProxyType[str, MappingProxyType[str, Any]] = MappingProxyType(
    {"pyquaticus-2024-06": PYQUATICUS_2024_06, "pyquaticus-2025-11": PYQUATICUS_2025_11, "clean": CLEAN}
)
"""Profiles by name."""

WORDS = MappingProxyType(
    {
        "dynamics": ("heron_2024", "heron", "surveyor"),
        "accel_rule": ("overshoot", "limit"),
        "turn_loss_rule": ("subtract", "multiply"),
        "action_speed": ("fixed", "share"),
        "missing_action": ("heading", "stop"),
        "blue_side": ("right", "left"),
        "starts": ("quarter", "midway", "random"),
        "wall_rule": ("bounce", "drive_back"),
        "keepout_rule": ("before", "after"),
        "tie_at_max": ("red", "draw"),
        "obs_line_range": ("half", "diagonal"),
        "field_points": ("fixed", "scaled"),
        "policy_version": ("2024", "repaired", "2025"),
    }
)
"""What a switch that is not yes or no may be; kernels see the place of the word."""
