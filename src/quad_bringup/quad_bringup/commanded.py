"""What a flight with a commander is besides: the trajectory of its mission, and the parameters of its nodes."""

import secrets
from pathlib import Path

from quad_commander.missions import Kind, MissionError, parse
from quad_core import plugins
from quad_core.cascade import COMMANDER, ROLES, SIMULATOR, TRAJECTORY
from quad_core.parameter_files import StrictLoader, load_yaml
from quad_core.parameters import ParameterError, Value
from quad_dynamics.ground import SINK
from quad_dynamics.parameters import Ground


def read_mission(given: str) -> tuple[str, list[str]]:
    """Return the mission's items and the trajectory's settings, as ``--mission`` and ``--set`` take them.

    ``given`` is such items, or a YAML file: a list ``items`` (``takeoff:2``, or ``takeoff: 2`` and
    ``goto: [4, 0, 2, 90deg]``), and by the name of its trajectory that one's parameters; a list of waypoints has one a
    line. Raises ParameterError, which names file and key.
    """
    path = Path(given)
    if path.suffix not in (".yaml", ".yml"):
        return given, []
    try:
        content = load_yaml(path.read_text("utf-8"), StrictLoader)
    except (OSError, ValueError) as error:
        raise ParameterError(f"--mission: {given}: {' '.join(str(error).split())}") from error
    if not isinstance(content, dict) or not isinstance(items := content.pop("items", None), list):
        raise ParameterError(f"--mission: {given}: found no list items, expected for example [takeoff:2, hold:5, land]")
    items = [_written(item) for item in items]
    settings = []
    for name, section in content.items():
        if name not in items or not isinstance(section, dict):
            raise ParameterError(
                f"--mission: {given}: found {name}, expected parameters of a trajectory among the items"
            )
        for key, value in section.items():
            shown = "; ".join(map(str, value)) if isinstance(value, list) else value
            settings.append(f"{TRAJECTORY}.{name}.{key}={shown}")
    return ",".join(items), settings


def _written(item: object) -> str:
    """Return an item of a file as the command line has it."""
    if isinstance(item, dict) and len(item) == 1:
        ((name, value),) = item.items()
        return f"{name}:{' '.join(map(str, value)) if isinstance(value, list) else value}"
    return str(item)


def trajectory_of(mission: str) -> str | None:
    """Return the name of the trajectory that ``mission`` flies, None if it flies none.

    Raises ParameterError for a mission that cannot be flown.
    """
    try:
        items = parse(mission, plugins.names(plugins.TRAJECTORY))
    except MissionError as error:
        raise ParameterError(f"--{error}") from error
    names = list(dict.fromkeys(item.name for item in items if item.kind == Kind.TRAJECTORY))
    if len(names) > 1:
        raise ParameterError(
            f"--mission: found {', '.join(names)}, expected one trajectory: a flight has one such node"
        )
    return names[0] if names else None


def launched(mission: str) -> dict[str, dict[str, Value]]:
    """Return {role: parameters} with which a launch file flies ``mission`` from the origin of plant rigid_body.

    Raises ParameterError as ``trajectory_of``.
    """
    name = trajectory_of(mission)
    roles = (*ROLES, COMMANDER)
    shared: dict[str, Value] = {"flight.roles": ",".join(roles), "flight.run_id": f"mission-{secrets.token_hex(4)}"}
    own: dict[str, dict[str, Value]] = {
        SIMULATOR: {"rigid_body.ground.enabled": True, "rigid_body.ground.height": SINK - Ground().foot_depth},
        TRAJECTORY: {"trajectory": name} if name else {},
        COMMANDER: {"mission": mission},
    }
    return {role: {**shared, **own.get(role, {})} for role in roles}
