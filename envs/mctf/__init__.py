"""Marine Capture-the-Flag: two teams of vehicles, two flags, a compiled kernel for many games.

The rules and their order are those of the Pyquaticus of June 2024, to the bit wherever that can be.

rules       numbers and switches of a game
state       arrays of many games, the start
kernel      one step of one game, its end
dynamics    motion of the vehicles in a step
events      grabs, tags, captures, untagging after it
geometry    angles and distances
observe     what a vehicle sees
rewards     what a step is worth
scripted    the seven fixed policies
draws       random numbers
play        whole games of fixed policies
env         the PettingZoo environment
check       replays recorded games: ``python -m mctf.check FILE.npz ...``
compiled    how functions are compiled
cache       forgets compiled functions that are stale
"""

from importlib import import_module
from pathlib import Path

from mctf.cache import forget_stale
from mctf.rules import Rules, make_rules

__all__ = ["Rules", "make_rules", "parallel_env", "play_scripted"]  # the last two are below, on demand

forget_stale(Path(__file__).parent)

_LAZY = {"parallel_env": "mctf.env", "play_scripted": "mctf.play"}


def __getattr__(name: str) -> object:
    """Imports what needs Numba or PettingZoo when it is first asked for, so that ``import mctf`` is fast."""
    if name not in _LAZY:
        raise AttributeError(f"module 'mctf' has no attribute {name!r}")
    return getattr(import_module(_LAZY[name]), name)
