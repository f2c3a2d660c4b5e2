"""Marine Capture-the-Flag: two teams of vehicles, two flags, a compiled kernel for many games.

The rules and their order are those of Pyquaticus, of June 2024 or of November 2025, or the former repaired.

profiles    what the versions of the game differ in
rules       numbers and switches of a game
state       arrays of many games
start       where a game begins; practice, where else it may
kernel      one step of one game, its end
commands    from actions to what the controllers are asked for
dynamics    motion of the vehicles in a step
controllers thrust, speed and turn of a vehicle
keepout     the circle around the own flag
events      grabs, tags, captures, untagging after it
geometry    angles and distances
observe     what a vehicle sees
rewards     what a step is worth, with shaping
scripted    the fixed policies
draws       random numbers
play        whole games of fixed policies
view        kinds of actions and observations
lanes       the kernels behind the next two
batch       many games in step
parallel    the PettingZoo environment in which all act at once
aec         the one in which they take turns
spaces      their spaces, and the state of the whole field
snapshot    a game saved and restored
mctf_v0     both under their versioned name
render      pictures, with film, sheet and page
recording   recorded games: ``python -m mctf.check FILE.npz ...`` replays them, with comparing and replaying
tournament  all teams of fixed policies against each other
compiled    how functions are compiled
cache       forgets compiled functions that are stale
"""

from importlib import import_module
from pathlib import Path

from mctf.cache import forget_stale
from mctf.rules import Rules, make_rules

__all__ = ["Batch", "Rules", "env", "make_rules", "parallel_env", "play_scripted", "raw_env"]

forget_stale(Path(__file__).parent)

_LAZY = {
    "Batch": "mctf.batch",
    "env": "mctf.aec",
    "parallel_env": "mctf.parallel",
    "play_scripted": "mctf.play",
    "raw_env": "mctf.aec",
}


def __dir__() -> list[str]:
    return __all__


def __getattr__(name: str) -> object:
    """Imports what needs Numba or PettingZoo when it is first asked for, so that ``import mctf`` is fast."""
    if name not in _LAZY:
        raise AttributeError(f"module 'mctf' has no attribute {name!r}")
    return getattr(import_module(_LAZY[name]), name)
