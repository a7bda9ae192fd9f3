"""Compile the very text of a pure function with Numba, callees included.

The nodes call a law as plain Python; the campaign calls the same source compiled. Numba gives the same bits as CPython
for floats, NamedTuples with all fields written out, ``x * x`` (``x ** 2`` differs), powers of non-negative numbers, and
guards before whatever raises in CPython and gives inf or NaN in Numba.
"""

import dis
from collections.abc import Callable
from types import CellType, FunctionType, ModuleType
from typing import Any

_COMPILED: dict[FunctionType, Any] = {}


def compiled(function: Callable[..., Any]) -> Any:
    """Return ``function`` compiled by Numba; every pure function that it names is compiled too.

    Raises numba.core.errors.NumbaError at the first call if the text cannot be compiled.
    """
    import numba

    if not isinstance(function, FunctionType):
        raise TypeError(f"cannot compile {function!r}: expected a plain function")
    if function not in _COMPILED:
        scope = dict(function.__globals__)
        for name in _globals_read(function):
            value = scope.get(name)
            if isinstance(value, FunctionType):
                scope[name] = compiled(value)
            elif isinstance(value, ModuleType) and value.__name__ != "math":
                raise TypeError(f"{function.__module__}.{function.__name__}: import functions from {name} by name")
        closure = tuple(CellType(_twin_of(cell.cell_contents)) for cell in function.__closure__ or ())
        twin = FunctionType(function.__code__, scope, function.__name__, function.__defaults__, closure)
        twin.__kwdefaults__ = function.__kwdefaults__
        twin.__module__ = function.__module__
        twin.__qualname__ = function.__qualname__
        _COMPILED[function] = numba.njit(twin, error_model="numpy", nogil=True, forceinline=True)
    return _COMPILED[function]


def _twin_of(value: Any) -> Any:
    return compiled(value) if isinstance(value, FunctionType) else value


def _globals_read(function: FunctionType) -> set[str]:
    # co_names also holds attribute names, which may equal the name of a function of the same module.
    return {str(step.argval) for step in dis.get_instructions(function) if step.opname == "LOAD_GLOBAL"}
