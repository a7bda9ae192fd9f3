"""What every measurement of bench/ gives: rows of one table."""

import os
import platform
import statistics
from collections.abc import Callable, Sequence
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import NamedTuple, TypeVar

PACKAGES = ("numba", "numpy", "llvmlite", "ros-jazzy-rclpy", "mujoco", "mcap")

_FACTS = {
    "board": "/proc/device-tree/model",
    "governor": "/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor",
    "realtime kernel": "/sys/kernel/realtime",
}
"""Files of the kernel that only some computers have."""

Measured = TypeVar("Measured")


class Row(NamedTuple):
    """One figure: the median of ``values`` in ``unit``, the target it is held to, and what it means."""

    bench: str
    name: str
    values: tuple[float, ...]
    unit: str
    target: str = ""
    note: str = ""

    @property
    def median(self) -> float:
        """The median of all rounds; NaN if there is none."""
        return statistics.median(self.values) if self.values else float("nan")


def versions() -> dict[str, str]:
    """Return what decides the figures."""
    found = {"python": platform.python_version(), "machine": platform.machine(), "processor": _processor()}
    found |= {"kernel": f"{platform.release()} {platform.version()}", "cores": str(os.cpu_count())}
    for name, path in _FACTS.items():
        with suppress(OSError):
            found[name] = Path(path).read_text(encoding="utf-8", errors="replace").strip("\0\n")
    for package in PACKAGES:
        with suppress(PackageNotFoundError):
            found[package] = version(package)
    return found


def as_text(rows: Sequence[Row]) -> str:
    """Return the table for people: median, smallest and largest of the rounds."""
    head = ("bench", "figure", "median", "least", "most", "unit", "target", "note")
    lines: list[tuple[str, ...]] = [head]
    for row in rows:
        ends = (min(row.values), max(row.values)) if row.values else (float("nan"),) * 2
        numbers = (f"{value:.4g}" for value in (row.median, *ends))
        lines.append((row.bench, row.name, *numbers, row.unit, row.target, row.note))
    widths = [max(len(line[i]) for line in lines) for i in range(len(head))]
    return "\n".join("  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)) for line in lines)


def alternated(rounds: int, measures: Sequence[Callable[[], Measured]]) -> list[list[Measured]]:
    """Return the values of each measure, taken in turn, every other round in the opposite order."""
    found: list[list[Measured]] = [[] for _ in measures]
    for number in range(rounds):
        order = list(enumerate(measures))
        for index, measure in order if number % 2 == 0 else reversed(order):
            found[index].append(measure())
    return found


def ratios(over: Sequence[float], under: Sequence[float]) -> tuple[float, ...]:
    """Return the ratios of paired values."""
    return tuple(a / b for a, b in zip(over, under, strict=True))


def _processor() -> str:
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as stream:  # noqa: PTH123 (a kernel file)
            return next(line.partition(":")[2].strip() for line in stream if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor()
