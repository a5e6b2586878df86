"""The sum over the rows of a vertex' neighbors, written in LLVM's instructions: half of the time of a sweep.

Two things slow a compiled loop over neighbors down: the number of neighbors differs from vertex to vertex, so that the
processor predicts the end of every second loop wrongly, and the three coordinates are added one by one. Here eight
neighbors are read in any case, the first one in place of those that a vertex does not have, which is subtracted again;
and two coordinates are added by one instruction, which every processor of 64 bits has.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

#: Neighbors that are added without a loop; nearly every vertex has no more.
UNROLLED = 8

# Every vertex has a neighbor.
_LEAST = 1

_INDEX, _LANE, _NUMBER = ir.IntType(64), ir.IntType(32), ir.DoubleType()
_PAIR = ir.VectorType(_NUMBER, 2)
_CONTRACT = ("contract",)  # to a fused multiply-add


@intrinsic  # type: ignore[untyped-decorator]
def sum_first_rows(typing: Any, k: Any, count: Any, indices: Any, X: Any) -> Any:
    """The sums of X[indices[k]], ..., at most :data:`UNROLLED` of the ``count`` rows, as three float64.

    Parameters
    ----------
    k, count : unsigned integer
        ``count`` is at least 1.
    indices : array of uint32
    X : (n, 3) array of float64, C order
    """
    del typing
    signature = types.UniTuple(types.float64, 3)(k, count, indices, X)
    return signature, _generate


def _generate(context: Any, builder: ir.IRBuilder, signature: Any, arguments: Any) -> Any:
    first, count = (_widen(builder, each) for each in arguments[:2])
    indices, rows = (
        context.make_array(kind)(context, builder, value).data
        for kind, value in zip(signature.args[2:], arguments[2:], strict=True)
    )

    def load(t: int) -> tuple[Any, Any]:
        """A pair and a number: the coordinates of the neighbor t, or of the first where there is none."""
        at = builder.add(first, _INDEX(t))
        if t >= _LEAST:
            at = builder.select(builder.icmp_unsigned(">", count, _INDEX(t)), at, first)
        row = builder.mul(_widen(builder, builder.load(builder.gep(indices, [at]))), _INDEX(3))
        pair = builder.load(builder.bitcast(builder.gep(rows, [row]), _PAIR.as_pointer()), align=8)
        return pair, builder.load(builder.gep(rows, [builder.add(row, _INDEX(2))]))

    terms = [load(t) for t in range(UNROLLED)]
    extra = terms[0]
    while len(terms) > 1:  # by pairs, so that additions do not wait for each other
        terms = [
            (builder.fadd(a[0], b[0]), builder.fadd(a[1], b[1])) for a, b in zip(terms[::2], terms[1::2], strict=True)
        ]
    missing = builder.select(
        builder.icmp_unsigned("<", count, _INDEX(UNROLLED)), builder.sub(_INDEX(UNROLLED), count), _INDEX(0)
    )
    times = builder.uitofp(missing, _NUMBER)
    twice = ir.Constant(_PAIR, ir.Undefined)
    for lane in range(2):
        twice = builder.insert_element(twice, times, _LANE(lane))
    pair = builder.fsub(terms[0][0], builder.fmul(extra[0], twice, flags=_CONTRACT), flags=_CONTRACT)
    third = builder.fsub(terms[0][1], builder.fmul(extra[1], times, flags=_CONTRACT), flags=_CONTRACT)
    sums = [*(builder.extract_element(pair, _LANE(lane)) for lane in range(2)), third]
    return context.make_tuple(builder, signature.return_type, sums)


def _widen(builder: ir.IRBuilder, value: Any) -> Any:
    return value if value.type.width == _INDEX.width else builder.zext(value, _INDEX)
