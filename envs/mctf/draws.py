"""Random numbers by counting: SplitMix64 (Steele, Lea and Flood 2014), one stream of 64 bits for each game.

A stream is a counter. Each draw adds the golden gamma 0x9E3779B97F4A7C15 and mixes the sum: xor with itself
shifted right by 30, times 0xBF58476D1CE4E5B9, xor shifted by 27, times 0x94D049BB133111EB, xor shifted by 31.
A uniform number is the upper 53 bits times 2^-53. All of it is exact, so every machine draws the same.
"""

import numpy as np

from mctf.compiled import kernel, part

GAMMA = np.uint64(0x9E3779B97F4A7C15)


@part
def mixed(z: np.uint64) -> np.uint64:
    """Returns the 64 bits of ``z`` mixed; another number for every ``z``."""
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


@kernel
def next_bits(streams: np.ndarray, b: int) -> np.uint64:
    """Returns the next 64 bits of stream ``b``.

    Args:
        streams: (B,) uint64; entry ``b`` is changed. Seed it with any number.
        b: game.
    """
    streams[b] += GAMMA
    return mixed(streams[b])


@kernel
def next_uniform(streams: np.ndarray, b: int) -> float:
    """Returns the next number in [0, 1) of stream ``b``; arguments as of ``next_bits``."""
    return np.float64(next_bits(streams, b) >> np.uint64(11)) * 2.0**-53


@kernel
def seed_of(key: np.uint64, index: np.uint64) -> np.uint64:
    """Returns the seed of game ``index`` under ``key``: the number at place ``index`` of the stream mixed(key).

    Both are uint64; different indices give different seeds, and nearby keys have nothing in common.
    """
    return mixed(mixed(np.uint64(key)) + (np.uint64(index) + np.uint64(1)) * GAMMA)
