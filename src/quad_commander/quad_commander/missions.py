"""Missions: ``takeoff,case2,hold:5,land`` as items, and which request comes next.

    mission = parse(text, installed trajectories)            # raises MissionError
    request, memory = next_request(mission, memory, mode, reason, dt)    # at every step

The commander's mode decides; the mission only asks. While a fault or an operator keeps the vehicle in another mode than
that of the current item, the mission waits, and goes on only when an operator asks for that mode again.
"""

from collections.abc import Collection
from enum import IntEnum
from typing import NamedTuple

from quad_commander.mode_table import Condition, Mode, Request

DEFAULT_HEIGHT = 1.5
LONGEST_HOLD = 3600.0
HIGHEST = 1000.0
MOST_ITEMS = 100


class MissionError(ValueError):
    """A mission that cannot be flown; the text names the word found and what was expected."""


class Kind(IntEnum):
    """What an item of a mission does."""

    TAKEOFF = 0
    TRAJECTORY = 1
    HOLD = 2
    LAND = 3


class Item(NamedTuple):
    """One item: kind, the trajectory's name, a number (height in m of a take-off, time in s of a hold)."""

    kind: Kind
    name: str = ""
    value: float = 0.0


class MissionMemory(NamedTuple):
    """Number of the current item, whether its mode was entered, and for how long in s it has been in it."""

    item: int = 0
    began: bool = False
    time: float = 0.0


MODES = {Kind.TAKEOFF: Mode.TAKEOFF, Kind.TRAJECTORY: Mode.MISSION, Kind.HOLD: Mode.HOLD, Kind.LAND: Mode.LAND}
REQUESTS = {
    Kind.TAKEOFF: Request.TAKEOFF,
    Kind.TRAJECTORY: Request.MISSION,
    Kind.HOLD: Request.HOLD,
    Kind.LAND: Request.LAND,
}
DONE_BY = {Kind.TAKEOFF: Condition.AT_HEIGHT, Kind.TRAJECTORY: Condition.PLAN_ENDED}


def parse(text: str, trajectories: Collection[str]) -> tuple[Item, ...]:
    """Return the items of a mission such as ``takeoff:2,case2,hold:5,land``; a missing end is ``land``.

    ``trajectories`` are the names of installed ones. Raises MissionError.
    """
    words = [word.strip() for word in text.split(",")]
    if len(words) > MOST_ITEMS:
        raise MissionError(f"mission: found {len(words)} items, expected at most {MOST_ITEMS}")
    items = [_item(word, number, trajectories) for number, word in enumerate(words, start=1)]
    for number, item in enumerate(items, start=1):
        if (item.kind == Kind.TAKEOFF) != (number == 1):
            found = f"item {number} {words[number - 1]!r}"
            expected = "takeoff first" if number == 1 else "takeoff only as the first item"
            raise MissionError(f"mission: found {found}, expected {expected}")
        if item.kind == Kind.LAND and number < len(items):
            raise MissionError(f"mission: found {words[number]!r} after land, expected land as the last item")
    return (*items, *([] if items[-1].kind == Kind.LAND else [Item(Kind.LAND)]))


def _item(word: str, number: int, trajectories: Collection[str]) -> Item:
    name, colon, number_text = word.partition(":")
    known = ["takeoff[:height]", "hold:seconds", "land", *sorted(trajectories)]
    if name == "takeoff":
        height = _number(word, number_text, HIGHEST, "a height in m") if colon else DEFAULT_HEIGHT
        return Item(Kind.TAKEOFF, "", height)
    if name == "hold" and colon:
        return Item(Kind.HOLD, "", _number(word, number_text, LONGEST_HOLD, "a time in s"))
    if not colon and name == "land":
        return Item(Kind.LAND)
    if not colon and name in trajectories:
        return Item(Kind.TRAJECTORY, name)
    raise MissionError(f"mission: found {word!r} as item {number}, expected one of {', '.join(known)}")


def _number(word: str, text: str, largest: float, meaning: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0.0 < value <= largest:
        raise MissionError(
            f"mission: found {word!r}, expected {meaning} above 0 and at most {largest:g} after the colon"
        )
    return value


def next_request(
    mission: tuple[Item, ...], memory: MissionMemory, mode: int, reason: int, dt: float
) -> tuple[Request, MissionMemory]:
    """Return what the mission asks for ``dt`` s after the last call, and its next memory.

    ``mode`` and ``reason`` are those of the commander's last decision. An item is over when its mode has done what it
    should: a take-off is at height, a trajectory has ended, a hold has lasted its time. Whatever else ends its mode (a
    fault, an operator) makes the mission wait until that mode is there again.
    """
    if memory.item >= len(mission):
        return Request.NONE, memory
    item = mission[memory.item]
    is_there = mode == MODES[item.kind]
    if is_there and item.kind == Kind.HOLD and memory.time + dt >= item.value:
        return next_request(mission, MissionMemory(memory.item + 1), mode, reason, 0.0)
    if is_there:
        return Request.NONE, MissionMemory(memory.item, True, memory.time + dt)
    if memory.began and mode == Mode.HOLD and reason == DONE_BY.get(item.kind):
        return next_request(mission, MissionMemory(memory.item + 1), mode, reason, 0.0)
    begins = not memory.began and mode == (Mode.DISARMED if item.kind == Kind.TAKEOFF else Mode.HOLD)
    return (REQUESTS[item.kind] if begins else Request.NONE), memory


def is_kept_waiting(mission: tuple[Item, ...], memory: MissionMemory, mode: int) -> bool:
    """Return whether the vehicle stands in HOLD while the mission is at an item of another mode, or at none."""
    is_holding_item = memory.item < len(mission) and mission[memory.item].kind == Kind.HOLD
    return bool(mission) and mode == Mode.HOLD and not is_holding_item
