"""The two ways in which this package compiles a function.

No fastmath and no threads inside, so that equal arguments give equal bits; division by zero gives inf or
NaN as in numpy. Compiled code is kept on disk, and ``cache.py`` sees to it that it is not stale.

``_nrt=False`` compiles without Numba's counting of references: a kernel cannot make an array, and does not count the
thirty that a state consists of whenever it branches, which took four fifths of a step. ``forceinline`` saves handing
those thirty on at each call.
"""

from numba import njit

kernel = njit(cache=True, nogil=True, error_model="numpy", _nrt=False, forceinline=True)
"""For functions that Python calls, or other compiled functions."""

part = njit(
    cache=True,
    nogil=True,
    error_model="numpy",
    no_cpython_wrapper=True,
    no_cfunc_wrapper=True,
    _nrt=False,
    forceinline=True,
)
"""For functions that only compiled functions call: the wrapper for Python would take as long to compile."""
