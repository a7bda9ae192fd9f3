"""Modes, conditions and requests in the words of people, for messages, tables and the record."""

import math

from quad_commander.mode_table import FAULTS, PROGRESS, Condition, Mode, Request
from quad_commander.modes import NO_REASON, ON_REQUEST
from quad_commander.parameters import ModeParameters
from quad_core.cascade import ATTITUDE
from quad_core.parameters import fields
from quad_guard.guard import GOOD, REASONS, WRENCH_LOST


def words(name: str) -> str:
    """Return an enum's name as people write it."""
    return name.lower().replace("_", " ")


def limits(parameters: ModeParameters) -> dict[str, str]:
    """Return the parameters as people read them: degrees, per cent, or with their unit."""
    shown = {}
    for field in fields(parameters):
        value, unit = field.default, getattr(field.spec, "unit", "")
        if unit == "rad":
            shown[field.name] = f"{math.degrees(float(value)):.0f} deg"
        elif unit:
            shown[field.name] = f"{value:g} {unit}"
        else:
            shown[field.name] = f"{100.0 * float(value):.0f} %"
    return shown


def reason_text(parameters: ModeParameters, mode: int, reason: int, sender: str, guard_reason: int = GOOD) -> str:
    """Return why ``mode`` was entered, who is silent first; ``sender`` made the last request.

    ``guard_reason``: why the guard acted, of ``quad_guard.guard.REASONS``.
    """
    if reason == NO_REASON:
        return ""
    if reason == ON_REQUEST:
        return f"asked for by {sender}"
    rows = {row.condition: f"{row.publisher} is silent: {row.text}" if row.publisher else row.text for row in FAULTS}
    texts = [text for _, condition, then, text in PROGRESS if condition == reason and then == mode]
    text = rows.get(Condition(reason)) or (texts[0] if texts else words(Condition(reason).name))
    if reason in (Condition.GUARD_DESCENDS, Condition.GUARD_KILLED) and guard_reason != GOOD:
        text += f": {REASONS[guard_reason]}" + (f" from {ATTITUDE}" if guard_reason == WRENCH_LOST else "")
    return text.format(**limits(parameters))


def refusal_text(mode: int, request: int, blocked_by: int) -> str:
    """Return why ``request`` was refused in ``mode``."""
    name = Request(request).name
    if blocked_by == NO_REASON:
        return f"{name} is not possible in {Mode(mode).name}"
    return f"{name} is not possible: {words(Condition(blocked_by).name)}"
