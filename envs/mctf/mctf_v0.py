"""The environment under its versioned name, as in PettingZoo: ``from mctf import mctf_v0``."""

from mctf.aec import env, raw_env
from mctf.parallel import parallel_env

__all__ = ["env", "parallel_env", "raw_env"]
