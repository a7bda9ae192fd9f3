"""A process that hangs in Fast DDS while it shuts down still ends, with the exit code of its flight.

Fast DDS 2.14 can hang for ever in the destructor of a participant when another participant leaves at the same moment:
it waits, with a time limit that overflows, for callbacks that need a lock which it holds. rclpy holds the interpreter's
lock meanwhile, so that neither a thread nor a signal handler of Python runs.
"""

import ctypes
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rclpy.node import Node

PATIENCE = 5  # s; destroying a node takes a tenth of one
_CLOCK_MONOTONIC, _SIGEV_THREAD = 1, 2


class _Event(ctypes.Structure):
    """Glibc's ``sigevent``: call ``function`` with ``value`` in a thread of its own."""

    _fields_ = (
        ("value", ctypes.c_longlong),
        ("signal", ctypes.c_int),
        ("notify", ctypes.c_int),
        ("function", ctypes.c_void_p),
        ("attributes", ctypes.c_void_p),
        ("padding", ctypes.c_char * 32),
    )


def destroy(node: Node, exit_code: int) -> None:
    """Destroy ``node``; a process that hangs meanwhile ends with ``exit_code``. No executor may spin it any more."""
    with limited(exit_code):
        node.destroy_node()


@contextmanager
def limited(exit_code: int, patience: int = PATIENCE) -> Iterator[None]:
    """End the process with ``exit_code`` if the body takes longer than ``patience`` s; only on Linux with glibc."""
    timer = ctypes.c_void_p()
    libc: Any = ctypes.CDLL(None) if sys.platform == "linux" else None
    armed = False
    if libc is not None and hasattr(libc, "timer_create"):
        end = ctypes.cast(libc._exit, ctypes.c_void_p)
        event = _Event(exit_code, 0, _SIGEV_THREAD, end)
        if libc.timer_create(_CLOCK_MONOTONIC, ctypes.byref(event), ctypes.byref(timer)) == 0:
            once = (ctypes.c_long * 4)(0, 0, patience, 0)
            armed = libc.timer_settime(timer, 0, ctypes.byref(once), None) == 0
    try:
        yield
    finally:
        if armed:
            libc.timer_delete(timer)
