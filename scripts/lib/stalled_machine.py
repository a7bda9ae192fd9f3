"""A test of the wall clock that fails while the machine stands still is run again, and the stall is shown.

One process per processor, at the highest priority that it may have, sleeps 5 ms again and again; a sleep that takes
30 ms was not the stack's doing. Without such a witness a failure counts at once. A test that fails every time while
the machine stands still is not judged: it is reported as skipped, with the stall.
"""

import os
import subprocess
import sys
import time
from collections.abc import Generator
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

_SLEEP, _STALL = 0.005, 0.03
RERUNS = 3
NOT_JUDGED = "not judged: the machine stood still"


class StallMeter:
    """The stalls of this machine since the first question; times are those of ``time.monotonic``."""

    def __init__(self) -> None:
        """Start nothing yet."""
        self._folder: TemporaryDirectory[str] | None = None
        self.began = 0.0

    def begin(self) -> None:
        """Look from now on; the first call starts the witnesses."""
        if self._folder is None:
            self._folder = TemporaryDirectory(prefix="quad_stalls_")
            for processor in os.sched_getaffinity(0):
                file = Path(self._folder.name, str(processor))
                command = [sys.executable, __file__, str(file), str(processor), str(os.getpid())]
                subprocess.Popen(command, stdin=subprocess.DEVNULL)
        self.began = time.monotonic()

    def longest(self) -> float:
        """Return the longest stall since ``begin`` in s, or 0."""
        files = sorted(Path(self._folder.name).iterdir()) if self._folder else []
        return longest_stall([file.read_text(encoding="ascii") for file in files], self.began)


def longest_stall(records: list[str], since: float) -> float:
    """Return the longest stall that ended after ``since``; ``records``: lines of its end and its length in s."""
    lines = (line.split() for text in records for line in text.splitlines())
    return max((float(length) for end, length in lines if float(end) > since), default=0.0)


class StalledMachine:
    """Hooks of pytest."""

    def __init__(self, meter: StallMeter) -> None:
        """Ask ``meter``."""
        self._meter, self._stall = meter, 0.0
        self.seen: list[str] = []

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        """Let tests of the wall clock be run again where the machine stood still."""
        for item in items:
            if item.get_closest_marker("wall_clock"):
                item.add_marker(pytest.mark.flaky(reruns=RERUNS, condition=self.stood_still))

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_setup(self, item: pytest.Item) -> None:
        """Look on while a test of the wall clock runs."""
        if item.get_closest_marker("wall_clock"):
            self._meter.begin()

    def stood_still(self) -> bool:
        """Return whether the machine stood still in the test that has just ended."""
        self._stall = self._meter.longest()
        return self._stall > 0.0

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(self, item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
        """Report the last of all tries as not judged if the machine stood still in each."""
        report = yield
        last = getattr(item, "execution_count", 1) > RERUNS
        if last and report.failed and item.get_closest_marker("wall_clock") and self.stood_still():
            report.outcome = "skipped"
            reason = f"{NOT_JUDGED} in each of {RERUNS + 1} tries, at last for {1e3 * self._stall:.0f} ms"
            report.longrepr = (str(item.path), 0, f"Skipped: {reason}")
        return report

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Remember what is run again."""
        if str(report.outcome) == "rerun":
            self.seen.append(f"{report.nodeid}: the machine stood still for {1e3 * self._stall:.0f} ms; run again")

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Name what was run again, and why."""
        if self.seen:
            terminalreporter.section("the machine stood still")
            for line in self.seen:
                terminalreporter.write_line(line)


def watch(file: Path, processor: int, parent: int) -> None:
    """Write the stalls of one processor to ``file`` while the process ``parent`` lives."""
    os.sched_setaffinity(0, {processor})
    with suppress(PermissionError):  # an ordinary user's witness is starved by busy programs, too
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(99))
    before = time.monotonic()
    with file.open("w", encoding="ascii", buffering=1) as out:
        while os.getppid() == parent:
            time.sleep(_SLEEP)
            now = time.monotonic()
            if now - before > _STALL:
                out.write(f"{now:.6f} {now - before:.6f}\n")
            before = now


if __name__ == "__main__":
    watch(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))
