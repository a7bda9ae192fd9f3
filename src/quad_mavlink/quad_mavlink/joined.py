"""`ros2 run quad_mavlink joined_plant`: our plant under PX4 firmware, which our own laws fly by torque.

One process owns both: PX4's clock, through its simulator interface (sensors out, motor outputs back), and the bridge to
PX4 over DDS. So the plant can wait for every late answer, and a flight does not depend on how busy the machine is.
"""

import sys
import time
from collections import deque
from functools import partial
from typing import NamedTuple

from quad_autopilot import odometry
from quad_autopilot.autopilot import listed
from quad_autopilot.autopilot_flight import BEAT, Taken
from quad_autopilot.evidence import Phase
from quad_core.cascade import COMMAND, COMMANDER, STAGES
from quad_core.cycle import is_flyable, seconds
from quad_core.resolution import Resolved
from quad_core.types import Actuation, Disturbance, VehicleState, Wrench
from quad_dynamics.node import announce
from quad_dynamics.plant_model import PlantModel
from quad_mavlink import link, motors
from quad_mavlink.gate import Decision, Gate, foreign_stamp
from quad_mavlink.motors import Exchange, RefusedError
from quad_mavlink.parameters import JOINED
from quad_mavlink.sensors import Sensors, Suite
from quad_msgs.msg import FlightState
from quad_node.codec import head_of
from quad_node.main import run
from quad_px4.node import Px4Bridge
from quad_px4.parameters import AirframeParameters

_TICK, _SLICE = 0.00025, 0.004  # s between two looks at the gate, and of steps without a look at ROS
_BACKLOG = 64
_ANSWERED = (Phase.STANDBY, Phase.MODE, Phase.ARM, Phase.SPOOL_UP, Phase.FLY)  # the flight waits for its nodes
_BEFORE = -1  # step of the plant before step 0: what acts is what acts at the beginning
SUMMARY = """Our plant under PX4 firmware, flown by our laws: torque over DDS, sensors and motors over TCP.

Usually started by scripts/fly --realtime --vehicle-interface joined=FILE; then start PX4: it connects by itself.
Exit codes: 0 flown to the end and landed, 1 failed, 2 bad set-up."""


class Moved(NamedTuple):
    """What the plant did up to the time ``at`` (us), and what acts from then on."""

    at: int
    truth: VehicleState
    disturbance: Disturbance
    actuation: Actuation


def _airframe(resolved: Resolved) -> AirframeParameters:
    """Return the vehicle as PX4 has it: the plant's."""
    return motors.airframe(resolved.vehicle, resolved.node.thrust_curve)


class JoinedPlant:
    """A bridge to PX4, by the clock of the plant that it integrates."""

    def __init__(self) -> None:
        """Make bridge, plant and sensors and open the port; raises ParameterError if it cannot fly."""
        self.bridge = Px4Bridge(
            JOINED,
            lambda resolved: _airframe(resolved)._replace(thr_mdl_fac=resolved.node.thrust_curve),
            self.take_estimate,
            activate=self.activate,
            progress=self.take_wrench,
            missing=self.missing,
            refusal=self.refusal,
            shut_down=self.shut_down,
            clock=self.clock,
            predicts=False,
        )
        self.flight, self.leader, self.settings = self.bridge.flight, self.bridge.leader, self.bridge.settings
        self.node = node = self.bridge.node
        mavlink, period = link.load(), node.flight.plant_period
        self.model = PlantModel(node.resolved)
        self._server = link.Server(mavlink, self.settings.listen)
        sensors = Sensors(truth_steps=self.settings.truth_period_steps)
        suite = Suite(sensors, node.flight.seed, period, node.vehicle.gravity)
        self.exchange, self.gate = Exchange(mavlink, self._server, suite), Gate(self.settings.gate)
        self._period_us, self._dt = period // 1000, seconds(1, period)
        self._truth_out, self._disturbance_out = self.leader.output("truth"), self.leader.output("disturbance")
        self._moved: deque[Moved] = deque(maxlen=_BACKLOG)
        self._is_asked = self._are_outputs_due = False
        self._booting, self._steps, self._outputs = "the plant", 0, motors.AT_REST
        self._idle_from, self._asked_at, self._next_beat = time.monotonic(), 0.0, 0.0
        answers = {COMMANDER: "reference", **{stage.role: stage.output for stage in STAGES}}
        self._answers = {role: topic for role, topic in answers.items() if role in node.roles}
        for topic in set(self._answers.values()) - {COMMAND}:
            node.links.subscribe(topic, partial(self._on_payload, topic), raw=True)
        node.every(_TICK, self._drive)

    def activate(self) -> None:
        """Say which airframe PX4 must have; await every answer from now on."""
        self.bridge.activate()
        text = f"PX4 must have {motors.described(_airframe(self.node.resolved))}"
        self.node.events.info("airframe", text, always=True)
        period_of = self.leader.handshake.period
        self.gate.expect({topic: period_of(role) for role, topic in self._answers.items()})

    @property
    def time_usec(self) -> int:
        """Time of the last reading in us: PX4's clock."""
        return self.exchange.suite.time_usec

    def clock(self) -> float:
        """Return the plant's time in s, which is PX4's."""
        return 1e-6 * self.time_usec

    def missing(self) -> list[str]:
        """Return what PX4 still has to do before it is asked for anything."""
        if self._booting:
            return [self._booting]
        said = self.flight.said
        if said is None:
            return ["vehicle_status from PX4: is its uXRCE-DDS agent running?"]
        if self.flight.state is None:
            return ["vehicle_odometry from PX4 that can be accepted"]
        if self.flight.phase == Phase.STREAM and not said.checks_pass:
            return [f"PX4's pre-flight checks ({listed(said.reasons) or 'no reason given'})"]
        return []

    def refusal(self) -> str:
        """Return why the vehicle must not fly: as the bridge, or because PX4's stamps are of another clock."""
        stamp, now = self.flight.stamps().sampled, self.time_usec
        return self.bridge.refusal() if Gate.is_of_our_clock(stamp, now) else foreign_stamp(stamp, now)

    def take_estimate(self, sample: odometry.Sample) -> Taken:
        """Learn when the next estimate is due, await the answers to this one, and publish what was true by then."""
        taken = self.bridge.take_estimate(sample)
        if taken.published:
            self.gate.on_published(self.node.current_step)
            self._publish_moved()
        if taken.accepted:
            self.gate.on_state(sample.timestamp_sample, self.time_usec)
        return taken

    def take_wrench(self) -> None:
        """Pass on a wrench that has just come, and go on if that was what the plant waited for."""
        before, newest = self.bridge.passed_on, self.leader.wrenches.newest
        self.bridge.take_wrench()
        if self.bridge.passed_on is not before and self.flight.may_fly():
            self._are_outputs_due, self._idle_from = True, time.monotonic()
        if newest is not None:
            self._on_answer(COMMAND, newest.step, self.node.run)

    def _on_payload(self, topic: str, payload: bytes) -> None:
        self._on_answer(topic, *head_of(payload))

    def _on_answer(self, topic: str, step: int, run: int) -> None:
        if not self.node.is_foreign(topic, run):
            self.gate.on_answer(topic, step)
            self._drive()

    def _drive(self) -> None:
        """Go on as far as the gate permits, then let the other callbacks have their turn."""
        until = time.monotonic() + _SLICE
        try:
            while not self.flight.is_over and time.monotonic() < until and self._advance(until):
                pass
        except RefusedError as error:
            self._fail(str(error))

    def _advance(self, until: float) -> bool:
        """Return whether the plant made a step."""
        found = self._boot(until) if self._steps == 0 else None
        if found is None and not self._is_asked:
            if self._steps == 0 or not self._may_go_on():
                return self._is_gone()
            self.exchange.send(self.model.truth, self.model.conditions.wind_w)
            self._is_asked, self._asked_at = True, time.monotonic()
        found = found or self._outputs_by(until)
        if found is not None:
            self._outputs = found
            self._integrate(found)
        elif time.monotonic() - self._asked_at > self.settings.gate.answer_timeout:
            self._fail(f"PX4 does not answer: no HIL_ACTUATOR_CONTROLS for {self.settings.gate.answer_timeout:g} s")
        return found is not None or self._is_gone()

    def _boot(self, until: float) -> motors.Answer | None:
        """Run the clock of a PX4 that boots; return its first outputs if they come."""
        if not self._server.accept():
            self._booting = f"an autopilot on tcp {self.settings.listen}"
            return None
        found = self.exchange.boot(self.model.truth, self.model.conditions.wind_w, self._dt, until)
        self._booting = "" if found else "the autopilot's first HIL_ACTUATOR_CONTROLS"
        return found

    def _outputs_by(self, until: float) -> motors.Answer | None:
        """Return PX4's outputs for the reading: once offboard is asked for, the last ones if no new ones come.

        Its motors then follow setpoints, not the gyro, and a reading alone makes no new outputs.
        """
        patience = until - time.monotonic()
        if self.flight.phase == Phase.STREAM:
            return self.exchange.answer(max(patience, 0.0))
        gate = self.settings.gate
        left = self._asked_at + (gate.settle if self.flight.is_obeyed() else gate.linger) - time.monotonic()
        found = self.exchange.newest(max(min(left, patience), 0.0))
        return found or (self._outputs if left <= patience and not self._server.is_closed else None)

    def _is_gone(self) -> bool:
        """Fail if PX4 has left; false in any case: nothing more can be done now."""
        if self._server.is_closed:
            self._fail("PX4 closed the connection to its simulator")
        return False

    def _may_go_on(self) -> bool:
        flight, leader, idle = self.flight, self.leader, time.monotonic() - self._idle_from
        if self._are_outputs_due:  # the wrench is out; its outputs say that it has arrived
            found = self.exchange.newest(0.0)
            self._outputs = found or self._outputs
            self._are_outputs_due = found is None and idle < self.settings.gate.linger
            if self._are_outputs_due:
                return False
        is_flying = leader.phase == FlightState.FLYING and flight.phase in _ANSWERED
        is_flying = is_flying and not (flight.stop or leader.guard.taken_over)
        is_flying = is_flying and (flight.phase != Phase.FLY or flight.is_obeyed())
        decision = self.gate.decide(self.time_usec + self._period_us, idle, is_flying)
        if decision == Decision.UNANSWERED:
            waited = f"no {self.gate.missing} for {self.settings.gate.answer_timeout:g} s, for which the plant waited"
            flight.stop = f"controllers: step {self.node.current_step}: {waited}"
            self.bridge.step()
        if decision == Decision.OVERDUE:
            text = f"no vehicle_odometry for {self.settings.gate.overdue:g} s by the wall clock, though one was due"
            self.node.events.warn("state_overdue", text, leader.elapsed_ns)
        return decision != Decision.WAIT

    def _integrate(self, answer: motors.Answer) -> None:
        """Go on by one step, and beat if it is time to."""
        step, wrench = self._step_at(self.time_usec), motors.wrench(self.bridge.mapping, answer)
        if step > _BEFORE:
            wrench = self.model.receive(step, wrench, step).wrench
        truth = self.model.advance(max(step, _BEFORE), wrench if answer.armed else Wrench())
        self._is_asked, self._idle_from = False, time.monotonic()
        self._steps += 1
        if not is_flyable(truth):
            self._fail(f"diverged: the state left its bounds at t = {(step + 1) * self._dt:.3f} s")
            return
        at = self.time_usec + self._period_us
        self._moved.append(Moved(at, truth, self.model.disturbance(), self.model.actuation))
        self._publish_moved()
        if self.clock() >= self._next_beat:
            self._next_beat = self.clock() + BEAT - 1e-6
            self.bridge.step()

    def _step_at(self, time_usec: int) -> int:
        """Return the step of the flight at a time of PX4, negative before step 0."""
        return (time_usec - self.flight.origin) // self._period_us if self.flight.origin >= 0 else _BEFORE

    def _publish_moved(self) -> None:
        """Publish truth, disturbance and actuation of the flight's steps, those before its origin was known too."""
        node = self.node
        if self.flight.origin < 0 or self.leader.phase != FlightState.FLYING:
            return
        while self._moved:
            at, truth, disturbance, actuation = self._moved.popleft()
            step = self._step_at(at)
            if step < 0:
                continue
            stamp = step * node.flight.plant_period
            announce(self.leader, self.model, step)
            if step > 0:
                publisher, pack = self.flight.actuation_out
                publisher.publish(pack(actuation, step - 1, step, stamp - node.flight.plant_period))
            for (publisher, pack), value in ((self._truth_out, truth), (self._disturbance_out, disturbance)):
                publisher.publish(pack(value, step, step + 1, stamp))

    def _fail(self, reason: str) -> None:
        """End the flight as it is: without its plant PX4 cannot land."""
        self.flight.fail(f"step {self.node.current_step}: {reason}")

    def shut_down(self) -> None:
        """Close the connection."""
        self._server.close()


def main() -> None:
    """Run the plant under PX4 that our laws fly."""
    sys.exit(run(JOINED, JoinedPlant, SUMMARY))
