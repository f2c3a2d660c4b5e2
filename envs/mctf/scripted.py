"""The fixed policies: their names, and what each does with what its vehicle sees.

attack_*, defend_*     one role, at three levels
random                 any action
combined_*             attacks or defends, as the opponents' distance from the own flag suggests
*_competition_easy     drives from field point to field point
*_competition_medium   a hard attacker that looks farther; a defender that chases intruders from its post
waypoint               drives round the field; our own, as the original's needs a planner of paths and is broken
nothing                stays

All but the last two and ``random`` come in the versions of ``Rules.policy_version``. In 2024 all mistakes are the
original's: recorded games are reproduced action by action. Where the original of 2025 would end in an error, because a
vehicle is in the very same place as what it drives to or from, the vehicle here stops or goes straight on.
"""

import math

import numpy as np

from mctf.attackers import COMPETITION, MEDIUM, attack
from mctf.combined import ATTACKS, ROAMS, reach_of, roam, role
from mctf.compiled import kernel
from mctf.defenders import block, guard
from mctf.draws import next_uniform
from mctf.geometry import is_right, team_of, vehicles_of
from mctf.observe import OTHER, OWN
from mctf.patrols import BEAT, IDLE, RAID, ROUND, drive_on, watch
from mctf.rules import ACTIONS, Rules
from mctf.state import State

NAMES = (
    "attack_easy",
    "attack_medium",
    "attack_hard",
    "defend_easy",
    "defend_medium",
    "defend_hard",
    "random",
    "combined_easy",
    "combined_medium",
    "combined_hard",
    "attack_competition_easy",
    "attack_competition_medium",
    "defend_competition_easy",
    "defend_competition_medium",
    "waypoint",
    "nothing",
)
"""Names of the policies; a policy's number is its place here."""
PAPER = NAMES[:7]
"""Those of the paper's experiments."""
(
    ATTACK_EASY,
    ATTACK_MEDIUM,
    ATTACK_HARD,
    DEFEND_EASY,
    DEFEND_MEDIUM,
    DEFEND_HARD,
    RANDOM,
    COMBINED_EASY,
    COMBINED_MEDIUM,
    COMBINED_HARD,
    ATTACK_COMPETITION_EASY,
    ATTACK_COMPETITION_MEDIUM,
    DEFEND_COMPETITION_EASY,
    DEFEND_COMPETITION_MEDIUM,
    WAYPOINT,
    NOTHING,
) = range(len(NAMES))


@kernel
def act(policy: int, state: State, b: int, v: int, raw: np.ndarray, rules: Rules) -> int:
    """Returns the action of a fixed policy that steers vehicle ``v`` of game ``b``: 0..16, -1, or 17..61.

    Args:
        policy: place in ``NAMES``.
        state: its ``stream``, ``goal`` and ``reach`` may change; nothing else does.
        b: game.
        v: vehicle.
        raw: (O,) what the vehicle sees, as of ``observe``.
        rules: the game's constants.
    """
    team = team_of(v, rules)
    first, last = vehicles_of(team, rules)
    enemies, right = OWN + OTHER * (last - first - 1), is_right(team, rules)
    if COMBINED_EASY <= policy <= COMBINED_HARD:
        level = policy - COMBINED_EASY
        if level == MEDIUM and math.isnan(state.reach[b, v]):
            state.reach[b, v] = reach_of(raw, enemies)
        chosen = role(level, raw, enemies)
        if chosen == ROAMS:
            return roam(state.stream, b, state.reach[b, v], raw, enemies, team, rules)
        policy = level + (ATTACK_EASY if chosen == ATTACKS else DEFEND_EASY)

    if policy <= ATTACK_HARD or policy == ATTACK_COMPETITION_MEDIUM:
        action = attack(COMPETITION if policy == ATTACK_COMPETITION_MEDIUM else policy, raw, enemies, rules)
    elif policy == DEFEND_HARD:
        action = block(raw, enemies, rules)
    elif policy in (DEFEND_EASY, DEFEND_MEDIUM):
        action = guard(policy == DEFEND_MEDIUM, raw, enemies, rules)
    elif policy == RANDOM:
        action = int(next_uniform(state.stream, b) * ACTIONS)
    elif policy == DEFEND_COMPETITION_MEDIUM:
        action = watch(raw, enemies, right, rules)
    elif policy == NOTHING:
        action = IDLE
    else:
        route = RAID if policy == ATTACK_COMPETITION_EASY else BEAT if policy == DEFEND_COMPETITION_EASY else ROUND
        state.goal[b, v], point = drive_on(route, state.goal[b, v], raw, right, rules)
        action = ACTIONS + point
    return action
