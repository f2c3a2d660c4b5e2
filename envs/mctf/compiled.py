"""The two ways in which this package compiles a function.

No fastmath and no threads inside, so that equal arguments give equal bits; division by zero gives inf or
NaN as in numpy. Compiled code is kept on disk, and ``cache.py`` sees to it that it is not stale.

``_nrt=False`` compiles without Numba's counting of references: a kernel cannot make an array, and does not count the
thirty that a state consists of whenever it branches, which took four fifths of a step. ``forceinline`` saves handing
those thirty on at each call.
"""

from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol, TypeVar

from numba import njit

if TYPE_CHECKING:
    from numba.core.dispatcher import Dispatcher

Function = TypeVar("Function", bound=Callable[..., object])


class Compiler(Protocol):
    """A decorator whose compiled function is called like the plain one."""

    def __call__(self, function: Function, /) -> "Dispatcher[Function]":
        """Returns the function, to be compiled when it is first called."""


# Numba's types leave out the options that only its documents and sources name (_nrt, no_cpython_wrapper).
kernel: Compiler = njit(  # type: ignore[call-overload]
    cache=True, nogil=True, error_model="numpy", _nrt=False, forceinline=True
)
"""For functions that Python calls, or other compiled functions."""

part: Compiler = njit(  # type: ignore[call-overload]
    cache=True,
    nogil=True,
    error_model="numpy",
    no_cpython_wrapper=True,
    no_cfunc_wrapper=True,
    _nrt=False,
    forceinline=True,
)
"""For functions that only compiled functions call: the wrapper for Python would take as long to compile."""
