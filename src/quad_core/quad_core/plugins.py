"""Laws, trajectories, plants, sensors and disturbances by name, from Python entry points.

A plug-in is a module named by an entry point. What each group's module must hold is checked when it is
loaded, so that a missing function is reported by name and not in flight. Any module may have
``check(parameters) -> None``, which raises ParameterError for what a field's own range cannot express, and
``COMPILES = False``, if it is not made for Numba (it then flies over ROS and in the Python loop):

``quad.position_law`` and ``quad.attitude_law``
    ``Parameters``, ``Memory``, ``Internals`` (NamedTuples with defaults),
    ``init(parameters, vehicle) -> Memory`` and
    ``step(parameters, vehicle, memory, inputs, dt) -> (output, Memory, Internals)`` with
    ``PositionInputs -> AttitudeThrust`` or ``AttitudeInputs -> Wrench``. Optional ``PRESETS``:
    ``{preset name: {dotted parameter: value}}``.
``quad.trajectory``
    ``Parameters``, ``Plan``, ``plan(parameters, vehicle, start: VehicleState) -> Plan`` and
    ``sample(parameters, plan, time) -> TrajectoryPoint`` with ``time`` in s since take-off;
    ``duration(parameters, plan) -> float`` (s since take-off at which the flight ends). ``plan`` and ``duration`` run
    once per flight, in plain Python; equal arguments must give equal plans.
    Optional ``remarks(parameters) -> list[str]``: what is flown otherwise than the parameters say, for `flight/events`.
``quad.plant``
    ``Parameters``, ``State``, ``init(parameters, vehicle) -> State``,
    ``step(parameters, vehicle, state, wrench, conditions, dt) -> (State, Actuation)``,
    ``observe(parameters, vehicle, state) -> VehicleState`` and
    ``lumped(parameters, vehicle, state, wrench, conditions) -> Disturbance`` (eqs. 10-12). ``conditions``
    (``quad_core.types.Conditions``) hold over the whole step; a plant's docstring names those that it cannot model.
``quad.disturbance``
    ``Parameters``, ``draw(parameters, vehicle, seed, duration) -> numpy array of floats, 2-D`` and
    ``sample(parameters, table, time) -> Conditions``. ``draw`` holds all that is random. It may be called with several
    durations for one flight: until the shorter one ends, both tables must give the same samples.
    Optional ``announcements(parameters) -> [(time s, kind, text)]``, in order: what `flight/events` reports then.
``quad.sensing``
    ``Parameters``, ``Memory``, ``draw(parameters, seed, steps) -> numpy array of floats, 2-D`` (all that is random in
    so many plant steps; as above, a longer table begins like a shorter one),
    ``init(parameters, plant_period) -> (line, Memory)`` (``plant_period`` in ns; in Python only, may raise ValueError)
    and ``step(parameters, table, line, memory, truth, fault, k) -> (state, Memory)``: the ``VehicleState`` that the
    controllers see at plant step ``k``, called in order for every step at which ``memory.active`` or ``memory.frozen``
    is true or ``fault`` is not the default; at the others the state is the truth. ``Memory`` has these two bool fields
    and holds no array; ``line`` is a 2-D array of floats that ``step`` may write to, such as a delay line.
"""

from collections.abc import Callable
from functools import cache
from importlib.metadata import entry_points
from traceback import extract_tb
from types import ModuleType
from typing import Any, NamedTuple

from quad_core.parameters import fields
from quad_core.records import leaves

POSITION_LAW = "quad.position_law"
ATTITUDE_LAW = "quad.attitude_law"
TRAJECTORY = "quad.trajectory"
PLANT = "quad.plant"
SENSING = "quad.sensing"
DISTURBANCE = "quad.disturbance"


LAW = ("Parameters", "Memory", "Internals", "init", "step")
"""What a module of a stage between reference and rotors must hold: a law, a filter, an estimator."""

OTHERS = {
    TRAJECTORY: ("Parameters", "Plan", "plan", "duration", "sample"),
    PLANT: ("Parameters", "State", "init", "step", "observe", "lumped"),
    DISTURBANCE: ("Parameters", "draw", "sample"),
    SENSING: ("Parameters", "Memory", "draw", "init", "step"),
}
"""{group: what a module of the groups other than those of the stages must hold}."""


class PluginError(ValueError):
    """A plug-in is unknown or lacks what its group demands; the text names it."""


class Law(NamedTuple):
    """A law as a stage runs it: a plug-in's module, or one within wrappers; ``name``: what it is called in messages."""

    name: str
    Parameters: type[Any]
    Memory: type[Any]
    Internals: type[Any]
    init: Callable[..., Any]
    step: Callable[..., Any]


class Wrapper(NamedTuple):
    """What a stage puts around its law: ``wrapped(law, inputs_type)`` gives the law with it.

    ``switch``: the parameter of the stage's node with a field ``enabled``, empty: always on. The wrapped law's
    ``Parameters`` are then (those of the law, that parameter).
    """

    wrapped: Callable[..., Law]
    switch: str = ""


@cache
def installed() -> Any:  # its type differs between releases of Python
    """Return the entry points of this environment, read once: each reading opens a file of every package in it."""
    return entry_points()


def names(group: str) -> list[str]:
    """Return the sorted names registered in ``group``."""
    return sorted({point.name for point in installed().select(group=group)})


def named(group: str, name: str) -> Any:
    """Return what is registered as ``name`` in ``group``.

    Raises PluginError if nothing has that name, several have it, or it cannot be imported.
    """
    points = [point for point in installed().select(group=group) if point.name == name]
    if not points:
        others = [other for other in (POSITION_LAW, ATTITUDE_LAW, *OTHERS) if name in names(other)]
        hint = f"; {name!r} is a {' and '.join(others)}" if others else ""
        raise PluginError(f"{group}: no plug-in named {name!r}; installed: {', '.join(names(group)) or 'none'}{hint}")
    values = sorted({point.value for point in points})
    if len(values) > 1:
        raise PluginError(f"{group}: {name!r} is the name of several plug-ins: {', '.join(values)}; rename one")
    try:
        return points[0].load()
    except Exception as error:  # whatever its text does when it is imported
        raise PluginError(f"{group}: plug-in {name!r} ({values[0]}) cannot be imported: {_mistake(error)}") from error


@cache
def load(group: str, name: str) -> ModuleType:
    """Return the module registered as ``name`` in ``group``.

    Raises PluginError as ``named``, or if the module misses something that the group demands, or one of its types has
    a field that the stack cannot carry.
    """
    module: ModuleType = named(group, name)
    contract = OTHERS.get(group, LAW)
    missing = [item for item in contract if not hasattr(module, item)]
    if missing:
        raise PluginError(f"{group}: plug-in {name!r} ({module.__name__}) lacks {', '.join(missing)}")
    try:
        for _ in fields(module.Parameters):
            pass
        if contract is LAW:
            leaves(module.Memory, "Memory")
            leaves(module.Internals, "Internals")
    except TypeError as error:
        raise PluginError(f"{group}: plug-in {name!r} ({module.__name__}): {error}") from error
    return module


def law_of(module: ModuleType) -> Law:
    """Return the law that a plug-in's module is."""
    return Law(module.__name__, module.Parameters, module.Memory, module.Internals, module.init, module.step)


def _mistake(error: Exception) -> str:
    """Return what went wrong, with the file and line unless the text of ``error`` has them or needs none."""
    if isinstance(error, ImportError):
        return str(error)
    said = f"{type(error).__name__}: {error}"
    if isinstance(error, SyntaxError):
        return said
    last = extract_tb(error.__traceback__)[-1]
    return f"{said} ({last.filename}, line {last.lineno})"
