"""Machine code for a node's pure functions, where it was built; never silently less than was asked for."""

from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

from quad_msgs.msg import FlightEvent
from quad_node.flight_node import FlightNode

PYTHON, NATIVE = "python", "native"


def native_or_python(node: FlightNode, function: Callable[..., Any]) -> tuple[Callable[..., Any], str]:
    """Return what runs ``function`` and its name; a library that is there but refused is an event of ``node``."""
    if not node.flight.machine_code or find_spec("quad_native") is None:
        return function, PYTHON
    from quad_native import NativeError, native  # an optional package

    try:
        found = native(function)
    except NativeError as error:
        node.event(FlightEvent.WARNING, "machine_code_refused", f"{error}; CPython runs {function.__name__}")
        return function, PYTHON
    return (found, NATIVE) if found is not None else (function, PYTHON)


def native_step(node: FlightNode, module: Any) -> tuple[Callable[..., Any], str]:
    """Return what runs the ``step`` of a law's module and its name; of a predicted law each part on its own."""
    if not hasattr(module, "PARTS"):
        return native_or_python(node, module.step)
    parts = [native_or_python(node, part) for part in module.PARTS]
    return module.assembled(*(function for function, _ in parts)), parts[-1][1]
