"""The entry of ``fly``: a signal that comes while the program is still loading ends it with one line."""

import importlib.util
import os
import signal
import sys
from contextlib import suppress
from pathlib import Path
from types import FrameType

from ament_index_python import get_resources

from quad_core.command_line import ending

FAILED, BAD_SETUP = 1, 2
RMW = "RMW_IMPLEMENTATION"
LOADED = ("rclpy", "rcl_interfaces", "numpy", "yaml", "std_msgs", "quad_msgs")
"""What another workspace or another ROS may bring along first."""


def leave(number: int, _frame: FrameType | None) -> None:
    """End the process: nothing was begun yet."""
    with suppress(OSError):  # the terminal may be gone
        os.write(2, f"fly: interrupted by {signal.Signals(number).name} before the flight\n".encode())
    os._exit(FAILED)


def foreign(name: str) -> str:
    """Return where package ``name`` is found if that is a folder of PYTHONPATH outside of this ROS and workspace."""
    spec = importlib.util.find_spec(name)
    if spec is None or spec.origin is None:
        return ""
    prefixes = [sys.prefix, sys.base_prefix, os.environ.get("QUAD_ROOT", ""), *_split("AMENT_PREFIX_PATH")]
    folder = Path(spec.origin).parent
    ours = any(folder.is_relative_to(prefix) for prefix in prefixes if prefix)
    return "" if ours or str(folder.parent) not in _split("PYTHONPATH") else str(folder)


def _split(name: str) -> list[str]:
    return [part.rstrip("/") for part in os.environ.get(name, "").split(os.pathsep) if part]


def refusal(error: Exception) -> str:
    """Return why ``fly`` cannot be loaded, in one line that names a package of another workspace if one is first."""
    found = [f"{name} in {place}" for name in LOADED if (place := foreign(name))]
    what = f"PYTHONPATH: found {', '.join(found)}, expected those of this workspace: " if found else ""
    return f"fly: {what}{type(error).__name__}: {' '.join(str(error).split())}"


def wrong_middleware() -> str:
    """Return why the middleware that this shell asks for cannot be had, empty if it can: rcl would end the process."""
    chosen, installed = os.environ.get(RMW, ""), sorted({*get_resources("rmw_typesupport")} - {"rmw_implementation"})
    if not chosen or not installed or chosen in installed:
        return ""
    return f"fly: {RMW}: found {chosen!r}, expected one that is installed: {', '.join(installed)}"


def main() -> None:
    """Load ``fly`` and run it; scripts/fly starts it with the signals blocked, so that none is lost or kills it."""
    signals = ending()
    for number in signals:
        signal.signal(number, leave)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, (*signals, signal.SIGHUP))
    wrong = wrong_middleware()
    if wrong:
        sys.stderr.write(f"{wrong}\n")
        sys.exit(BAD_SETUP)
    try:
        from quad_bringup.fly import main as fly
    except Exception as error:  # whatever the module of another workspace raises
        sys.stderr.write(f"{refusal(error)}\n")
        sys.exit(BAD_SETUP)
    try:
        code = fly()
    finally:
        # It has ended: what is sent now changes nothing any more.
        for number in signals:
            signal.signal(number, signal.SIG_IGN)
    sys.exit(code)
