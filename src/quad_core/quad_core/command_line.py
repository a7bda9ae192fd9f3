"""What the command lines of the stack share: refusals in one line, streams that may be closed, signals that end."""

import argparse
import os
import signal
import sys
import time
from typing import Any, NoReturn

BAD_USAGE = 2  # exit code

ONE_REQUEST = 0.5  # s within which signals are one request: one Ctrl-C reaches a node by its terminal and by its parent


class Parser(argparse.ArgumentParser):
    """An argument parser that refuses in one line, with exit code 2, and takes no option by its beginning."""

    def __init__(self, **options: Any) -> None:
        usual = {"allow_abbrev": False, "formatter_class": argparse.RawDescriptionHelpFormatter}
        super().__init__(**{**usual, **options})

    def error(self, message: str) -> NoReturn:
        """Say what is wrong and leave."""
        self.exit(BAD_USAGE, f"{self.prog}: {message} (--help explains)\n")


def open_streams() -> None:
    """Open what a boot script closed (``>&-``) to nowhere; the next file that is opened would take its place."""
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # gets the lowest free number, which is this one
        if getattr(sys, name) is None:
            setattr(sys, name, open(number, "w" if number else "r", encoding="utf-8", closefd=False))  # noqa: SIM115


def ending() -> tuple[signal.Signals, ...]:
    """Return SIGINT, SIGTERM and SIGHUP; the last not where it is ignored, for so nohup asks to go on."""
    asked = (signal.SIGINT, signal.SIGTERM)
    return asked if signal.getsignal(signal.SIGHUP) == signal.SIG_IGN else (*asked, signal.SIGHUP)


def repeats(number: int, first: float, within: float = ONE_REQUEST) -> bool:
    """Return whether signal ``number`` asks for nothing harder than the one that came at ``first``, monotonic s.

    Nothing that comes within ``within`` s does, and SIGHUP never: a terminal that goes hangs up several times.
    """
    return number == signal.SIGHUP or time.monotonic() - first < within
