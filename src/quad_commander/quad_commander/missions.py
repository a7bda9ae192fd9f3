"""Missions: ``takeoff,case2,hold:5,goto:4 0 2,land`` or a file as items, and which request comes next.

    mission = parse(text, installed trajectories)                                       # raises ParameterError
    request, memory = next_request(mission, memory, mode, reason, dt, place, rests)     # at every step

The commander's mode decides; the mission only asks. While a fault or an operator keeps the vehicle in another mode than
that of the current item, the mission waits, and goes on only when an operator asks for that mode again.
"""

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import NamedTuple

from quad_commander.mode_table import Condition
from quad_commander.modes import ON_REQUEST
from quad_commander.references import Place
from quad_core import plugins
from quad_core.cascade import TRAJECTORY
from quad_core.enumerations import Mode, Request
from quad_core.parameter_files import StrictLoader, load_yaml_file
from quad_core.parameters import ParameterError, radians_of
from quad_core.resolution import parse_settings, resolve

LONGEST_HOLD = 3600.0
HIGHEST = 1000.0
FARTHEST = 1e4
MOST_ITEMS = 100
LARGEST_YAW = 6.2832


class Item(NamedTuple):
    """What it asks for, a trajectory's name, height in m of a take-off or time in s of a hold, place of a goto.

    A height of 0 is that of the commander's parameters.
    """

    request: Request
    name: str = ""
    value: float = 0.0
    place: Place | None = None


class MissionMemory(NamedTuple):
    """Number of the current item, whether its mode was entered, and for how long in s it has been in it.

    ``waited``: for how long in s the vehicle has held for another cause than a request or this item.
    """

    item: int = 0
    began: bool = False
    time: float = 0.0
    waited: float = 0.0


FLOWN_IN = {
    Request.TAKEOFF: Mode.TAKEOFF,
    Request.MISSION: Mode.MISSION,
    Request.HOLD: Mode.HOLD,
    Request.GOTO: Mode.HOLD,
    Request.LAND: Mode.LAND,
}
"""The mode in which the vehicle does what an item asks for."""
DONE_BY = {Request.TAKEOFF: Condition.AT_HEIGHT, Request.MISSION: Condition.PLAN_ENDED}


def parse(text: str, trajectories: Collection[str]) -> tuple[Item, ...]:
    """Return the items of a mission such as ``takeoff:2,case2,hold:5,land``; a missing end is ``land``.

    ``trajectories`` are the names of installed ones. Raises ParameterError.
    """
    words = [word.strip() for word in text.split(",")]
    if len(words) > MOST_ITEMS:
        raise ParameterError(f"mission: found {len(words)} items, expected at most {MOST_ITEMS}")
    items = [_item(word, number, trajectories) for number, word in enumerate(words, start=1)]
    for number, item in enumerate(items, start=1):
        if (item.request == Request.TAKEOFF) != (number == 1):
            found = f"item {number} {words[number - 1]!r}"
            expected = "takeoff first" if number == 1 else "takeoff only as the first item"
            raise ParameterError(f"mission: found {found}, expected {expected}")
        if item.request == Request.LAND and number < len(items):
            raise ParameterError(f"mission: found {words[number]!r} after land, expected land as the last item")
    return (*items, *([] if items[-1].request == Request.LAND else [Item(Request.LAND)]))


def _item(word: str, number: int, trajectories: Collection[str]) -> Item:
    name, colon, argument = word.partition(":")
    if name == "takeoff":
        return Item(Request.TAKEOFF, value=_number(word, argument, HIGHEST, "a height in m") if colon else 0.0)
    if name == "hold" and colon:
        return Item(Request.HOLD, value=_number(word, argument, LONGEST_HOLD, "a time in s"))
    if name == "goto" and colon:
        return Item(Request.GOTO, place=read_place(argument.split(), f"mission: found {word!r}"))
    if not colon and name == "land":
        return Item(Request.LAND)
    if not colon and name in trajectories:
        return Item(Request.MISSION, name)
    known = ["takeoff[:height]", "hold:seconds", "goto:x y z [yaw]", "land", *sorted(trajectories)]
    raise ParameterError(f"mission: found {word!r} as item {number}, expected one of {', '.join(known)}")


def _number(word: str, text: str, largest: float, meaning: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0.0 < value <= largest:
        expected = f"expected {meaning} above 0 and at most {largest:g} after the colon"
        raise ParameterError(f"mission: found {word!r}, {expected}")
    return value


def read_place(words: Sequence[str], found: str) -> Place:
    """Return the place ``x y z [yaw]``: m, and rad or ``90deg``; raises ParameterError, which begins with ``found``."""
    try:
        x, y, z, *yaw = (float(radians_of(word)) if number == 3 else float(word) for number, word in enumerate(words))
        place = Place(x, y, z, *yaw)
    except (TypeError, ValueError):
        raise ParameterError(f"{found}, expected x y z in m and, if it changes, yaw in rad (or 90deg)") from None
    if not all(abs(value) <= FARTHEST for value in (x, y, z)):
        raise ParameterError(f"{found}, expected x y z in [-{FARTHEST:g}, {FARTHEST:g}] m")
    if place.yaw is not None and not abs(place.yaw) <= LARGEST_YAW:
        raise ParameterError(f"{found}, expected a yaw of at most one turn, in rad or, for degrees, as 90deg")
    return place


def next_request(
    mission: tuple[Item, ...],
    memory: MissionMemory,
    mode: Mode,
    reason: int,
    dt: float,
    place: Place | None = None,
    rests: bool = False,
) -> tuple[Request, MissionMemory]:
    """Return what the mission asks for ``dt`` s after the last call, and its next memory.

    ``mode`` and ``reason`` are those of the commander's last decision; ``place``: where a HOLD was sent to, ``rests``:
    its reference has arrived. An item is over when its mode has done what it should: a take-off is at height, a
    trajectory has ended, a hold has lasted its time, a place is reached. Whatever else ends its mode (a fault, an
    operator) makes the mission wait until that mode is there again.
    """
    if memory.item >= len(mission):
        return Request.NONE, memory
    item = mission[memory.item]
    is_there = mode == FLOWN_IN[item.request] and (item.request != Request.GOTO or place == item.place)
    is_over = memory.began and mode == Mode.HOLD and reason == DONE_BY.get(item.request)
    if is_there:
        lasted = item.request == Request.HOLD and memory.time + dt >= item.value
        is_over = lasted or (item.request == Request.GOTO and memory.began and rests)
    if is_over:
        return next_request(mission, MissionMemory(memory.item + 1), mode, reason, 0.0, place, rests)
    if is_there:
        return Request.NONE, MissionMemory(memory.item, True, memory.time + dt)
    begins = not memory.began and mode == (Mode.DISARMED if item.request == Request.TAKEOFF else Mode.HOLD)
    waits = mode == Mode.HOLD and reason != ON_REQUEST and not begins
    memory = memory._replace(waited=memory.waited + dt if waits else 0.0)
    return (item.request if begins else Request.NONE), memory


def read_mission(given: str) -> tuple[str, str | None, list[str]]:
    """Return the mission's items, the trajectory that it flies (None: none), and that one's settings as of ``--set``.

    ``given`` is such items, or a YAML file: a list ``items`` (``takeoff:2``, or ``takeoff: 2`` and
    ``goto: [4, 0, 2, 90deg]``), and by the name of its trajectory that one's parameters; a list of waypoints has one a
    line. Raises ParameterError, which names file and key.
    """
    path = Path(given)
    if path.suffix not in (".yaml", ".yml"):
        return given, _trajectory_of(given), []
    try:
        return _read(load_yaml_file(path, StrictLoader))
    except (OSError, ValueError) as error:
        raise ParameterError(f"--mission: {given}: {' '.join(str(error).split())}") from error


def _read(content: object) -> tuple[str, str | None, list[str]]:
    if not isinstance(content, dict) or not isinstance(items := content.pop("items", None), list):
        raise ParameterError("found no list items, expected for example [takeoff:2, hold:5, land]")
    mission = ",".join(map(_written, items))
    trajectory, settings = _trajectory_of(mission), []
    for name, section in content.items():
        if name != trajectory or not isinstance(section, dict):
            raise ParameterError(f"found {name}, expected parameters of a trajectory among the items")
        for key, value in section.items():
            shown = "; ".join(map(str, value)) if isinstance(value, list) else value
            settings.append(f"{TRAJECTORY}.{name}.{key}={shown}")
        resolve(TRAJECTORY, {"trajectory": name, **parse_settings(settings).get(TRAJECTORY, {})})
    return mission, trajectory, settings


def _written(item: object) -> str:
    """Return an item of a file as the command line has it."""
    if isinstance(item, dict) and len(item) == 1:
        ((name, value),) = item.items()
        return f"{name}:{' '.join(map(str, value)) if isinstance(value, list) else value}"
    return str(item)


def _trajectory_of(mission: str) -> str | None:
    """Return the name of the trajectory that ``mission`` flies, None if it flies none.

    Raises ParameterError for a mission that cannot be flown.
    """
    items = parse(mission, plugins.names(plugins.TRAJECTORY))
    names = list(dict.fromkeys(item.name for item in items if item.request == Request.MISSION))
    if len(names) > 1:
        raise ParameterError(f"mission: found {', '.join(names)}, expected one trajectory: a flight has one such node")
    return names[0] if names else None
