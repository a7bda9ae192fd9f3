"""The entry of ``fly``: a signal that comes while the program is still loading ends it with one line."""

import os
import signal
import sys
from contextlib import suppress
from types import FrameType

from quad_core.signals import ending

FAILED = 1


def leave(number: int, _frame: FrameType | None) -> None:
    """End the process: nothing was begun yet."""
    with suppress(OSError):  # the terminal may be gone
        os.write(2, f"fly: interrupted by {signal.Signals(number).name} before the flight\n".encode())
    os._exit(FAILED)


def main() -> None:
    """Load ``fly`` and run it; scripts/fly starts it with the signals blocked, so that none is lost or kills it."""
    signals = ending()
    for number in signals:
        signal.signal(number, leave)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, (*signals, signal.SIGHUP))
    from quad_bringup.fly import main as fly

    try:
        code = fly()
    finally:
        # It has ended: what is sent now changes nothing any more.
        for number in signals:
            signal.signal(number, signal.SIG_IGN)
    sys.exit(code)
