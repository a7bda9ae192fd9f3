"""The process of a node: its scheduling, its executor, its signals and its end.

Fast DDS 2.14 can hang for ever in the destructor of a participant when another participant leaves at the same moment:
it waits, with a time limit that overflows, for callbacks that need a lock which it holds. rclpy holds the interpreter's
lock meanwhile, so that neither a thread nor a signal handler of Python runs. Therefore ``destroy`` has a limit.
"""

import ctypes
import gc
import os
import signal
import struct
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType

import rclpy
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future

from quad_core.command_line import ending, repeats
from quad_node.middleware import close_unless_asked

# Without a finite timeout the EventsExecutor of the rclpy wheels hangs; a day is longer than any flight.
SPIN_TIMEOUT = 86_400.0
_TASKS = Path("/proc/self/task")
PATIENCE = 5  # s; destroying a node takes a tenth of one
_CLOCK_MONOTONIC, _SIGEV_THREAD = 1, 2


def init(args: list[str]) -> str:
    """Initialise rclpy without its own signal handlers, so that a node can still publish after SIGINT.

    Closed unless the user has chosen otherwise. Returns a line that says who can see the nodes.
    """
    seen_by = close_unless_asked()
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    return seen_by


def on_signals(stop: "list[str]", done: Future, goes_on: Callable[[str], bool] | None = None) -> None:
    """Let SIGINT, SIGTERM and SIGHUP complete ``done``, one that is in ``stop`` already too; names go to ``stop``.

    The first signal does not if ``goes_on``, called with its name, returns true; nor do those that only repeat it.
    """
    goes_on_since: float | None = None

    def handler(number: int, _frame: FrameType | None) -> None:
        nonlocal goes_on_since
        if goes_on_since is not None and repeats(number, goes_on_since):
            return
        stop.append(signal.Signals(number).name)
        if goes_on is not None and len(stop) == 1 and goes_on(stop[0]):
            goes_on_since = time.monotonic()
            return
        if not done.done():
            done.set_result(None)

    for number in ending():
        signal.signal(number, handler)
    if stop and not done.done():
        done.set_result(None)


def settle(priority: int, aside: bool = False) -> str:
    """Ready this process for a flight; returns why the system refused, empty if it did not.

    ``priority``: of SCHED_FIFO for all threads of the process, 0: as it is. ``aside``: no node waits for this process;
    without a priority, a message that wakes it then does not take the core from its sender.
    """
    # What was made so far stays for the flight: collecting it again and again costs stalls of milliseconds.
    gc.collect()
    gc.freeze()
    refused = _schedule("SCHED_FIFO", priority) if priority > 0 else ""
    if aside and (refused or priority == 0):
        return _schedule("SCHED_BATCH", 0)
    return refused


def _schedule(policy: str, priority: int) -> str:
    if not (hasattr(os, policy) and _TASKS.is_dir()):
        return f"this system has no {policy}"
    try:
        for task in _TASKS.iterdir():
            with suppress(ProcessLookupError):  # a thread that has just ended
                os.sched_setscheduler(int(task.name), getattr(os, policy), os.sched_param(priority))
    except PermissionError:
        return f"{policy} {priority}: not permitted, see ulimit -r"
    return ""


def destroy(node: Node, exit_code: int) -> None:
    """Destroy ``node``; a process that hangs meanwhile ends with ``exit_code``. No executor may spin it any more."""
    with limited(exit_code):
        node.destroy_node()


@contextmanager
def limited(exit_code: int, patience: int = PATIENCE) -> Iterator[None]:
    """End the process with ``exit_code`` if the body takes longer than ``patience`` s, by a timer of glibc."""
    timer, libc = ctypes.c_void_p(), ctypes.CDLL(None)
    # struct sigevent of glibc: value, signal, notify, function, attributes
    event = struct.pack("qiiPP32x", exit_code, 0, _SIGEV_THREAD, ctypes.cast(libc._exit, ctypes.c_void_p).value, 0)
    once = (ctypes.c_long * 4)(0, 0, patience, 0)
    armed = libc.timer_create(_CLOCK_MONOTONIC, event, ctypes.byref(timer)) == 0
    armed = armed and libc.timer_settime(timer, 0, ctypes.byref(once), None) == 0
    try:
        yield
    finally:
        if armed:
            libc.timer_delete(timer)


STARTER = "QUAD_FLIGHT_STARTER"
"""Environment variable with the pid of the process that started the flight and looks after it."""
STARTER_GONE = "the process that started the flight is gone"


class Starter:
    """The process that started the flight and looks after it, if one did."""

    def __init__(self) -> None:
        named = os.environ.get(STARTER, "")
        self.pid, self._parent = int(named) if named.isdecimal() else 0, os.getppid()

    def is_gone(self) -> bool:
        """Return whether it is gone, or the script by which it started this process."""
        return bool(self.pid) and (os.getppid() != self._parent or not Path("/proc", str(self.pid)).exists())
