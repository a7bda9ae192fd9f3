"""What is looked at before arming: rates and publishers of the streams, identity, plan; counted, not judged."""

import shutil
from collections import Counter
from collections.abc import Callable
from pathlib import Path

from quad_commander.arming import Observed, Stream
from quad_commander.parameters import CommanderParameters
from quad_core.cascade import ATTITUDE, COMMAND, POSITION
from quad_core.cycle import seconds
from quad_core.extent import Extent
from quad_core.flight_parameters import FlightParameters
from quad_core.geometry import norm, tilt
from quad_core.standing import Standing
from quad_core.types import Vec3
from quad_msgs.msg import FlightPlan, NodeStatus
from quad_node.responder import Sample

_STREAMS = {"attitude_setpoint": POSITION, COMMAND: ATTITUDE}


def free_space(folder: str) -> float:
    """Return the free space in GB of the disk on which ``folder`` lies or, if it does not exist yet, will lie."""
    place = Path(folder).resolve()
    while not place.exists():
        place = place.parent
    return shutil.disk_usage(place).free / 1e9


def on_autopilot(observed: Observed) -> Observed:
    """Return what is judged of a vehicle that an autopilot owns: it sends states at its own rate, which it has checked.

    Controllers answer each of them, and no more.
    """
    rate = 1.0 / observed.state_spacing if observed.state_spacing > 0.0 else 0.0
    streams = tuple(one._replace(expected_rate=min(one.expected_rate, rate)) for one in observed.streams)
    return observed._replace(announced_spacing=observed.state_spacing, streams=streams)


class Preflight:
    """Counts since ``begin``, and what the other nodes said last."""

    def __init__(self, flight: FlightParameters, settings: CommanderParameters) -> None:
        """Start with nothing heard."""
        self._flight, self._settings = flight, settings
        self._nodes: dict[str, NodeStatus] = {}
        self._plan: FlightPlan | None = None
        self._plans = 0
        self._counts: Counter[str] = Counter()
        self._first_step = self._first_states = 0
        self._standing = Standing()

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
        """Take in what a node says of itself; in a flight with a run id a status without one is dropped."""
        if status.run_id or not self._flight.run_id:
            self._nodes[status.node] = status

    def on_plan(self, plan: FlightPlan, flying: bool) -> None:
        """Take in a plan; a repetition changes nothing; in flight a new one replaces the old."""
        if plan != self._plan:
            self._plan, self._plans = plan, max(self._plans, 1) if flying else self._plans + 1

    def observed(
        self, sample: Sample, states: int, publishers: Callable[[str], int], disk: float, battery: float | None
    ) -> Observed:
        """Return what there is to be judged.

        ``publishers`` counts those of a topic, ``disk`` is free space in GB, ``battery`` a share of full.
        """
        period = self._flight.plant_period
        elapsed = seconds(sample.step - self._first_step, period)
        roles = {status.role: status for status in self._nodes.values()}
        periods = {role: status.period_steps for role, status in roles.items()}
        streams = [
            Stream(
                topic,
                publishers(topic),
                1.0 / seconds(periods[role], period) if periods.get(role) else 0.0,
                self._counts[topic] / elapsed,
            )
            for topic, role in _STREAMS.items()
        ]
        return Observed(
            run_id=self._flight.run_id,
            run_ids=tuple(sorted({status.run_id for status in self._nodes.values()} | {self._flight.run_id})),
            interface_hashes=tuple(sorted({status.interface_hash for status in self._nodes.values()})),
            streams=tuple(streams),
            announced_spacing=seconds(1, period),
            state_spacing=elapsed / max(states - self._first_states, 1),
            tilt=tilt(sample.state.q_wb),
            speed=norm(sample.state.v_w),
            drift=max(self._standing.drift, self._standing.speed),
            ground_z=sample.state.ground_z,
            body_rate=norm(sample.state.omega_b),
            battery=battery,
            disk=disk,
            plan=self._extent(),
            plans=self._plans,
            faulty_nodes=tuple(sorted(s.role for s in roles.values() if s.state == NodeStatus.FAULT)),
        )

    def _extent(self) -> Extent | None:
        plan = self._plan
        if plan is None:
            return None
        low, high = Vec3(*map(float, plan.low)), Vec3(*map(float, plan.high))
        length = plan.end.sec - plan.stamp.sec + 1e-9 * (plan.end.nanosec - plan.stamp.nanosec)
        return Extent(low, high, plan.speed, plan.acceleration, plan.tilt, length)
