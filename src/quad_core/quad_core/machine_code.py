"""Programs run by machine code that Numba made before; what runs it needs neither Numba nor a compiler.

All values of a program lie in one block of eight-byte numbers: that is what the machine code gets, so that nothing is
handed over but what the node looks at.
"""

import ctypes
import math
import struct
from collections.abc import Callable, Mapping
from pathlib import Path
from types import FunctionType
from typing import Any, NamedTuple

from quad_core.program import NUMBERS, Interpreted, Program, Stepper, field_kinds, flattener, leaves
from quad_core.sources import cache_root, source_hash

_CODES = {float: "d", int: "q", bool: "?7x"}
_CELL = 8


def offsets(program: Program) -> dict[str, int]:
    """Return at which number of the block each slot begins, and behind the name "" how many there are."""
    found, at = {}, 0
    for name, kind in program.slots.items():
        found[name] = at
        at += len(leaves(kind))
    return {**found, "": at}


def library_path(program: Program) -> Path:
    """Return where the machine code of a program is kept; the name changes with every source file that it reaches.

    Raises TypeError for what is no plain function or no value of numbers, OSError for a function without a source file.
    """
    calls = [(entry, call) for entry, called in program.entries.items() for call in called]
    for _, call in calls:
        if not isinstance(call.function, FunctionType):
            raise TypeError(f"{program.name}: found {call.function!r}, expected a plain function")
    text = " ".join(
        f"{entry}:{call.function.__module__}.{call.function.__qualname__}{call.takes}{call.gives}"
        for entry, call in calls
    )
    slots = " ".join(
        f"{name}:{kind.__module__}.{kind.__qualname__}{leaves(kind)}" for name, kind in program.slots.items()
    )
    builder = Path(__file__).with_name("machine_code_build.py")
    key = source_hash([call.function for _, call in calls], (Path(__file__), builder), f"{slots} {text}")
    return cache_root() / "machine_code" / f"{program.name}-{key}.so"


def stepper(program: Program, wanted: bool, start: Mapping[str, Any]) -> Stepper:
    """Return the program with values ``start``: as machine code if that is ``wanted`` and built, else interpreted."""
    if wanted:
        try:
            path = library_path(program)
            if path.is_file():
                return _started(MachineCode(program, path), start)
        except (OSError, TypeError, struct.error):  # no library, none that loads, or values of other types
            pass
    return _started(Interpreted(program), start)


def _started(runner: Stepper, start: Mapping[str, Any]) -> Stepper:
    for name, value in start.items():
        runner.put(name, value)
    return runner


class _Slot(NamedTuple):
    """Where a slot lies in the block (bytes), and how its value goes there and comes back."""

    start: int
    end: int
    form: struct.Struct
    flat: Callable[[Any], tuple[Any, ...]]
    make: Callable[[tuple[Any, ...]], Any]


class MachineCode:
    """A program run by machine code."""

    def __init__(self, program: Program, path: Path) -> None:
        """Load it; all values are zero. Raises OSError if it cannot be loaded."""
        begins = offsets(program)
        self._block = bytearray(_CELL * begins[""])
        self._view = memoryview(self._block)
        self._slots = {name: _slot(kind, begins[name]) for name, kind in program.slots.items()}
        # what Numba's calling convention has besides: a result and an error, neither of which there is
        self._unused = (ctypes.c_void_p * 2)()
        pointers = (self._unused, ctypes.byref(self._unused, ctypes.sizeof(ctypes.c_void_p)))
        block = (ctypes.c_char * len(self._block)).from_buffer(self._block)
        self._arguments = (*(ctypes.cast(pointer, ctypes.c_void_p) for pointer in pointers), ctypes.byref(block))
        # PyDLL: giving the interpreter's lock away and taking it again costs more than the call
        library = ctypes.PyDLL(str(path))
        self._entries = {}
        for name in program.entries:
            entry = getattr(library, name)
            entry.restype = ctypes.c_int
            self._entries[name] = entry

    def put(self, name: str, value: Any) -> None:
        """Set a value."""
        slot = self._slots[name]
        slot.form.pack_into(self._block, slot.start, *slot.flat(value))

    def get(self, name: str) -> Any:
        """Return a value."""
        slot = self._slots[name]
        return slot.make(slot.form.unpack_from(self._block, slot.start))

    def numbers(self, name: str) -> tuple[Any, ...]:
        """Return the numbers of a value in the order of ``leaves``."""
        slot = self._slots[name]
        return slot.form.unpack_from(self._block, slot.start)

    def run(self, entry: str) -> None:
        """Make the calls of one entry."""
        if self._entries[entry](*self._arguments):
            raise RuntimeError(f"{entry}: the machine code failed")

    def copy(self, source: str, target: str) -> None:
        """Set ``target`` to the value of ``source``."""
        there, here = self._slots[target], self._slots[source]
        self._view[there.start : there.end] = self._view[here.start : here.end]

    def is_finite(self, name: str) -> bool:
        """Tell whether every number of a value is finite."""
        slot = self._slots[name]
        found = slot.form.unpack_from(self._block, slot.start)
        return math.isfinite(sum(found)) or all(map(math.isfinite, found))


def _slot(kind: type[Any], at: int) -> _Slot:
    form = struct.Struct("<" + "".join(_CODES[leaf.kind] for leaf in leaves(kind)))
    start = _CELL * at
    return _Slot(start, start + form.size, form, flattener(kind), _maker(kind))


def _maker(kind: type[Any]) -> Callable[[tuple[Any, ...]], Any]:
    """Return a function from the numbers of a value to it."""
    if kind in NUMBERS:
        return lambda flat: flat[0]
    make = kind._make
    plan: list[tuple[Callable[[tuple[Any, ...]], Any] | None, int, int]] = []
    at = 0
    for inner in field_kinds(kind).values():
        width = len(leaves(inner))
        plan.append((None if inner in NUMBERS else _maker(inner), at, at + width))
        at += width
    if all(inner is None for inner, _, _ in plan):
        return make  # type: ignore[no-any-return]
    return lambda flat: make([flat[at] if inner is None else inner(flat[at:end]) for inner, at, end in plan])
