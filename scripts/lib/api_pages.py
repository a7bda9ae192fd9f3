"""The reference page of the Python API: signatures and docstrings of what scripts and notebooks call."""

import importlib
import inspect
import re
from collections.abc import Iterator
from typing import Any

HEAD = (
    "# Python API\n\nWhat a script or a notebook calls. These names and what they take stay until the first number of "
    "the version changes; all else may change with the second. Each is `from MODULE import NAME`. Set-up without ROS: "
    "[from Python](../how_to/use_from_python.md)."
)
PUBLIC = {
    "Fly": ("quad_flight.flight", ("from_names", "fly", "Flight", "Result")),
    "What a flight may be asked": ("quad_flight.set_up", ("Request",)),
    "What a flight is scored by": ("quad_flight.score", ("Score",)),
    "Fly many": ("quad_flight.many", ("sweep", "run_many")),
    "Read a bag": ("quad_flight_log.reader", ("open_flight", "Flight")),
    "Judge a bag": ("quad_analysis.metrics", ("flight_metrics", "FlightMetrics")),
    "Identify a vehicle": ("quad_identify.identify", ("identify",)),
    "What laws take and give": (
        "quad_core.types",
        ("PositionInputs", "AttitudeInputs", "Vec3", "VehicleState", "TrajectoryPoint", "AttitudeThrust", "Wrench"),
    ),
    "What a position law needs": ("quad_position_ctrl.se3", ("pointed",)),
}


def page() -> str:
    """Return docs/reference/api.md."""
    parts = [HEAD]
    for title, (module, names) in PUBLIC.items():
        parts.append(f"## {title}: `{module}`")
        for name in names:
            parts += entry(getattr(importlib.import_module(module), name), name)
    return "\n\n".join(parts) + "\n"


def entry(thing: Any, name: str) -> Iterator[str]:
    """Yield the paragraphs of a function, a record or a class."""
    yield f"### {name}"
    if inspect.isclass(thing):
        yield text(thing)
        if fields := getattr(thing, "_fields", ()):
            yield f"Fields: {', '.join(f'`{field}`' for field in fields)}."
        methods = [(n, m) for n, m in vars(thing).items() if not n.startswith("_") and is_documented(m)]
        if methods:
            yield "\n".join(f"- `{n}{signature(m)}`: {summary(m)}" for n, m in methods)
    else:
        yield f"```python\n{name}{signature(thing)}\n```"
        yield text(thing)


def is_documented(member: object) -> bool:
    """Return whether a member of a class is a method or a property with a docstring."""
    return (inspect.isfunction(member) or isinstance(member, property)) and bool(inspect.getdoc(member))


def signature(thing: Any) -> str:
    """Return the arguments as they are written, types without their modules; empty for a property."""
    if isinstance(thing, property):
        return ""
    written = str(inspect.signature(thing)).replace("(self, ", "(").replace("(self)", "()")
    written = re.sub(r"<function .*? at 0x\w+>", "...", written)
    return re.sub(r"(?:[a-z_]+\.)+(?=[A-Z])", "", written).replace("~", "")


def summary(thing: object) -> str:
    """Return the first paragraph of a docstring as one line of Markdown."""
    return " ".join(text(thing).partition("\n\n")[0].split())


def text(thing: object) -> str:
    """Return a docstring as Markdown."""
    return (inspect.getdoc(thing) or "").replace("``", "`")
