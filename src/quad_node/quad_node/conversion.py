"""Between the NamedTuples of ``quad_core.types`` and the messages of the same field names."""

from collections.abc import Callable
from typing import Any

from builtin_interfaces.msg import Time

from quad_core.records import field_kinds, leaves

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
    return [leaf.name for leaf in leaves(cls) if leaf.name.partition(".")[0] not in known]


def _fields(cls: type[Any], message_type: type[Any]) -> tuple[tuple[tuple[str, Any], ...], tuple[str, ...]]:
    known = message_type.get_fields_and_field_types()
    hints = field_kinds(cls)
    shared = [name for name in cls._fields if name in known]
    groups = tuple((name, hints[name]) for name in shared if hasattr(hints[name], "_fields"))
    return groups, tuple(name for name in shared if not hasattr(hints[name], "_fields"))
