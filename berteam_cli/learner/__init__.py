"""How members learn. Compiled functions that were made from other sources are forgotten before any is loaded."""

from pathlib import Path

from mctf.cache import forget_stale

_here = Path(__file__).parent
forget_stale(_here, _here.parent)
forget_stale(_here.parent)
