"""Stamps of messages as integer nanoseconds."""

from builtin_interfaces.msg import Time

NANOSECONDS = 1_000_000_000


def stamp_ns(stamp: Time) -> int:
    """Return a message stamp as integer nanoseconds."""
    return int(stamp.sec) * NANOSECONDS + int(stamp.nanosec)


def set_stamp(stamp: Time, nanoseconds: int) -> None:
    """Write integer nanoseconds into a message stamp."""
    stamp.sec, stamp.nanosec = divmod(nanoseconds, NANOSECONDS)
