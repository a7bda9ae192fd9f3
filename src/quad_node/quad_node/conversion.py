"""Between the NamedTuples of ``quad_core.types`` and the messages of the same field names."""

from collections.abc import Callable
from typing import Any, get_type_hints

from builtin_interfaces.msg import Time

NANOSECONDS = 1_000_000_000


def stamp_ns(stamp: Time) -> int:
    """Return a message stamp as integer nanoseconds."""
    return int(stamp.sec) * NANOSECONDS + int(stamp.nanosec)


def set_stamp(stamp: Time, nanoseconds: int) -> None:
    """Write integer nanoseconds into a message stamp."""
    stamp.sec, stamp.nanosec = divmod(nanoseconds, NANOSECONDS)


def reader(cls: type[Any], message_type: type[Any]) -> Callable[[Any], Any]:
    """Return a function that makes a ``cls`` from a message; raises TypeError if a field is missing there."""
    groups, scalars = _fields(cls, message_type)

    def read(message: Any) -> Any:
        values = {name: kind(*getattr(message, name).tolist()) for name, kind in groups}
        for name in scalars:
            values[name] = getattr(message, name)
        return cls(**values)

    return read


def extra_names(cls: type[Any], message_type: type[Any]) -> list[str]:
    """Return the names of the numbers that travel in ``extra``, in order."""
    known = message_type.get_fields_and_field_types()
    found: list[str] = []
    for name in cls._fields:
        if name not in known:
            kind = get_type_hints(cls)[name]
            parts = getattr(kind, "_fields", None)
            found += [f"{name}.{part}" for part in parts] if parts else [name]
    return found


def _fields(cls: type[Any], message_type: type[Any]) -> tuple[tuple[tuple[str, Any], ...], tuple[str, ...]]:
    known = message_type.get_fields_and_field_types()
    hints = get_type_hints(cls)
    shared = [name for name in cls._fields if name in known]
    groups = tuple((name, hints[name]) for name in shared if hasattr(hints[name], "_fields"))
    return groups, tuple(name for name in shared if not hasattr(hints[name], "_fields"))
