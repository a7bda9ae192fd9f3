"""Arming: what nodes, rates, vehicle and plan say against a take-off; node and core of the commander add theirs.

    looked = Preflight(flight, settings)
    looked.begin(sample, states)                # when ARMING begins; then on_node, on_plan, count, note
    reasons = looked.refusals(sample, states, wrong, battery)           # every 0.3 s; empty: the checks have passed

A reason names what was found and what was expected, so that it can be shown to the operator as it is.
"""

import math
from collections import Counter
from collections.abc import Sequence

from quad_commander.parameters import CommanderParameters
from quad_core.cascade import ATTITUDE, COMMAND, POSITION
from quad_core.cycle import seconds
from quad_core.enumerations import NodeState
from quad_core.flight_parameters import FlightParameters
from quad_core.geometry import norm, tilt
from quad_core.lift_off import Standing
from quad_core.types import Vec3
from quad_msgs.msg import AutopilotStatus, FlightPlan, NodeStatus
from quad_node.responder import Sample

_STREAMS = {"attitude_setpoint": POSITION, COMMAND: ATTITUDE}


class Preflight:
    """Counts since ``begin``, and what the other nodes said last."""

    def __init__(self, flight: FlightParameters, settings: CommanderParameters) -> None:
        self._flight, self._settings, self._limits = flight, settings, settings.arming
        self._periods: dict[str, int] = {}  # by role, in plant steps
        self._others: set[tuple[str, str]] = set()  # name and run id of nodes of other runs, which may have equal names
        self._plan: FlightPlan | None = None
        self._plans = 0
        self._counts: Counter[str] = Counter()
        self._first_step = self._first_states = 0
        self._standing = Standing()
        # by attitude alone a vehicle needs no torque
        self._streams = {topic: role for topic, role in _STREAMS.items() if role in flight.role_names}

    def begin(self, sample: Sample, states: int) -> None:
        """Count from the step of ``sample`` on; ``states`` were seen so far."""
        self._counts.clear()
        self._first_step, self._first_states = sample.step, states

    def note(self, sample: Sample) -> None:
        """Take in a state of the vehicle on the ground."""
        self._standing.note(seconds(sample.step, self._flight.plant_period), sample.state)

    def count(self, topic: str) -> None:
        """Count a message of a stream."""
        self._counts[topic] += 1

    def on_node(self, status: NodeStatus) -> None:
        """Take in what a node says of itself; in a flight with a run id a status without one is dropped.

        A node of another run that leaves is forgotten.
        """
        own = self._flight.run_id
        if own in ("", status.run_id):
            self._periods[status.role] = status.period_steps
        if status.state in (NodeState.DONE, NodeState.FAULT):
            self._others.discard((status.node, status.run_id))
        elif status.run_id not in ("", own):
            self._others.add((status.node, status.run_id))

    def on_plan(self, plan: FlightPlan, flying: bool) -> None:
        """Take in a plan; a repetition changes nothing; in flight a new one replaces the old."""
        if plan != self._plan:
            self._plan, self._plans = plan, max(self._plans, 1) if flying else self._plans + 1

    def refusals(
        self,
        sample: Sample,
        states: int,
        wrong: Sequence[str],
        battery: float | None,
        autopilot: AutopilotStatus | None = None,
        is_first_look: bool = False,
    ) -> list[str]:
        """Return every reason against arming; none: the vehicle may take off, or after the ``is_first_look`` be armed.

        ``wrong``: what is known already, such as a topic with a second publisher; ``battery`` is a share of full, None
        where nothing tells it.
        """
        found = [*self._of_nodes(), *wrong, *self._of_streams(sample, states, autopilot is not None)]
        is_armed = autopilot is not None and autopilot.armed
        found += [*self._of_vehicle(sample, battery, is_armed), *self._of_plan(sample.state.ground_z)]
        if autopilot is not None and not (is_armed or is_first_look):
            why = f": {autopilot.reasons}" if autopilot.reasons else ""
            found.append(f"autopilot: found it disarmed in {autopilot.mode}{why}, expected armed")
        return found

    def _of_nodes(self) -> list[str]:
        own = self._flight.run_id
        found = [] if own else ["flight.run_id is empty; arming needs a run id"]
        if others := sorted({run_id for _, run_id in self._others}):
            found.append(f"run ids: found {', '.join(map(repr, others))} too, expected {own!r} alone")
        return found

    def _of_streams(self, sample: Sample, states: int, of_autopilot: bool) -> list[str]:
        """Return what is wrong with rates. An autopilot sends states at its own rate; controllers answer each."""
        found, plant_period, limits = [], self._flight.plant_period, self._limits
        elapsed = seconds(sample.step - self._first_step, plant_period)
        if elapsed <= 0.0:  # without states a slow commander decides on one step again
            return ["state: found none since the checks began, expected some"]
        spacing, announced = elapsed / max(states - self._first_states, 1), seconds(1, plant_period)
        for topic, role in self._streams.items():
            period = self._periods.get(role)
            expected = 1.0 / seconds(period, plant_period) if period else 0.0
            if of_autopilot:
                expected = min(expected, 1.0 / spacing if spacing > 0.0 else 0.0)
            low, high = ((1.0 + side * limits.rate_tolerance) * expected for side in (-1.0, 1.0))
            rate = self._counts[topic] / elapsed
            if not low <= rate <= high:
                found.append(f"{topic}: found {rate:.1f} Hz, expected {low:.1f} to {high:.1f} Hz")
        low, high = announced / limits.spacing_factor, announced * limits.spacing_factor
        if not of_autopilot and not low <= spacing <= high:
            found.append(
                f"state: found samples {1e3 * spacing:.2f} ms apart, expected {1e3 * low:.2f} to {1e3 * high:.2f} ms: "
                f"{1e3 * announced:.2f} ms are announced"
            )
        return found

    def _of_vehicle(self, sample: Sample, battery: float | None, is_armed: bool) -> list[str]:
        """Return what is wrong with the vehicle; whether its estimate rests was looked at before it was armed."""
        state, limits, found = sample.state, self._limits, []
        angle = tilt(state.q_wb)
        if not angle < limits.tilt:
            degrees, largest = math.degrees(angle), math.degrees(limits.tilt)
            found.append(f"tilt: found {degrees:.1f} deg, expected less than {largest:.1f} deg")
        if not (rate := norm(state.omega_b)) < limits.rate:
            found.append(f"body rate: found {rate:.2f} rad/s, expected less than {limits.rate:.2f} rad/s")
        if not is_armed and (moves := self._standing.refusal(limits.speed, "state")):
            found.append(moves)
        if battery is not None and not battery >= limits.battery:
            found.append(f"battery: found {100.0 * battery:.0f} %, expected at least {100.0 * limits.battery:.0f} %")
        return found

    def _of_plan(self, ground_z: float) -> list[str]:
        plan, fence, flight = self._plan, self._settings.fence, self._settings.limits
        if self._plans > 1:
            return [f"plan: found {self._plans} different ones, expected one, latched"]
        if plan is None:
            return ["plan: found none, expected one, latched"]
        corners = [Vec3(*map(float, corner)) for corner in (plan.low, plan.high)]
        found = [
            f"plan: found it outside the fence at ({', '.join(f'{part:.1f}' for part in corner)}) m, expected it within"
            for corner in corners
            if fence.excludes(corner, ground_z)
        ]
        duration = plan.end.sec - plan.stamp.sec + 1e-9 * (plan.end.nanosec - plan.stamp.nanosec)
        for name, value, largest, unit in (
            ("a speed", plan.speed, flight.speed, "m/s"),
            ("an acceleration", plan.acceleration, flight.acceleration, "m/s^2"),
            ("a tilt", plan.tilt, flight.tilt, "rad"),
            ("a duration", duration, self._limits.longest_flight, "s"),
        ):
            if not 0.0 <= value <= largest:
                found.append(f"plan: found {name} of {value:.2f} {unit}, expected at most {largest:.2f} {unit}")
        return found
