"""One flight without ROS, told by the same parameters as the nodes."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_campaign import loop
from quad_campaign.engine import compiled_engine, compiled_logger, explain, python_engine
from quad_campaign.loop import Carry, Drawn, Schedule, Setup
from quad_campaign.records import from_rows, to_rows, with_steps
from quad_campaign.score import Score
from quad_campaign.stages import Modules
from quad_core.node_parameters import ROLES, Resolved, check_agreement, resolve
from quad_core.parameter_files import overrides_for, read_parameter_file
from quad_core.parameters import ParameterError, Value
from quad_core.timing import seconds
from quad_core.types import Actuation, AttitudeThrust, Disturbance, TrajectoryPoint, VehicleState, Wrench
from quad_dynamics import link

OUTCOMES = {loop.ENDED: "ended", loop.DIVERGED: "diverged", loop.REFUSED: "refused"}
_BLOCK_SECONDS = 1.0


class Flight(NamedTuple):
    """All that decides a flight: plug-ins, their parameters, the schedule and the seed."""

    modules: Modules
    setup: Setup
    seed: int
    internals: tuple[type[Any], type[Any]]
    resolved: dict[str, Resolved]


class Result(NamedTuple):
    """How a flight went. ``outcome``: ended, diverged (left its bounds) or refused (a law gave a non-finite number).

    ``steps`` of ``end_step`` planned plant steps were flown; ``trajectory_start`` is the time of t = 0 in s;
    ``topics`` holds one structured array per step topic, empty where nothing was logged.
    """

    outcome: str
    steps: int
    end_step: int
    trajectory_start: float
    score: Score
    topics: dict[str, NDArray[Any]]

    @property
    def rmse(self) -> float:
        """Root mean square distance from the reference in m over the counted steps; NaN if none was counted."""
        return float(np.sqrt(self.score.squared_error / self.score.samples)) if self.score.samples else float("nan")


def flight_from_files(files: list[Path], changes: Mapping[str, Mapping[str, Value]] | None = None) -> Flight:
    """Return the flight that the ROS parameter ``files`` describe, later files and ``changes`` winning.

    Raises ParameterError or PluginError as the nodes would.
    """
    contents = [read_parameter_file(path) for path in files]
    changes = changes or {}
    shared = changes.get("/**", {})
    overrides = {role: {**overrides_for(contents, role), **shared} for role in ROLES}
    for role, values in changes.items():
        overrides.setdefault(role, {}).update(values)
    return flight_from_parameters(overrides)


def flight_from_parameters(overrides: Mapping[str, Mapping[str, Value]], score_from: float = 0.0) -> Flight:
    """Return the flight of {node: {dotted parameter: value}}; what stands under ``/**`` holds for all nodes.

    ``score_from``: trajectory time in s from which errors are counted.

    Raises:
        ParameterError: an unknown node, key or value, or nodes that disagree about ``flight.*`` or ``vehicle.*``.
        PluginError: no such plug-in.
    """
    strangers = [node for node in overrides if node not in ROLES and node != "/**"]
    if strangers:
        raise ParameterError(f"{strangers[0]}: no such node; expected one of {', '.join(ROLES)} or /**")
    shared = overrides.get("/**", {})
    resolved = {role: resolve(role, {**shared, **overrides.get(role, {})}) for role in ROLES}
    check_agreement(resolved)
    return flight_from_resolved(resolved, score_from)


def flight_from_resolved(resolved: dict[str, Resolved], score_from: float = 0.0) -> Flight:
    """Return the flight of nodes that were told ``resolved``; ``score_from`` as in ``flight_from_parameters``."""
    plant, weather, sensing = (resolved["simulator"].plugins[slot] for slot in ("plant", "disturbance", "sensing"))
    path = resolved["trajectory"].plugins["trajectory"]
    position = resolved["position_controller"].plugins["law"]
    attitude = resolved["attitude_controller"].plugins["law"]
    schedule = Schedule(
        resolved["simulator"].flight.plant_period,
        resolved["trajectory"].node.period_steps,
        resolved["position_controller"].node.period_steps,
        resolved["attitude_controller"].node.period_steps,
        score_from,
    )
    vehicle = resolved["simulator"].vehicle
    return Flight(
        Modules(plant.module, weather.module, path.module, position.module, attitude.module, sensing.module),
        Setup(
            vehicle,
            schedule,
            plant.parameters,
            weather.parameters,
            path.parameters,
            position.parameters,
            attitude.parameters,
            sensing.parameters,
        ),
        resolved["simulator"].flight.seed,
        (position.module.Internals, attitude.module.Internals),
        resolved,
    )


def fly(flight: Flight, *, compiled: bool = False, logging: bool = True) -> Result:
    """Fly ``flight`` to its end; both engines give the same bits.

    Raises EngineError if ``compiled`` and a plug-in cannot be compiled.
    """
    if not compiled:
        return _fly(flight, python_engine(flight.modules), _plain_logger(flight) if logging else None)
    from numba.core.errors import NumbaError

    try:
        logger = compiled_logger(flight.modules, tuple(_kinds(flight).values())) if logging else None
        return _fly(flight, compiled_engine(flight.modules), logger)
    except (NumbaError, TypeError) as error:
        raise explain(flight.modules, error) from error


def _fly(flight: Flight, engine: Any, logger: Any) -> Result:
    setup, schedule = flight.setup, flight.setup.schedule
    sensing_line, sensing = flight.modules.sensing.init(setup.sensing, schedule.plant_period)
    link_line, linked = link.init()
    carry: Carry = engine.take_off(setup, Drawn(*_drawn(flight, 1), sensing_line, link_line), sensing, linked)
    start = flight.modules.trajectory.sample(setup.trajectory, carry.plan, 0.0)
    drawn = Drawn(*_drawn(flight, carry.end), sensing_line, link_line)
    block = max(1, round(_BLOCK_SECONDS * 1e9 / schedule.plant_period))
    blocks = []
    while carry.outcome == loop.FLYING:
        if logger is None:
            carry, _ = engine.fly(setup, drawn, carry, carry.end, False)
        else:
            carry, rows = logger(setup, drawn, carry, block)
            blocks.append(rows)
    topics = {}
    if blocks:
        for (name, kind), parts in zip(_kinds(flight).items(), zip(*blocks, strict=True), strict=True):
            values = from_rows(kind, np.concatenate(parts))
            topics[name] = with_steps(values, _period(name, schedule), schedule.plant_period)
    return Result(OUTCOMES[carry.outcome], carry.step, carry.end, -start.trajectory_time, carry.score, topics)


def _drawn(flight: Flight, steps: int) -> tuple[Any, Any]:
    """Return what is random in ``steps`` plant steps: of the disturbance and of the sensing."""
    setup, modules = flight.setup, flight.modules
    length = seconds(steps, setup.schedule.plant_period)
    return (
        modules.disturbance.draw(setup.disturbance, setup.vehicle, flight.seed, length),
        modules.sensing.draw(setup.sensing, flight.seed, steps),
    )


def _plain_logger(flight: Flight) -> Any:
    plain = python_engine(flight.modules).fly
    kinds = _kinds(flight).values()

    def logger(setup: Setup, drawn: Drawn, carry: Carry, steps: int) -> tuple[Carry, tuple[NDArray[np.float64], ...]]:
        after, records = plain(setup, drawn, carry, steps, True)
        return after, tuple(to_rows(kind, items) for kind, items in zip(kinds, records, strict=True))

    return logger


def _period(topic: str, schedule: Schedule) -> int:
    """Return the plant steps between two messages of a step topic."""
    if topic == "reference":
        return schedule.trajectory_steps
    if topic in ("attitude_setpoint", "position_controller/internals"):
        return schedule.position_steps
    return schedule.attitude_steps if topic in ("wrench_setpoint", "attitude_controller/internals") else 1


def _kinds(flight: Flight) -> dict[str, type[Any]]:
    """Return {topic: what it carries} in the order of ``loop.Records``."""
    position, attitude = flight.internals
    return {
        "truth": VehicleState,
        "state": VehicleState,
        "disturbance": Disturbance,
        "actuation": Actuation,
        "reference": TrajectoryPoint,
        "attitude_setpoint": AttitudeThrust,
        "position_controller/internals": position,
        "wrench_setpoint": Wrench,
        "attitude_controller/internals": attitude,
    }
