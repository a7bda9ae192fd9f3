"""The view of a flight in the browser: a process of its own that reads the growing bag, so that no node notices it."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

_GOODBYE = 8.0  # s in which it reads the end of the bag and tells the browsers


@contextmanager
def shown(bag: Path, *, wanted: bool) -> Iterator[None]:
    """Show what is recorded into ``bag`` while the context lasts, at low priority; nothing unless ``wanted``."""
    if not wanted:
        yield
        return
    command = ["nice", sys.executable, "-m", "quad_flight_log.cli", "view", "--live", str(bag)]
    # its own session: Ctrl-C ends the flight, and the view with it
    with subprocess.Popen(command, stdin=subprocess.DEVNULL, start_new_session=True) as process:
        try:
            yield
            if any(bag.glob("*.mcap*")):
                with suppress(subprocess.TimeoutExpired):
                    process.wait(_GOODBYE)
        finally:
            process.terminate()
