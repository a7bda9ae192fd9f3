"""What the command lines of the stack share: bad usage is one line, and a closed stream costs its words alone."""

import argparse
import os
import sys
from typing import NoReturn

BAD_USAGE = 2  # exit code


class Parser(argparse.ArgumentParser):
    """An argument parser that refuses in one line, with exit code 2."""

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
