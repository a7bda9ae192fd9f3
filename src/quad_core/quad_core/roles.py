"""What packages register of themselves: stages of the cascade, vehicle interfaces and optional nodes, by entry point.

    quad.stages       ROLE = module:NAME of a Stage
    quad.vehicles     ROLE = module:NAME of a VehicleInterface
    quad.nodes        ROLE = module:NAME of a Role

The name of the entry point is the role: the node, its executable and its name in parameter files. Stages and
vehicle interfaces of the sourced environment are known to every flight of it; an optional node takes part where
`flight.roles` names it. Nothing of it is named in this package.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple, TypeVar

from quad_core import plugins

STAGES = "quad.stages"
VEHICLES = "quad.vehicles"
NODES = "quad.nodes"

PLANT_SLOTS = {"plant": plugins.PLANT, "disturbance": plugins.DISTURBANCE, "sensing": plugins.SENSING}
"""{parameter of a node that runs a plant: group of plug-ins}."""


class Input(NamedTuple):
    """One input of a stage other than the state. ``lag`` in plant steps: 1 is the value of the step before."""

    topic: str
    lag: int = 0


class Stage(NamedTuple):
    """One law between reference and rotors, run by a node of its own.

    ``inputs_type`` is what its ``step`` gets: the state, then one field per row of ``inputs``. ``output``: the topic
    of its answer, an ``output_type``. ``internals`` is the class of what the law computed. The message of the same
    name, of package ``messages``, carries it, and a law's own further numbers travel in its field ``extra``.
    """

    role: str
    package: str
    group: str
    parameters: type[Any]
    inputs_type: type[Any]
    inputs: tuple[Input, ...]
    output: str
    output_type: type[Any]
    internals: type[Any]
    paper: str = ""
    messages: str = "quad_msgs"

    @property
    def internals_topic(self) -> str:
        """Name of the topic that carries the internals."""
        return f"{self.role}/internals"


class Role(NamedTuple):
    """One kind of node: its package, its parameters and which of them name plug-ins of which group."""

    package: str
    parameters: type[Any]
    slots: dict[str, str]


class VehicleInterface(NamedTuple):
    """A node that takes the simulator's role: it owns another vehicle, or an autopilot flies its plant.

    ``name``: what ``scripts/fly --vehicle-interface`` calls it, empty if fly does not start it; ``page``: where it is
    described. ``settings``: what it needs of other nodes, NODE.PARAM=VALUE. ``autopilot_lands``: an autopilot lands the
    vehicle after a flight that is given up. ``flies_on_estimate``: ``state`` is the estimate of an autopilot.
    """

    package: str
    parameters: type[Any]
    slots: dict[str, str]
    name: str = ""
    page: str = ""
    settings: tuple[str, ...] = ()
    autopilot_lands: bool = False
    flies_on_estimate: bool = False


Kind = TypeVar("Kind")


def registered(group: str, kind: type[Kind]) -> dict[str, Kind]:
    """Return {role: what an entry point of ``group`` names}, sorted by role.

    Raises PluginError as ``plugins.named``, or for an entry point that names no ``kind``.
    """
    found: dict[str, Kind] = {}
    for name in plugins.names(group):
        row = plugins.named(group, name)
        if not isinstance(row, kind):
            (value,) = {point.value for point in plugins.installed().select(group=group, name=name)}
            expected = f"expected a quad_core.roles.{kind.__name__}"
            raise plugins.PluginError(f"{group}: {name} ({value}): found a {type(row).__name__}, {expected}")
        found[name] = row
    return found


def in_order(stages: Sequence[Stage]) -> tuple[Stage, ...]:
    """Return the stages in the order of the data flow: each after those whose output of the same step it takes.

    Raises PluginError without one, if they wait for one another, or if the last one does not give a wrench.
    """
    left, found = sorted(stages), []
    while left:
        topics = {stage.output for stage in left}
        free = [stage for stage in left if not any(taken.lag == 0 and taken.topic in topics for taken in stage.inputs)]
        if not free:
            raise plugins.PluginError(f"{STAGES}: {', '.join(stage.role for stage in left)} wait for one another")
        found.append(free[0])
        left.remove(free[0])
    if not found or found[-1].output_type.__name__ != "Wrench":
        last = found[-1].role if found else "no stage"
        raise plugins.PluginError(f"{STAGES}: found {last} last, expected a stage that gives a wrench: scripts/setup")
    return tuple(found)
