"""One flight without ROS, described by the same parameters as the nodes."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_core.cascade import ROLES, SIMULATOR, STAGES, TRAJECTORY
from quad_core.cycle import seconds
from quad_core.parameters import ParameterError, Value
from quad_core.records import builder, leaves
from quad_core.resolution import Resolved, check_agreement, resolve
from quad_core.rich_display import flight_html
from quad_dynamics.simulated_vehicle import RandomStreams, link_init
from quad_flight import loop, rows
from quad_flight.engine import Engine, EngineError, Modules, compiled_engine, explain, python_engine, signs_of_life
from quad_flight.loop import LoopState, Schedule, Setup, Start, take_off
from quad_flight.score import MEASURES, NOTHING_SCORED, Score
from quad_flight.set_up import Request, resolve_flight
from quad_flight.stages import PerStage, Signals
from quad_guard.ending import described, has_ground, stands

OUTCOMES = {
    loop.ENDED: "ended",
    loop.DIVERGED: "diverged",
    loop.REFUSED: "refused",
    loop.TAKEN_OVER: "taken over",
    loop.INFEASIBLE: "infeasible",
}
_BLOCK_SECONDS = 1.0


class Flight(NamedTuple):
    """All that decides a flight: plug-ins, their parameters, the schedule and the seed."""

    modules: Modules
    setup: Setup
    seed: int
    resolved: dict[str, Resolved]


class Result(NamedTuple):
    """How a flight went, one of ``OUTCOMES``.

    Ended, diverged (left its bounds), refused (a number was not finite, no plan), taken over, or infeasible (flown to
    the end, but the position law at a limit came no nearer to a reference 1 m or more away for more than 2 s).

    ``refused``: role of the stage whose output or memory held that number, else empty. ``reason``: why a flight was
    refused before its first step, in the words of the plug-in that did (a trajectory that cannot be flown within its
    limits, a plant without mass), else empty. ``steps`` of ``end_step``
    planned plant steps were flown; ``trajectory_start`` is the time of t = 0 in s; ``topics`` holds one structured
    array per step topic, empty where nothing was logged. ``guard``: mode, reason and step at which the guard took the
    vehicle from the controller, empty if it never did.
    """

    outcome: str
    steps: int
    end_step: int
    trajectory_start: float
    score: Score
    topics: dict[str, NDArray[Any]]
    refused: str = ""
    reason: str = ""
    guard: str = ""

    @property
    def rmse(self) -> float:
        """Root mean square distance from the reference in m over the counted steps; NaN if none was counted."""
        return MEASURES["rmse"].of(self.score)

    def __repr__(self) -> str:
        """Return the text form, without the arrays, which would flood a terminal."""
        rows = ", ".join(f"{name}: {len(table)} rows" for name, table in self.topics.items())
        return f"Result({self.outcome}, {self.steps} of {self.end_step} steps, RMSE {self.rmse:.4g} m, {{{rows}}})"

    def _repr_html_(self) -> str:
        """Return what a notebook shows: outcome, errors and the path."""
        rows = {"outcome": " ".join(filter(None, (self.outcome, self.reason, self.guard)))}
        if self.score.samples:
            errors = (self.rmse, self.score.largest_error, self.score.last_error)
            names = ("position error, RMS", "largest", "at the end")
            rows |= {name: f"{1000.0 * error:.3g} mm" for name, error in zip(names, errors, strict=True)}
        return flight_html(rows, *(self.topics[name]["p_w"] for name in ("truth", "reference")))


def from_names(case: str, **choices: Any) -> Flight:
    """Return the flight that ``scripts/fly CASE`` flies with these choices, the fields of ``set_up.Request``.

    For example ``from_names("case1", preset="tuned", seed=7, settings=["vehicle.mass=0.6"])``. Without a commander, an
    odometry relay and shadows: modes, missions and estimators are flown over ROS alone. Raises ParameterError or
    PluginError naming the file or key, what was found and what was expected.
    """
    unknown = [name for name in choices if name not in Request._fields]
    if unknown:
        raise ParameterError(f"from_names: found {unknown[0]!r}, expected one of {', '.join(Request._fields[1:])}")
    return flight_from_resolved(resolve_flight(Request(case, **choices), {}))


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
    """Return the flight of nodes with the parameters ``resolved``; ``score_from`` as in ``flight_from_parameters``."""
    simulator, trajectory = resolved[SIMULATOR], resolved[TRAJECTORY]
    parts = {**simulator.plugins, **trajectory.plugins}
    laws = [resolved[stage.role].law for stage in STAGES]
    shown = [law.module.Internals for law in laws]  # all numbers 0
    schedule = Schedule(
        simulator.flight.plant_period,
        trajectory.node.period_steps,
        PerStage(*(resolved[stage.role].node.period_steps for stage in STAGES)),
        score_from,
    )
    modules = Modules(
        **{name: part.module for name, part in parts.items()}, stages=PerStage(*(law.module for law in laws))
    )
    setup = Setup(
        simulator.vehicle,
        schedule,
        **{name: part.parameters for name, part in parts.items()},
        stages=PerStage(*(law.parameters for law in laws)),
        internals=PerStage(*(builder(kind)([leaf.kind(0) for leaf in leaves(kind)]) for kind in shown)),
        guard=simulator.node.guard,
    )
    return Flight(modules, setup, simulator.flight.seed, resolved)


def fly(flight: Flight, *, compiled: bool = False, logging: bool = True) -> Result:
    """Fly ``flight`` to its end; both engines give the same bits.

    Raises EngineError if ``compiled`` and a plug-in cannot be compiled, or there is no Numba.
    """
    if not compiled:
        return _fly(flight, python_engine(flight.modules), logging)
    try:
        from numba.core.errors import NumbaError
    except ImportError as error:
        raise EngineError("compiled flights need Numba, which is not installed (requirements/extras.txt)") from error

    try:
        with signs_of_life((flight.modules, logging)):
            return _fly(flight, compiled_engine(flight.modules), logging)
    except (NumbaError, TypeError) as error:
        raise explain(flight.modules, error) from error


def _fly(flight: Flight, engine: Engine, logging: bool) -> Result:
    plant, schedule = flight.setup.plant, flight.setup.schedule
    setup = flight.setup._replace(has_ground=has_ground(plant), stands=stands(plant))
    flight = flight._replace(setup=setup)
    sensing_line, sensing = flight.modules.sensing.init(setup.sensing, schedule.plant_period)
    link_line, linked = link_init()
    memory = PerStage(
        *(module.init(own, setup.vehicle) for module, own in zip(flight.modules.stages, setup.stages, strict=True))
    )
    start = Start(sensing, linked, memory, Signals(*(stage.output_type() for stage in STAGES)))
    try:
        carry = take_off(engine.functions, setup, RandomStreams(*_drawn(flight, 1), sensing_line, link_line), start)
    except ValueError as error:  # as the nodes, which end such a flight with the event plan_refused
        return Result(OUTCOMES[loop.REFUSED], 0, 0, float("nan"), NOTHING_SCORED, {}, reason=str(error))
    first = flight.modules.trajectory.sample(setup.trajectory, carry.plan, 0.0)
    drawn = RandomStreams(*_drawn(flight, carry.end), sensing_line, link_line)
    topics: dict[str, NDArray[Any]] = {}
    if logging:
        carry, blocks = _logged(flight, engine, drawn, carry)
        if blocks:
            topics = rows.split(flight.modules.stages, schedule, blocks, carry.refused)
    else:
        carry = engine.fly(setup, drawn, carry, carry.end, np.empty((0, 0)))
    refused = STAGES[carry.refused - 1].role if carry.refused else ""
    return Result(
        OUTCOMES[carry.outcome],
        carry.step,
        carry.end,
        -first.trajectory_time,
        carry.score,
        topics,
        refused,
        guard=described(carry.guard.mode, carry.guard.reason, carry.guard.since),
    )


def _logged(
    flight: Flight, engine: Engine, drawn: RandomStreams, carry: LoopState
) -> tuple[LoopState, list[rows.Block]]:
    """Fly to the end block by block, so that little memory stands ready."""
    width = len(rows.names(flight.modules.stages))
    length = max(1, round(_BLOCK_SECONDS * 1e9 / flight.setup.schedule.plant_period))
    blocks = []
    while carry.outcome == loop.FLYING:
        first, block = carry.step, np.empty((length, width))
        carry = engine.fly_logged(flight.setup, drawn, carry, length, block)
        # a step that was refused is logged, but not flown
        blocks.append((first, block[: carry.step - first + (carry.outcome == loop.REFUSED)]))
    return carry, blocks


def _drawn(flight: Flight, steps: int) -> tuple[Any, Any]:
    """Return what is random in ``steps`` plant steps: of the disturbance and of the sensing."""
    setup, modules = flight.setup, flight.modules
    length = seconds(steps, setup.schedule.plant_period)
    return (
        modules.disturbance.draw(setup.disturbance, setup.vehicle, flight.seed, length),
        modules.sensing.draw(setup.sensing, flight.seed, steps),
    )
