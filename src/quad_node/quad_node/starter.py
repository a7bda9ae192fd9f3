"""The process that started a flight and looks after it: a node that it started ends with it."""

import os
from pathlib import Path

STARTER = "QUAD_FLIGHT_STARTER"
"""Environment variable with the pid of the process that started the flight and looks after it."""
STARTER_GONE = "the process that started the flight is gone"


class Starter:
    """The process that started the flight and looks after it, if one did."""

    def __init__(self) -> None:
        """Note who it is."""
        named = os.environ.get(STARTER, "")
        self.pid, self._parent = int(named) if named.isdecimal() else 0, os.getppid()

    def is_gone(self) -> bool:
        """Return whether it is gone, or the script by which it started this process."""
        return bool(self.pid) and (os.getppid() != self._parent or not Path("/proc", str(self.pid)).exists())
