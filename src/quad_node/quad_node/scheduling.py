"""How a node's process is run by Python and by the operating system, so that a flight in real time is punctual."""

import gc
import os
from contextlib import suppress
from pathlib import Path

_TASKS = Path("/proc/self/task")


def settle(priority: int) -> str:
    """Ready this process for a flight; returns why the system refused, empty if it did not.

    ``priority``: of SCHED_FIFO for all threads of the process, for who only logs must not delay a loop; 0: as it is.
    """
    # What was made so far stays for the flight: collecting it again and again costs stalls of milliseconds.
    gc.collect()
    gc.freeze()
    if priority <= 0:
        return ""
    if not (hasattr(os, "sched_setscheduler") and _TASKS.is_dir()):
        return "this system has no SCHED_FIFO"
    try:
        for task in _TASKS.iterdir():
            with suppress(ProcessLookupError):  # a thread that has just ended
                os.sched_setscheduler(int(task.name), os.SCHED_FIFO, os.sched_param(priority))
    except PermissionError:
        return f"SCHED_FIFO {priority}: not permitted, see ulimit -r"
    return ""
