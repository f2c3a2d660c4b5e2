"""What small networks are made of: products of matrices, tanh and exp, written for vector registers.

LLVM does not find the form of a matrix product in loops, and a library's product costs more than it computes at these
sizes and chooses its own order of additions. Here every number is a sum over the inner axis from first to last,
whatever else is computed beside it and however many threads there are.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.core import cgutils
from numba.extending import intrinsic

FUSED = ("contract",)  # a product and a sum may become one instruction, which rounds once
elementwise = njit(cache=True, nogil=True, fastmath=set(FUSED), error_model="numpy")


def tile(rows: int, lanes: int) -> Callable[..., None]:
    """Returns a compiled function that computes ``rows`` times ``lanes`` neighbouring numbers of a product of matrices.

    The function is called with four float32 arrays and the number of steps n, and sets
    c[r, j] = start[j] + a[r, 0] b[0, j] + ... + a[r, n - 1] b[n - 1, j], one term after the other. Each array is
    followed by the place of its first number, counted in numbers, and by how far apart its neighbours are: c and a from
    row to row, a and b from step to step. Nothing is checked.
    """
    vector = ir.VectorType(ir.FloatType(), lanes)
    nothing = ir.Constant(vector, ir.Undefined)
    first_lane = ir.Constant(ir.VectorType(ir.IntType(32), lanes), [0] * lanes)

    def generate(context: Any, builder: ir.IRBuilder, signature: Any, arguments: tuple[ir.Value, ...]) -> ir.Value:
        c, start, a, b = (context.make_array(signature.args[k])(context, builder, arguments[k]).data for k in ARRAYS)
        _, c_first, c_row, _, start_first, _, a_first, a_row, a_step, _, b_first, b_step, steps = arguments

        def moved(first: ir.Value, stride: ir.Value, times: int) -> ir.Value:
            return builder.add(first, builder.mul(stride, ir.Constant(stride.type, times)))

        def place(array: ir.Value, at: ir.Value) -> ir.Value:
            return builder.bitcast(builder.gep(array, [at]), vector.as_pointer())

        sums = [cgutils.alloca_once(builder, vector) for _ in range(rows)]  # LLVM keeps them in registers
        for total in sums:
            builder.store(builder.load(place(start, start_first), align=4), total)
        with cgutils.for_range(builder, steps) as loop:
            right = builder.load(place(b, builder.add(b_first, builder.mul(b_step, loop.index))), align=4)
            at = builder.add(a_first, builder.mul(a_step, loop.index))
            for r, total in enumerate(sums):
                left = builder.load(builder.gep(a, [moved(at, a_row, r)]))
                left = builder.insert_element(nothing, left, ir.Constant(ir.IntType(32), 0))
                term = builder.fmul(builder.shuffle_vector(left, nothing, first_lane), right, flags=FUSED)
                builder.store(builder.fadd(builder.load(total), term, flags=FUSED), total)
        for r, total in enumerate(sums):
            builder.store(builder.load(total), place(c, moved(c_first, c_row, r)), align=4)
        return context.get_dummy_value()

    @intrinsic
    def part(
        typing: Any,
        c: Any,
        c_first: Any,
        c_row: Any,
        start: Any,
        start_first: Any,
        a: Any,
        a_first: Any,
        a_row: Any,
        a_step: Any,
        b: Any,
        b_first: Any,
        b_step: Any,
        steps: Any,
    ) -> Any:
        place = types.intp
        return types.void(c, place, place, start, place, a, place, place, place, b, place, place, place), generate

    return part


ARRAYS = (0, 3, 5, 9)  # which arguments of a tile are arrays
# Eight registers of eight numbers are what keeps both multipliers of a processor busy.
four_by_sixteen, one_by_sixteen, one_by_sixty_four = tile(4, 16), tile(1, 16), tile(1, 64)
four_by_four, one_by_four = tile(4, 4), tile(1, 4)
eight_by_one, one_by_one = tile(8, 1), tile(1, 1)


@njit(cache=True, nogil=True, error_model="numpy")
def multiply(a: np.ndarray, b: np.ndarray, start: np.ndarray, c: np.ndarray) -> None:
    """Writes ``start`` plus the matrix product ``a`` times ``b`` to ``c``.

    Args:
        a: (m, k) float32, in any layout.
        b: (k, n) float32, row by row.
        start: (n,) float32, added to every row.
        c: (m, n) float32, row by row. Changed.
    """
    m, n = c.shape
    k = b.shape[0]
    row, step = a.strides[0] // a.itemsize, a.strides[1] // a.itemsize
    j = 0
    while j + 16 <= n:
        i = 0
        while i + 4 <= m:
            four_by_sixteen(c, i * n + j, n, start, j, a, i * row, row, step, b, j, n, k)
            i += 4
        while i < m:
            one_by_sixteen(c, i * n + j, n, start, j, a, i * row, row, step, b, j, n, k)
            i += 1
        j += 16
    while j + 4 <= n:
        i = 0
        while i + 4 <= m:
            four_by_four(c, i * n + j, n, start, j, a, i * row, row, step, b, j, n, k)
            i += 4
        while i < m:
            one_by_four(c, i * n + j, n, start, j, a, i * row, row, step, b, j, n, k)
            i += 1
        j += 4
    while j < n:
        i = 0
        while i + 8 <= m:
            eight_by_one(c, i * n + j, n, start, j, a, i * row, row, step, b, j, n, k)
            i += 8
        while i < m:
            one_by_one(c, i * n + j, n, start, j, a, i * row, row, step, b, j, n, k)
            i += 1
        j += 1


@njit(cache=True, nogil=True, error_model="numpy")
def multiply_row(
    a: np.ndarray, a_first: int, b: np.ndarray, b_first: int, start: int, c: np.ndarray, c_first: int, k: int, n: int
) -> None:
    """Writes a row of numbers times a matrix, plus another row, to a third; slices would cost more than the product.

    Args:
        a: float32, holds the row of k numbers.
        a_first: place of its first number, counted in numbers from the array's first.
        b: float32, holds the matrix (k, n) row by row, and the row of n numbers that is added.
        b_first: place of the matrix's first number.
        start: place of the added row's first number.
        c: float32, holds the resulting row of n numbers. Changed.
        c_first: place of its first number.
        k: length of the row.
        n: length of the result.
    """
    j = 0
    while j + 64 <= n:
        one_by_sixty_four(c, c_first + j, n, b, start + j, a, a_first, k, 1, b, b_first + j, n, k)
        j += 64
    while j + 16 <= n:
        one_by_sixteen(c, c_first + j, n, b, start + j, a, a_first, k, 1, b, b_first + j, n, k)
        j += 16
    while j < n:
        one_by_one(c, c_first + j, n, b, start + j, a, a_first, k, 1, b, b_first + j, n, k)
        j += 1


@elementwise
def tanh(x: np.ndarray, first: int, count: int) -> None:
    """Replaces ``count`` numbers of ``x``, shape (n,) float32, by their hyperbolic tangents, to within 2e-7.

    A quotient of polynomials (the coefficients are Eigen's), since a call for each number fills no vector register.
    """
    part = x[first : first + count]
    for j in range(len(part)):
        v = min(max(part[j], np.float32(-7.905311)), np.float32(7.905311))  # beyond it the quotient is 1, nearly
        w = v * v
        p = np.float32(-2.76076847742355e-16) * w + np.float32(2.00018790482477e-13)
        p = p * w + np.float32(-8.60467152213735e-11)
        p = p * w + np.float32(5.12229709037114e-08)
        p = p * w + np.float32(1.48572235717979e-05)
        p = p * w + np.float32(6.37261928875436e-04)
        p = p * w + np.float32(4.89352455891786e-03)
        q = np.float32(1.19825839466702e-06) * w + np.float32(1.18534705686654e-04)
        q = q * w + np.float32(2.26843463243900e-03)
        q = q * w + np.float32(4.89352518554385e-03)
        part[j] = v * p / q


@intrinsic
def from_bits(typing: Any, bits: Any) -> Any:
    """Returns the float32 that the 32 ``bits`` of an integer mean."""

    def generate(context: Any, builder: ir.IRBuilder, signature: Any, arguments: tuple[ir.Value, ...]) -> ir.Value:
        return builder.bitcast(arguments[0], ir.FloatType())

    return types.float32(types.int32), generate


@elementwise
def exp(x: np.ndarray, first: int, count: int) -> None:
    """Replaces ``count`` numbers of ``x``, shape (n,) float32, by their exponentials, to within 2e-7 of each.

    2 to a whole power times a polynomial of the rest (the coefficients are those of the Cephes library). Below -87 the
    result is that of -87, above 88 that of 88.
    """
    part = x[first : first + count]
    for j in range(len(part)):
        v = min(max(part[j], np.float32(-87.0)), np.float32(88.0))
        whole = np.floor(v * np.float32(1.44269504088896341) + np.float32(0.5))
        r = v - whole * np.float32(0.693359375)
        r = r - whole * np.float32(-2.12194440e-4)  # ln 2 in two parts, so that nothing is lost
        p = np.float32(1.9875691500e-4) * r + np.float32(1.3981999507e-3)
        p = p * r + np.float32(8.3334519073e-3)
        p = p * r + np.float32(4.1665795894e-2)
        p = p * r + np.float32(1.6666665459e-1)
        p = p * r + np.float32(5.0000001201e-1)
        p = p * r * r + r + np.float32(1.0)
        bits = (np.int32(whole) + np.int32(127)) << np.int32(23)
        part[j] = p * from_bits(bits)  # type: ignore[call-arg]  # Numba's types know no call of an intrinsic
