"""The games. Compiled functions call each other across packages, so what is stale is forgotten before any is loaded."""

from pathlib import Path

import mctf
import rps
from mctf.cache import forget_stale

_here = Path(__file__).parent
_games = (_here.parent, Path(mctf.__file__).parent, Path(rps.__file__).parent)
forget_stale(_here, *_games)
forget_stale(_here.parent)
forget_stale(_games[-1])
