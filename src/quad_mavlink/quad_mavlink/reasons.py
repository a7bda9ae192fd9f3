"""What an autopilot says in words (STATUSTEXT), put together from its pieces, newest first forgotten last."""

from typing import NamedTuple

WORST = 4
"""MAV_SEVERITY_WARNING: what is less severe is no reason."""
_FOR, _SHOWN, _PIECE = 10.0, 3, 50


class Text(NamedTuple):
    """One text: when it came (s), its number (0: whole) and what it says."""

    at: float
    number: int
    text: str


def heard(texts: tuple[Text, ...], now: float, severity: int, text: str, number: int) -> tuple[Text, ...]:
    """Return the texts with a piece that has come; a piece of a known number is appended to it."""
    recent = tuple(known for known in texts if now - known.at <= _FOR)
    if severity > WORST or not text:
        return recent
    for place, known in enumerate(recent):
        if number and known.number == number and len(known.text) % _PIECE == 0:
            return (*recent[:place], known._replace(text=known.text + text), *recent[place + 1 :])
    if any(known.text == text for known in recent):
        return recent
    return (*recent, Text(now, number, text))


def newest(texts: tuple[Text, ...], now: float) -> tuple[str, ...]:
    """Return the newest texts."""
    return tuple(known.text for known in texts if now - known.at <= _FOR)[-_SHOWN:]
