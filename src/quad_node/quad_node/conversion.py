"""Between the NamedTuples of ``quad_core.types`` and the messages of the same field names."""

import math
from array import array
from collections.abc import Callable
from typing import Any, get_type_hints

import numpy as np
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


def writer(cls: type[Any], message_type: type[Any]) -> Callable[[Any, Any], None]:
    """Return a function that writes a ``cls`` into a message, in place.

    Fields that the message has not go, in order, into its ``extra`` sequence. Raises TypeError if there is none.
    """
    known = message_type.get_fields_and_field_types()
    own = tuple(name for name in cls._fields if name not in known)
    if own and "extra" not in known:
        raise TypeError(f"{message_type.__name__} has no field {own[0]} of {cls.__name__}")
    groups, scalars = _fields(cls, message_type)
    blank = message_type()
    arrays = tuple(name for name, _ in groups if isinstance(getattr(blank, name), np.ndarray))
    lists = tuple(name for name, _ in groups if name not in arrays)

    def write(value: Any, message: Any) -> None:
        for name in arrays:
            getattr(message, name)[:] = getattr(value, name)
        for name in lists:
            setattr(message, name, list(getattr(value, name)))
        for name in scalars:
            setattr(message, name, getattr(value, name))
        if own:
            message.extra = array("d", _leaves(value, own))

    return write


def extra_names(cls: type[Any], message_type: type[Any]) -> list[str]:
    """Return the names of the numbers that ``writer`` puts into ``extra``, in order."""
    known = message_type.get_fields_and_field_types()
    found: list[str] = []
    for name in cls._fields:
        if name not in known:
            kind = get_type_hints(cls)[name]
            parts = getattr(kind, "_fields", None)
            found += [f"{name}.{part}" for part in parts] if parts else [name]
    return found


def all_finite(value: Any) -> bool:
    """Tell whether every number of a (nested) NamedTuple is finite."""
    return all(all_finite(part) if isinstance(part, tuple) else math.isfinite(part) for part in value)


def _fields(cls: type[Any], message_type: type[Any]) -> tuple[tuple[tuple[str, Any], ...], tuple[str, ...]]:
    known = message_type.get_fields_and_field_types()
    hints = get_type_hints(cls)
    shared = [name for name in cls._fields if name in known]
    groups = tuple((name, hints[name]) for name in shared if hasattr(hints[name], "_fields"))
    return groups, tuple(name for name in shared if not hasattr(hints[name], "_fields"))


def _leaves(value: Any, names: tuple[str, ...]) -> list[float]:
    flat: list[float] = []
    for name in names:
        part = getattr(value, name)
        flat += [float(number) for number in part] if isinstance(part, tuple) else [float(part)]
    return flat
