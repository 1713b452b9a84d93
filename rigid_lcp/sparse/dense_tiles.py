"""The one dense product of the block factorisation: four rows by 4, 8 or 12 columns, in registers.

    X = S - A B,        and where asked   T X = S - A B   with T lower triangular, (4, 4)

Compilers do not keep such a tile in registers by themselves, and a call of BLAS costs more than
the product of the small fronts that packings have.  So the tile is written as vectors of four
numbers here (LLVM maps them to what the processor has), and everything else in plain loops.
Products of large matrices are as fast as those of OpenBLAS.

All matrices lie by rows in flat arrays: ``..._at`` says where one begins, ``..._stride`` how far
its rows are apart.  A is given transposed, (depth, 4): the factors keep both sides by the pivot.
"""

from typing import Any

from llvmlite import ir
from numba import njit, types
from numba.core import cgutils
from numba.extending import intrinsic

from rigid_lcp.arrays import Floats

TILE = 4
"""Rows of a tile, and numbers in a vector: rows and columns are padded to multiples of it."""
TERMS_AT_ONCE = 64
"""Terms summed at a time [-]: what they read stays in the processor's nearest memory."""
_VECTOR, _WORD = ir.VectorType(ir.DoubleType(), TILE), ir.IntType(64)
_FUSED = ("contract",)


def _make_word(number: int) -> Any:
    return ir.Constant(_WORD, number)


def _point_to_vector(builder: Any, numbers: Any, place: Any) -> Any:
    return builder.bitcast(builder.gep(numbers, [place]), _VECTOR.as_pointer())


def _broadcast(builder: Any, numbers: Any, place: Any) -> Any:
    """A vector of one number."""
    short = ir.IntType(32)
    number = builder.load(builder.gep(numbers, [place]))
    lone = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), number, ir.Constant(short, 0))
    every = ir.Constant(ir.VectorType(short, TILE), [0] * TILE)
    return builder.shuffle_vector(lone, lone, every)


def _subtract(builder: Any, value: Any, one: Any, two: Any) -> Any:
    """``value - one two``, in one instruction where there is one."""
    return builder.fsub(value, builder.fmul(one, two, flags=_FUSED), flags=_FUSED)


def _make_tile(vectors: int, divided: bool) -> Any:
    """The tile of so many vectors a row; ``divided``: T is solved for."""

    @intrinsic
    def fill_tile(
        typingctx: Any, out: Any, out_at: Any, source: Any, source_at: Any, stride: Any,
        left: Any, left_at: Any, left_stride: Any, right: Any, right_at: Any, right_stride: Any,
        depth: Any, triangle: Any,
    ) -> Any:  # fmt: skip
        word = types.int64
        signature = types.void(
            out, word, source, word, word, left, word, word, right, word, word, word, triangle
        )

        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            def find_numbers(which: int) -> Any:
                made = context.make_array(signature.args[which])
                return made(context, builder, values[which]).data

            x, s, a, b, t = (find_numbers(which) for which in (0, 2, 5, 8, 12))
            _, to, _, at, step, _, a_at, a_step, _, b_at, b_step, terms, _ = values
            columns = [_make_word(TILE * v) for v in range(vectors)]
            places = [
                [builder.add(builder.mul(_make_word(i), step), column) for column in columns]
                for i in range(TILE)
            ]
            slots: list[list[Any]] = []
            for row in places:
                slots.append([])
                for place in row:
                    slot: Any = cgutils.alloca_once(builder, _VECTOR)  # type: ignore[no-untyped-call]
                    given = _point_to_vector(builder, s, builder.add(at, place))
                    builder.store(builder.load(given, align=8), slot)
                    slots[-1].append(slot)
            with cgutils.for_range(builder, terms) as loop:
                begin = builder.add(b_at, builder.mul(loop.index, b_step))
                beside = [
                    builder.load(_point_to_vector(builder, b, builder.add(begin, column)), align=8)
                    for column in columns
                ]
                begin = builder.add(a_at, builder.mul(loop.index, a_step))
                for i in range(TILE):
                    share = _broadcast(builder, a, builder.add(begin, _make_word(i)))
                    for slot, other in zip(slots[i], beside, strict=True):
                        builder.store(_subtract(builder, builder.load(slot), share, other), slot)
            rows = [[builder.load(slot) for slot in row] for row in slots]
            for i in range(TILE if divided else 0):
                for k in range(i):
                    share = _broadcast(builder, t, _make_word(i * TILE + k))
                    rows[i] = [
                        _subtract(builder, value, share, above)
                        for value, above in zip(rows[i], rows[k], strict=True)
                    ]
                scale = _broadcast(builder, t, _make_word(i * TILE + i))
                rows[i] = [builder.fmul(value, scale) for value in rows[i]]
            for row, made in zip(places, rows, strict=True):
                for place, value in zip(row, made, strict=True):
                    at = _point_to_vector(builder, x, builder.add(to, place))
                    builder.store(value, at, align=8)
            return context.get_dummy_value()

        return signature, generate

    return fill_tile


_tile_4, _tile_8, _tile_12 = (_make_tile(vectors, False) for vectors in (1, 2, 3))
_divided_4, _divided_8, _divided_12 = (_make_tile(vectors, True) for vectors in (1, 2, 3))


@njit(cache=True)
def subtract_product(
    out: Floats, out_at: int, source: Floats, source_at: int, stride: int,
    left: Floats, left_at: int, left_stride: int, right: Floats, right_at: int, right_stride: int,
    depth: int, rows: int, columns: int,
) -> None:  # fmt: skip
    """``X = S - A B``: X and S (rows, columns) in ``out`` and ``source``, A^T (depth, rows) in
    ``left``, B (depth, columns) in ``right``.  ``rows``, ``columns``: multiples of `TILE`."""
    for k in range(0, max(depth, 1), TERMS_AT_ONCE):
        deep = min(TERMS_AT_ONCE, depth - k)
        for j in range(0, columns, 12):
            wide, b_at = columns - j, right_at + k * right_stride + j
            for i in range(0, rows, 4):
                x_at, s_at = out_at + i * stride + j, source_at + i * stride + j
                a_at = left_at + k * left_stride + i
                if wide >= 12:
                    _tile_12(
                        out, x_at, source, s_at, stride, left, a_at, left_stride,
                        right, b_at, right_stride, deep, left,
                    )  # fmt: skip
                elif wide == 8:
                    _tile_8(
                        out, x_at, source, s_at, stride, left, a_at, left_stride,
                        right, b_at, right_stride, deep, left,
                    )  # fmt: skip
                else:
                    _tile_4(
                        out, x_at, source, s_at, stride, left, a_at, left_stride,
                        right, b_at, right_stride, deep, left,
                    )  # fmt: skip
        source, source_at = out, out_at  # the rest of the depth is taken from what is left


@njit(cache=True)
def divide_rows(
    rows: Floats, at: int, stride: int, left: Floats, left_at: int, right: Floats, right_at: int,
    depth: int, columns: int, triangle: Floats,
) -> None:  # fmt: skip
    """``T X = S - A B`` in place of S (4, columns), ``at`` of ``rows``; A^T (depth, 4) in ``left``,
    B (depth, columns) in ``right``, all rows ``stride`` apart.

    ``triangle``: T (16,), with the inverse of each number on its diagonal in its place.
    """
    for j in range(0, columns, 12):
        wide, x_at, b_at = columns - j, at + j, right_at + j
        if wide >= 12:
            _divided_12(
                rows, x_at, rows, x_at, stride, left, left_at, stride, right, b_at, stride, depth,
                triangle,
            )  # fmt: skip
        elif wide == 8:
            _divided_8(
                rows, x_at, rows, x_at, stride, left, left_at, stride, right, b_at, stride, depth,
                triangle,
            )  # fmt: skip
        else:
            _divided_4(
                rows, x_at, rows, x_at, stride, left, left_at, stride, right, b_at, stride, depth,
                triangle,
            )  # fmt: skip
