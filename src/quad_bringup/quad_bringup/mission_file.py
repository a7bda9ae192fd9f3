"""The mission of a flight: its items, its trajectory, and that one's parameters."""

from pathlib import Path

from quad_commander.missions import parse
from quad_core import plugins
from quad_core.cascade import TRAJECTORY
from quad_core.enumerations import Request
from quad_core.parameter_files import StrictLoader, load_yaml_file
from quad_core.parameters import ParameterError
from quad_core.resolution import parse_settings, resolve


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
