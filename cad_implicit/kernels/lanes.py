"""Several numbers at once: a formula over the rows of a table, compiled to vector instructions.

The compiler leaves loops of four or eight turns as they are: it unrolls the short ones, and for longer bodies it would
have to check first that input and output do not overlap. A formula here is one Python function of rows and numbers; it
runs on lanes of a processor's register when compiled and on NumPy arrays without compilation.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic


class _Lanes:
    """A value in each lane, while code is made for it."""

    def __init__(self, builder: Any, value: Any) -> None:
        self.builder, self.value = builder, value

    def _number(self, other: Any) -> Any:
        """Give the lanes of another value; a plain number in all of them."""
        if isinstance(other, _Lanes):
            return other.value
        return ir.Constant(self.value.type, [float(other)] * self.value.type.count)

    def _apply(self, operation: str, one: Any, other: Any) -> _Lanes:
        return _Lanes(self.builder, getattr(self.builder, operation)(one, other))

    def __add__(self, other: Any) -> _Lanes:
        return self._apply("fadd", self.value, self._number(other))

    def __sub__(self, other: Any) -> _Lanes:
        return self._apply("fsub", self.value, self._number(other))

    def __rsub__(self, other: Any) -> _Lanes:
        return self._apply("fsub", self._number(other), self.value)

    def __mul__(self, other: Any) -> _Lanes:
        return self._apply("fmul", self.value, self._number(other))

    def __truediv__(self, other: Any) -> _Lanes:
        return self._apply("fdiv", self.value, self._number(other))

    def __rmul__(self, other: Any) -> _Lanes:
        return self._apply("fmul", self.value, self._number(other))

    def __gt__(self, other: Any) -> _Lanes:
        return _Lanes(self.builder, self.builder.fcmp_ordered(">", self.value, self._number(other)))


def larger(one: Any, other: Any) -> Any:
    """Larger of two values in each lane."""
    return np.maximum(one, other) if not isinstance(one, _Lanes) else choose(one > other, one, other)


def smaller(one: Any, other: Any) -> Any:
    """Smaller of two values in each lane."""
    if not isinstance(one, _Lanes):
        return np.minimum(one, other)
    return choose(one > other, _Lanes(one.builder, one._number(other)), one)


def choose(condition: Any, one: Any, other: Any) -> Any:
    """One value where a condition holds, the other elsewhere."""
    if not isinstance(condition, _Lanes):
        return np.where(condition, one, other)
    return _Lanes(condition.builder, condition.builder.select(condition.value, one.value, one._number(other)))


def root(value: Any) -> Any:
    """Square root in each lane."""
    if not isinstance(value, _Lanes):
        return np.sqrt(value)
    kind = value.value.type
    name = f"llvm.sqrt.v{kind.count}f{32 if isinstance(kind.element, ir.FloatType) else 64}"
    function = value.builder.module.declare_intrinsic(name, fnty=ir.FunctionType(kind, [kind]))
    return _Lanes(value.builder, value.builder.call(function, [value.value]))


def _everywhere(builder: Any, kind: Any, number: Any) -> Any:
    """Put a number in all lanes of a vector type."""
    one = builder.insert_element(ir.Constant(kind, ir.Undefined), number, ir.IntType(32)(0))
    mask = ir.Constant(ir.VectorType(ir.IntType(32), kind.count), [0] * kind.count)
    return builder.shuffle_vector(one, ir.Constant(kind, ir.Undefined), mask)


def lanes(count: int) -> Callable[[Callable[..., Any]], Any]:
    """Make a kernel ``f(table, x, y, z, out)`` of a formula ``f(rows, x, y, z)``; a decorator.

    ``table`` (R, count) and ``out`` (count,) are contiguous arrays of the same type as the numbers.
    """

    def decorate(formula: Callable[..., Any]) -> Any:
        if numba.config.DISABLE_JIT:

            def plain(table: Any, x: Any, y: Any, z: Any, out: Any) -> None:
                out[:] = formula(table, x, y, z)

            return plain

        def compiled(typing: Any, table: Any, x: Any, y: Any, z: Any, out: Any) -> Any:
            def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
                element = context.get_value_type(table.dtype)
                kind, wide = ir.VectorType(element, count), ir.VectorType(element, count).as_pointer()
                size = table.dtype.bitwidth // 8
                source, target = (
                    context.make_array(array)(context, builder, value).data
                    for array, value in ((table, arguments[0]), (out, arguments[4]))
                )

                class Rows:
                    def __getitem__(self, row: int) -> _Lanes:
                        place = builder.gep(source, [ir.Constant(ir.IntType(64), row * count)])
                        return _Lanes(builder, builder.load(builder.bitcast(place, wide), align=size))

                x, y, z = (_Lanes(builder, _everywhere(builder, kind, number)) for number in arguments[1:4])
                result = formula(Rows(), x, y, z)
                builder.store(result.value, builder.bitcast(target, wide), align=size)
                return context.get_dummy_value()

            return types.void(table, x, y, z, out), generate

        compiled.__name__ = formula.__name__
        return intrinsic(compiled)

    return decorate


def _python_only(function: Callable[..., Any]) -> Callable[[Any], Any]:
    """Keep the given Python function instead of an intrinsic where nothing is compiled; makes a decorator."""
    return lambda compiled: function if numba.config.DISABLE_JIT else intrinsic(compiled)


@_python_only(lambda values, limit: sum(1 << c for c in range(len(values)) if values[c] <= limit))
def bits_below(typing: Any, values: Any, limit: Any) -> Any:
    """Bit c is set where number c of an array of eight, as :func:`lanes` makes them, is at most ``limit``."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        element = context.get_value_type(values.dtype)
        source = context.make_array(values)(context, builder, arguments[0]).data
        wide = ir.VectorType(element, 8)
        row = builder.load(builder.bitcast(source, wide.as_pointer()), align=values.dtype.bitwidth // 8)
        condition = builder.fcmp_ordered("<=", row, _everywhere(builder, wide, arguments[1]))
        return builder.zext(builder.bitcast(condition, ir.IntType(8)), ir.IntType(64))

    return types.int64(values, limit), generate


@_python_only(lambda bits: (bits & -bits).bit_length() - 1)
def lowest_bit(typing: Any, bits: Any) -> Any:
    """Place of the lowest bit that is set, of a number other than 0."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.cttz(arguments[0], ir.Constant(ir.IntType(1), 1))

    return types.int64(bits), generate
