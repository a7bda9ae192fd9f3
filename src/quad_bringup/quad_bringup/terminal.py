"""What is said while vehicles fly: a terminal or a pipe that is gone costs the words, and never a flight."""

import os
import sys
from typing import TextIO

from quad_flight_log.errors import printable


def write(text: str, out: TextIO) -> None:
    """Write ``text`` to ``out`` at once; if no node reads it any more, to nowhere, as all that follows."""
    try:
        out.write(text)
        out.flush()
    except OSError:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, out.fileno())
        os.close(nowhere)


def say(line: str) -> None:
    """Say a line of the result."""
    write(f"{printable(line)}\n", sys.stdout)


def complain(line: str) -> None:
    """Say in one line what is not as it should be."""
    clear = "\r\033[K" if sys.stderr.isatty() else ""  # the line that shows how far a flight is
    write(f"{clear}fly: {printable(' '.join(line.splitlines()))}\n", sys.stderr)
