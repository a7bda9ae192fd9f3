"""Everything that can be wrong with a flight log, rooted in one error."""

import re
from importlib import import_module
from typing import Any

_UNPRINTABLE = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")


def printable(text: str) -> str:
    """Return ``text`` with whatever controls a terminal (escapes, changes of direction) as visible characters."""
    return _UNPRINTABLE.sub(lambda match: match[0].encode("unicode_escape").decode("ascii"), text)


def one_line(error: Exception, longest: int = 200) -> str:
    """Return what an error of a library says, in one line of at most ``longest`` characters."""
    return " ".join(str(error).split())[:longest] or type(error).__name__


class FlightLogError(Exception):
    """Something is wrong with a flight log; the text names the file, what was found and what was expected."""


def needed(module: str, what: str) -> Any:
    """Return an optional module; raises FlightLogError that says ``what`` needs it."""
    try:
        return import_module(module)
    except ImportError as error:
        hint = "pip install -r requirements/extras.txt"
        raise FlightLogError(f"{what} needs {module.partition('.')[0]}: {hint}") from error


class CorruptError(FlightLogError):
    """The log is not what the recorder wrote, or unpacks to more than its size allows."""


class SchemaError(FlightLogError):
    """A message definition is unknown or malformed, or a payload does not fit it."""


class TopicError(FlightLogError):
    """A topic or field is missing, ambiguous, or of another type than needed."""
