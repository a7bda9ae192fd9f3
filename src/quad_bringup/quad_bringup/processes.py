"""The node processes of one flight: started directly, watched, stopped by pid."""

import os
import signal
import subprocess
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from ament_index_python.packages import get_package_prefix

from quad_core.cascade import ALL_ROLES, SHADOW

# What is asked of a process in turn, and how long (s) it then has; SIGABRT leaves in its log where it hung.
_STOPS = ((signal.SIGINT, 4.0), (signal.SIGTERM, 8.0), (signal.SIGABRT, 1.0), (signal.SIGKILL, 2.0))
_SIMULATOR_FIRST = 3.0  # s in which the simulator tells the others why before they are asked, too


def installed(package: str, name: str) -> Path:
    """Return what ``ros2 run`` would start."""
    return Path(get_package_prefix(package), "lib", package, name)


def executable(role: str) -> Path:
    """Return the program of ``role``."""
    return installed(ALL_ROLES[role].package, role.removeprefix(SHADOW))


def describe_exit(code: int) -> str:
    """Return how a process ended, for people; ``code`` as subprocess gives it (negative: the signal)."""
    return f"ended with exit code {code}" if code >= 0 else f"was killed by {signal_name(-code)}"


def signal_name(number: int) -> str:
    """Return the name of a signal."""
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


def _signal(process: "subprocess.Popen[bytes]", number: signal.Signals) -> None:
    """Send a signal to a process and to those of its group: a script does not pass on what it gets."""
    if process.poll() is None:
        os.killpg(process.pid, number)


class Processes:
    """One process per role, its output in ``<logs>/<role>.log``."""

    def __init__(self, logs: Path, environment: Mapping[str, str]) -> None:
        """Start nothing yet; ``environment`` is that of every process."""
        self._logs, self._environment = logs, dict(environment)
        self._running: dict[str, subprocess.Popen[bytes]] = {}
        self._interface = ""  # the role of the process that owns the vehicle
        self.codes: dict[str, int] = {}
        self._asked = False  # to land: a second signal would stop the motors

    def start(self, role: str, command: Sequence[str | Path]) -> None:
        """Start the process of ``role``; raises OSError if it cannot be started.

        The first one owns the vehicle: the simulator, a vehicle interface, or the process of all five nodes.
        """
        self._interface = self._interface or role
        with self._log(role).open("wb") as output:
            self._running[role] = subprocess.Popen(
                [os.fspath(part) for part in command],
                env=self._environment,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                # Its own group: Ctrl-C on the terminal reaches only us, and we pass it on once.
                start_new_session=True,
            )

    def last_lines(self, role: str, count: int = 3) -> list[str]:
        """Return the last lines that the process of ``role`` printed."""
        text = self._log(role).read_text(encoding="utf-8", errors="replace") if self._log(role).exists() else ""
        return [line for line in text.splitlines() if line.strip()][-count:]

    def _log(self, role: str) -> Path:
        return self._logs / f"{role}.log"

    def pids(self) -> dict[str, int]:
        """Return {role: pid} of the processes that run."""
        return {role: process.pid for role, process in self._running.items()}

    def reap(self) -> dict[str, int]:
        """Return {role: exit code} of those that ended since the last call; all codes are in ``codes``."""
        ended = {}
        for role, process in list(self._running.items()):
            code = process.poll()
            if code is not None:
                ended[role] = code
                del self._running[role]
        self.codes.update(ended)
        return ended

    def newly_stopped(self) -> dict[str, int]:
        """Return {role: signal} of the processes that a signal has made stand still since the last call."""
        found = {}
        for role, process in self._running.items():
            with suppress(ChildProcessError):
                if (news := os.waitid(os.P_PID, process.pid, os.WSTOPPED | os.WNOHANG)) is not None:
                    found[role] = news.si_status
        return found

    def running(self) -> bool:
        """Return whether any process still runs."""
        return bool(self._running)

    def interrupt_vehicle_interface(self) -> None:
        """Ask the process that owns the vehicle to end the flight."""
        interface = self.vehicle_interface()
        if interface is not None:
            self._asked = True
            _signal(interface, signal.SIGINT)

    def vehicle_interface(self) -> "subprocess.Popen[bytes] | None":
        """Return the process that owns the vehicle, None if it has left."""
        return self._running.get(self._interface)

    def stop(self, landing: float = 0.0) -> None:
        """End all processes that still run; ``landing``: s in which a vehicle may be brought down before.

        The simulator is asked first, for it tells the others why; then all by SIGINT, SIGTERM, SIGABRT and SIGKILL.
        """
        interface = self.vehicle_interface()
        if interface is not None and landing:
            if not self._asked:
                self.interrupt_vehicle_interface()
            with suppress(subprocess.TimeoutExpired):
                interface.wait(landing)
        self._ask(self._interface, signal.SIGINT, _SIMULATOR_FIRST)
        for number, patience in _STOPS:
            self._ask("", number, patience)

    def _ask(self, only: str, number: signal.Signals, patience: float) -> None:
        asked = [process for role, process in self._running.items() if only in ("", role)]
        for process in asked:
            _signal(process, number)
        deadline = time.monotonic() + patience
        while asked and self._running and time.monotonic() < deadline:
            self.reap()
            time.sleep(0.02)
