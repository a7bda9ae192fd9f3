"""How a node's process is run by Python and by the operating system, so that a flight in real time is punctual."""

import gc
import os
from contextlib import suppress
from pathlib import Path

_TASKS = Path("/proc/self/task")


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
