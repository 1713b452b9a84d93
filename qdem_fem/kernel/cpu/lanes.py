"""SIMD lanes as a numba type: the element functions, written for one number, run on several.

``Lanes(float64, 4)`` is a vector register of four numbers, one of each of four tetrahedra.
It knows ``+ - * /``, the test `mark_not_positive`, and the two moves of memory that an element
needs: `gather_edges` reads the nodal vectors of a block of elements, `scatter_pulls` subtracts
their forces from the nodes.  So nothing is left to the good will of a loop vectoriser, and one
source serves vectors, plain numbers and, in `qdem_fem.kernel.cuda.step`, the threads of a GPU.

Nodal arrays hold four numbers a node (x, y, z and an unused one), so that a node is one load.
"""

import operator
from collections.abc import Callable, Sequence
from typing import Any

from llvmlite import binding, ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic as numba_intrinsic
from numba.extending import lower_builtin, models, register_model

intrinsic: Any = numba_intrinsic

REGISTER_BITS = 512 if binding.get_host_cpu_features().get("avx512f", False) else 256


def count_lane(dtype: Any) -> int:
    """How many numbers of a NumPy or numba type are computed side by side on this machine."""
    bits: int = getattr(dtype, "bitwidth", 0) or 8 * dtype.itemsize
    return REGISTER_BITS // bits


class Lanes(types.Type):
    """``width`` numbers of type ``dtype`` (numba's float32 or float64) in one vector."""

    def __init__(self, dtype: types.Float, width: int) -> None:
        self.dtype, self.width = dtype, width
        super().__init__(name=f"lanes({dtype}, {width})")

    @property
    def vector(self) -> ir.VectorType:
        """The LLVM type."""
        return ir.VectorType(_find_type(self.dtype), self.width)


def _find_type(dtype: types.Float) -> ir.Type:
    return ir.FloatType() if dtype is types.float32 else ir.DoubleType()


@register_model(Lanes)
class LanesModel(models.PrimitiveModel):
    """Held in a register as it is."""

    def __init__(self, manager: Any, lanes: Lanes) -> None:
        super().__init__(manager, lanes, lanes.vector)


def _broadcast(builder: ir.IRBuilder, number: ir.Value, lanes: Lanes) -> ir.Value:
    """The same number in every lane, in the lanes' precision."""
    scalar = _find_type(lanes.dtype)
    if number.type != scalar:
        cast = builder.fptrunc if isinstance(scalar, ir.FloatType) else builder.fpext
        number = cast(number, scalar)
    first = builder.insert_element(
        ir.Constant(lanes.vector, ir.Undefined), number, ir.Constant(ir.IntType(32), 0)
    )
    return _shuffle(builder, first, first, [0] * lanes.width)


def _shuffle(builder: ir.IRBuilder, a: ir.Value, b: ir.Value, lanes: Sequence[int]) -> ir.Value:
    mask = ir.Constant(ir.VectorType(ir.IntType(32), len(lanes)), list(lanes))
    return builder.shuffle_vector(a, b, mask)


def _register_operator(symbol: Callable[..., Any], instruction: str) -> None:
    """Teach numba ``lanes (symbol) lanes`` and both mixtures with a plain number."""

    class Typing(AbstractTemplate):
        key = symbol

        def generic(self, args: Any, kws: Any) -> Any:
            lanes = [arg for arg in args if isinstance(arg, Lanes)]
            if len(args) == 2 and lanes and all(isinstance(a, (Lanes, types.Float)) for a in args):
                return signature(lanes[0], *args)
            return None

    infer_global(symbol)(Typing)

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        a, b = (
            value if isinstance(kind, Lanes) else _broadcast(builder, value, sig.return_type)
            for value, kind in zip(args, sig.args, strict=True)
        )
        return getattr(builder, instruction)(a, b)

    for left, right in ((Lanes, Lanes), (Lanes, types.Float), (types.Float, Lanes)):
        lower_builtin(symbol, left, right)(lower)


for _symbol, _instruction in (
    (operator.add, "fadd"),
    (operator.sub, "fsub"),
    (operator.mul, "fmul"),
    (operator.truediv, "fdiv"),
):
    _register_operator(_symbol, _instruction)


def _make_pointer(context: Any, builder: Any, kind: types.Array, array: Any, offset: Any) -> Any:
    """Address of element ``offset`` of a contiguous array, whatever its shape."""
    data = context.make_array(kind)(context, builder, array).data
    return builder.gep(data, [offset], inbounds=True)


def _cast_pointer(builder: Any, pointer: Any, number: ir.Type, width: int) -> Any:
    return builder.bitcast(pointer, ir.VectorType(number, width).as_pointer())


def _load_node_rows(context: Any, builder: Any, kind: Any, array: Any, at: list[Any]) -> list[Any]:
    """The vectors of four numbers that begin at the elements ``at`` of an array."""
    number, size = _find_type(kind.dtype), kind.dtype.bitwidth // 8
    pointers = [_make_pointer(context, builder, kind, array, offset) for offset in at]
    return [builder.load(_cast_pointer(builder, p, number, 4), align=4 * size) for p in pointers]


def _join_rows(builder: Any, rows: list[Any]) -> list[Any]:
    """Four vectors, the i-th made of the rows i, 4 + i, 8 + i, ... one after the other."""
    four = []
    for i in range(4):
        parts = rows[i::4]
        while len(parts) > 1:
            n = parts[0].type.count
            parts = [
                _shuffle(builder, a, b, range(2 * n))
                for a, b in zip(parts[::2], parts[1::2], strict=True)
            ]
        four.append(parts[0])
    return four


def _transpose(builder: Any, r: list[Any]) -> list[Any]:
    """Transpose the 4 x 4 block of every group of four lanes, by the CPU's own unpack moves."""
    width = r[0].type.count

    def mix(a: Any, b: Any, *picks: int) -> Any:
        # a pick p < 4 is number p of a group of the first vector, else p - 4 of the second
        lanes = [g + (p if p < 4 else width + p - 4) for g in range(0, width, 4) for p in picks]
        return _shuffle(builder, a, b, lanes)

    if r[0].type.element == ir.DoubleType():
        low, high = (0, 4, 2, 6), (1, 5, 3, 7)
    else:
        low, high = (0, 4, 1, 5), (2, 6, 3, 7)
    a, b = mix(r[0], r[1], *low), mix(r[0], r[1], *high)
    c, d = mix(r[2], r[3], *low), mix(r[2], r[3], *high)
    front, back = (0, 1, 4, 5), (2, 3, 6, 7)
    if r[0].type.element == ir.DoubleType():
        return [mix(a, c, *front), mix(b, d, *front), mix(a, c, *back), mix(b, d, *back)]
    return [mix(a, c, *front), mix(a, c, *back), mix(b, d, *front), mix(b, d, *back)]


def _load_corners(
    context: Any, builder: Any, kind: Any, array: Any, block: Any, width: int, *, again: bool
) -> list[list[Any]]:
    """``corners[corner][lane]``: where a block's nodes begin in a nodal array.

    With ``again`` they are read from memory a second time, which costs less than to keep
    them through the stress with no register to spare.
    """
    if again:  # an empty instruction that may have changed memory: nothing read before is kept
        nothing = ir.FunctionType(ir.VoidType(), [])
        builder.asm(nothing, "", "~{memory}", [], side_effect=True)
    start = builder.mul(block, block.type(4 * width))
    corners = []
    for corner in range(4):
        lanes = []
        for lane in range(width):
            at = builder.add(start, start.type(corner * width + lane))
            number = builder.load(_make_pointer(context, builder, kind, array, at))
            lanes.append(builder.sext(number, ir.IntType(64)))
        corners.append(lanes)
    return corners


@intrinsic
def load_lanes(typingctx: Any, array: Any, offset: Any) -> Any:
    """`count_lane` numbers of a contiguous array from element ``offset`` on."""
    width = count_lane(array.dtype)

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        pointer = _make_pointer(context, builder, array, args[0], args[1])
        vector = _cast_pointer(builder, pointer, _find_type(array.dtype), width)
        return builder.load(vector, align=array.dtype.bitwidth // 8)

    return signature(Lanes(array.dtype, width), array, types.intp), codegen


@intrinsic
def align_stack(typingctx: Any) -> Any:
    """Align the stack of the function that calls this for vector registers.

    LLVM decides on the frame before it knows that it will have to spill registers, and spills
    them to wherever the caller's stack happens to be: in half of all processes every second
    spill then straddles two cache lines.  A variable that wants to be aligned makes it decide
    otherwise.
    """

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        place = cgutils.alloca_once(builder, ir.VectorType(ir.DoubleType(), 4))
        place.align = REGISTER_BITS // 8
        keep = ir.FunctionType(ir.VoidType(), [place.type])
        builder.asm(keep, "", "r,~{memory}", [place], side_effect=True)
        return context.get_dummy_value()

    return signature(types.void), codegen


@intrinsic
def load_row(typingctx: Any, array: Any, offset: Any) -> Any:
    """The four numbers of one node, from element ``offset`` (a multiple of 4) on."""

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return _load_node_rows(context, builder, array, args[0], [args[1]])[0]

    return signature(Lanes(array.dtype, 4), array, types.intp), codegen


@intrinsic
def store_row(typingctx: Any, array: Any, offset: Any, row: Any) -> Any:
    """Write the four numbers of one node."""

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        pointer = _make_pointer(context, builder, array, args[0], args[1])
        vector = _cast_pointer(builder, pointer, _find_type(array.dtype), 4)
        builder.store(args[2], vector, align=array.dtype.bitwidth // 2)
        return context.get_dummy_value()

    return signature(types.void, array, types.intp, row), codegen


@intrinsic
def clear_row(typingctx: Any, array: Any, offset: Any) -> Any:
    """Set the four numbers of one node to zero."""

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        pointer = _make_pointer(context, builder, array, args[0], args[1])
        vector = _cast_pointer(builder, pointer, _find_type(array.dtype), 4)
        builder.store(
            ir.Constant(vector.type.pointee, None), vector, align=array.dtype.bitwidth // 2
        )
        return context.get_dummy_value()

    return signature(types.void, array, types.intp), codegen


@intrinsic
def make_zero_lanes(typingctx: Any, array: Any) -> Any:
    """Zero in every lane, in the precision of ``array``."""
    lanes = Lanes(array.dtype, count_lane(array.dtype))

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return ir.Constant(lanes.vector, None)

    return signature(lanes, array), codegen


@intrinsic
def gather_edges(typingctx: Any, vectors: Any, corners: Any, block: Any) -> Any:
    """Nodal vectors of corners 1, 2, 3 less that of corner 0: nine lanes (1x, 1y, ... 3z)."""
    width = count_lane(vectors.dtype)

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        at = _load_corners(context, builder, corners, args[1], args[2], width, again=False)
        rows = [
            _join_rows(builder, _load_node_rows(context, builder, vectors, args[0], corner))
            for corner in at
        ]
        out: list[Any] = []
        for corner in rows[1:]:
            edge = [builder.fsub(a, b) for a, b in zip(corner, rows[0], strict=True)]
            out += _transpose(builder, edge)[:3]
        return context.make_tuple(builder, sig.return_type, out)

    nine = types.UniTuple(Lanes(vectors.dtype, width), 9)
    return signature(nine, vectors, corners, types.intp), codegen


@intrinsic
def scatter_pulls(
    typingctx: Any, forces: Any, corners: Any, block: Any, shift: Any, pulls: Any, viscous: Any
) -> Any:
    """Subtract nine lanes of pulls from corners 1, 2, 3 and add their sum to corner 0.

    ``shift`` is added to the place of a node: ``forces`` may hold a window of the nodes only.
    Elements of a block that share a node are added one after the other.  ``viscous`` is the
    kernel's: with viscosity in double precision no register is left to keep the places in.
    """
    width = count_lane(forces.dtype)
    again = forces.dtype is types.float64 and not isinstance(viscous, types.NoneType)

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        at = _load_corners(context, builder, corners, args[1], args[2], width, again=again)
        number, size = _find_type(forces.dtype), forces.dtype.bitwidth // 8
        base = _make_pointer(context, builder, forces, args[0], args[3])
        pull = cgutils.unpack_tuple(builder, args[4], 9)
        nought = ir.Constant(pull[0].type, None)
        rows = [_transpose(builder, [*pull[k : k + 3], nought]) for k in (0, 3, 6)]
        sums = [builder.fadd(builder.fadd(a, b), c) for a, b, c in zip(*rows, strict=True)]
        for lane in range(width):
            group = range(lane // 4 * 4, lane // 4 * 4 + 4)
            for corner, change in enumerate((sums, *rows)):
                vector = _cast_pointer(
                    builder, builder.gep(base, [at[corner][lane]], inbounds=True), number, 4
                )
                row = _shuffle(builder, change[lane % 4], change[lane % 4], group)
                before = builder.load(vector, align=4 * size)
                combine = builder.fsub if corner else builder.fadd
                builder.store(combine(before, row), vector, align=4 * size)
        return context.get_dummy_value()

    kinds = (forces, corners, types.intp, types.intp, pulls, viscous)
    return signature(types.void, *kinds), codegen


@intrinsic
def mark_not_positive(typingctx: Any, values: Any) -> Any:
    """1 in every lane whose value is not above zero (NaN is not), else 0."""

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        nought = ir.Constant(values.vector, None)
        one = _broadcast(builder, ir.Constant(_find_type(values.dtype), 1.0), values)
        return builder.select(builder.fcmp_unordered("<=", args[0], nought), one, nought)

    return signature(values, values), codegen


@intrinsic
def sum_lanes(typingctx: Any, values: Any) -> Any:
    """Sum over the lanes, in double precision."""

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        total = ir.Constant(ir.DoubleType(), 0.0)
        for lane in range(values.width):
            one = builder.extract_element(args[0], ir.IntType(32)(lane))
            if one.type != ir.DoubleType():
                one = builder.fpext(one, ir.DoubleType())
            total = builder.fadd(total, one)
        return total

    return signature(types.float64, values), codegen
