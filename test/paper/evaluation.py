"""Numbers from the transcribed equations, and whether one vanishes."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import mpmath
import sympy as sp


def plain(expression: Any) -> Any:
    """Return ``expression`` with x(t), x'(t), x''(t) replaced by plain symbols x, x_dot, x_ddot."""
    found = expression.atoms(sp.Derivative) | expression.atoms(sp.core.function.AppliedUndef)
    table = {}
    for item in found:
        if isinstance(item, sp.Derivative):
            order = item.derivative_count
            table[item] = sp.Symbol(f"{item.expr.func.__name__}_{'d' * order}ot", real=True)
        else:
            table[item] = sp.Symbol(item.func.__name__, real=True)
    return expression.xreplace(table)


def evaluator(expression: Any) -> Callable[[Mapping[str, float]], list[float]]:
    """Return a function {name: float} -> values of ``expression`` (row by row), computed with 40 digits."""
    rows = plain(sp.Matrix(expression if isinstance(expression, sp.MatrixBase | Sequence) else [expression]))
    arguments = sorted(rows.free_symbols, key=lambda symbol: symbol.name)
    compute = sp.lambdify(arguments, list(rows), modules="mpmath")

    def evaluate(values: Mapping[str, float]) -> list[float]:
        missing = [argument.name for argument in arguments if argument.name not in values]
        if missing:
            raise KeyError(f"no value for {missing}")
        with mpmath.workdps(40):
            return [float(item) for item in compute(*(mpmath.mpf(values[a.name]) for a in arguments))]

    return evaluate


def zero(expression: Any) -> bool:
    """Say whether ``expression`` (scalar or matrix) vanishes identically."""
    rows = sp.Matrix(expression if isinstance(expression, sp.MatrixBase | Sequence) else [expression])
    return all(sp.expand(item) == 0 or sp.simplify(item) == 0 for item in rows)
