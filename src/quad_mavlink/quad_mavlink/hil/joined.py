"""`ros2 run quad_mavlink joined_plant`: our plant under PX4 firmware, which our own laws fly by torque.

One process owns both: PX4's clock, through its simulator interface (sensors out, motor outputs back), and the bridge to
PX4 over DDS. So the plant can wait for whoever is late, and a flight does not depend on how busy the machine is.
"""

import math
import sys
import time
from collections import deque
from typing import NamedTuple

from rclpy.clock import Clock, ClockType

from quad_autopilot import odometry
from quad_autopilot.arming import Phase
from quad_autopilot.autopilot import listed
from quad_autopilot.node import BEAT
from quad_core.cascade import COMMAND, COMMANDER, STAGES, TRAJECTORY
from quad_core.types import Actuation, Disturbance, VehicleState
from quad_dynamics.plant_output import Announcer
from quad_mavlink.hil import motors
from quad_mavlink.hil.exchange import RefusedError
from quad_mavlink.hil.gate import Decision, Gate, foreign_stamp
from quad_mavlink.hil.sleepers import Watch
from quad_mavlink.hil.vehicle import BEFORE_STEP_0, HilVehicle
from quad_mavlink.interface import JOINED
from quad_msgs.msg import FlightEvent, FlightState
from quad_node.codec import head_of
from quad_node.main import run
from quad_px4.node import Px4Bridge
from quad_px4.parameters import AirframeParameters

_TICK, _SLICE = 0.00025, 0.004  # s between two looks at the gate, and of steps without a look at ROS
_LOOK, _LONGEST_LOOK = 0.0001, 0.002  # s between two looks at who sleeps: rarer the longer it takes, for looking costs
_TURNS = 2  # a tick may have been due before a state came, the next one was not
_BACKLOG = 64
_OVER = (FlightState.ENDED, FlightState.FAILED)
SUMMARY = """Our plant under PX4 firmware, flown by our laws: torque over DDS, sensors and motors over TCP.

Usually started by scripts/fly --realtime --vehicle-owner joined=FILE; then start PX4: it connects by itself.
Exit codes: 0 flown to the end and landed, 1 failed, 2 bad set-up."""


class Moved(NamedTuple):
    """What the plant did up to the time ``at`` (us), and what acts from then on."""

    at: int
    truth: VehicleState
    disturbance: Disturbance
    actuation: Actuation


class JoinedPlant(Px4Bridge):
    """The bridge to PX4, by the clock of the plant that it integrates."""

    is_predicting = False

    def __init__(self) -> None:
        """Make bridge, plant and sensors and open the port; raises as FlightNode, ParameterError if it cannot fly."""
        super().__init__(JOINED)
        self.hil = HilVehicle(self)
        self.setpoint_watch.rest()  # the gate waits for them
        self._period_us, self.gate = self.flight.plant_period // 1000, Gate(self.settings.gate)
        self._truth_out, self._disturbance_out = self.output("truth"), self.output("disturbance")
        self._announcer = Announcer(self, self.hil.model)
        self._moved: deque[Moved] = deque(maxlen=_BACKLOG)
        self._is_asked = self._are_outputs_due = False
        self._looks, self._still_at, self._pause = 0, math.inf, _LOOK
        self._watch: Watch | None = None
        self._seeks, self._outputs = self.settings.gate.watch, motors.AT_REST
        self._idle_from, self._asked_at, self._next_beat = time.monotonic(), 0.0, 0.0
        self._booting, self._steps = "", 0
        answers = {
            COMMANDER if self.commanded else TRAJECTORY: "reference",
            **{stage.role: stage.gives for stage in STAGES},
        }
        self._answers = {role: topic for role, topic in answers.items() if role in self.roles}
        for topic in set(self._answers.values()) - {COMMAND}:
            self.subscribe(topic, lambda payload, topic=topic: self._on_answer(topic, *head_of(payload)), raw=True)
        self.create_timer(_TICK, self._tick, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def airframe(self) -> AirframeParameters:
        """Return the simulated vehicle itself, as PX4 must have it."""
        found = motors.airframe(self.vehicle, self.settings.thrust_curve)
        return found._replace(thr_mdl_fac=self.settings.thrust_curve)

    def clock(self) -> float:
        """Return the plant's time in s, which is PX4's."""
        return 1e-6 * self.hil.time_usec

    def start_beats(self) -> None:
        """Leave the beats to the plant's clock."""

    def prepare(self) -> list[str]:
        """Return what PX4 still has to do before step 0."""
        if self._booting or self._steps == 0:
            return [self._booting or "the plant"]
        if self.autopilot is None:
            return ["vehicle_status from PX4: is its uXRCE-DDS agent running?"]
        if self.state is None:
            return ["vehicle_odometry from PX4 that can be accepted"]
        if self.sequence.phase == Phase.STREAM and not self.autopilot.checks_pass:
            return [f"PX4's pre-flight checks ({listed(self.autopilot.reasons) or 'no reason given'})"]
        return super().prepare()

    def refusal(self) -> str:
        """Return why the vehicle must not fly: as the bridge, or because PX4's stamps are of another clock."""
        now = self.hil.time_usec
        if self.sample is not None and not Gate.is_of_our_clock(self.sample.timestamp_sample, now):
            return foreign_stamp(self.sample.timestamp_sample, now)
        return super().refusal()

    def begin(self) -> None:
        """Go: the next estimate is step 0, and from then on every answer is awaited."""
        super().begin()
        periods = {topic: self.handshake.period(role) for role, topic in self._answers.items()}
        self.gate.expect(periods)

    def on_sample(self, sample: odometry.Sample) -> None:
        """Take an estimate, and learn when the next one is due."""
        before = self.sample
        super().on_sample(sample)
        if self.sample is not before:
            self.gate.on_state(sample.timestamp_sample, self.hil.time_usec)
            if self._seeks:
                self._seeks, self._watch = False, self.hil.watch()

    def on_state_published(self) -> None:
        """Await the answers to the state, and publish what was true by then."""
        super().on_state_published()
        self.gate.on_published(self.current_step)
        self._publish_moved()

    def progress(self) -> None:
        """Pass on a wrench that has just come, and go on if that was what the plant waited for."""
        before = self.passed_on
        super().progress()
        if self.passed_on is not before and self.may_fly():
            self._are_outputs_due, self._idle_from = True, time.monotonic()
        if self.command is not None:
            self._on_answer(COMMAND, self.command.step, self.run)

    def _on_answer(self, topic: str, step: int, run: int) -> None:
        if not self.is_foreign(topic, run):
            self.gate.on_answer(topic, step)
            self._drive()

    def _tick(self) -> None:
        self._looks += 1
        self._drive()

    def _drive(self) -> None:
        """Go on as far as the gate permits, then let the other callbacks have their turn."""
        until = time.monotonic() + _SLICE
        try:
            while self.phase not in _OVER and time.monotonic() < until and self._advance(until):
                pass
        except RefusedError as error:
            self._fail(str(error))

    def _advance(self, until: float) -> bool:
        """Return whether the plant made a step."""
        if self._steps == 0:
            self._booting = self.hil.boot(until)
            if not self._booting:
                self._is_asked = True
        if not self._is_asked:
            if self._steps == 0 or not self._may_go_on():
                return self._is_gone()
            self.hil.ask()
            self._is_asked, self._still_at, self._asked_at = True, math.inf, time.monotonic()
        answer = self._outputs_by(until)
        if answer is not None:
            self._outputs = answer
            self._integrate(answer)
        elif time.monotonic() - self._asked_at > self.settings.gate.answer_timeout:
            self._fail(f"PX4 does not answer: no HIL_ACTUATOR_CONTROLS for {self.settings.gate.answer_timeout:g} s")
        return answer is not None or self._is_gone()

    def _outputs_by(self, until: float) -> motors.Answer | None:
        """Return PX4's outputs for the reading: once offboard is asked for, the last ones if no new ones come.

        Its motors then follow setpoints, not the gyro, and a reading alone makes no new outputs.
        """
        if self.sequence.phase == Phase.STREAM:
            return self.hil.listen(max(until - time.monotonic(), 0.0))
        is_over = self._have_settled(self._asked_at, self.settings.gate.settle)
        found = self.hil.newest(0.0 if is_over else self._pause)
        self._pause = _LOOK if is_over else min(2.0 * self._pause, _LONGEST_LOOK)
        self._outputs = found or self._outputs
        is_over = is_over or (found is not None and self._watch is None)
        return self._outputs if is_over and not self.hil.is_left else None

    def _have_settled(self, since: float, patience: float) -> bool:
        """Return whether what was sent at ``since`` has been dealt with: all sleep, or ``patience`` s have passed."""
        waited = time.monotonic() - since
        if self._watch is None:
            return waited >= patience
        is_over = self._watch.is_quiet()
        if not is_over and waited >= self.settings.gate.overdue:
            is_over, self._watch = True, None  # who never sleeps would cost that wait at every step
            text = (
                f"running for {self.settings.gate.overdue:g} s: the plant waits gate.settle and gate.linger from now on"
            )
            self.event(FlightEvent.WARNING, "not_watched", text, self.elapsed_ns)
        self._still_at = self._looks if is_over else math.inf
        return is_over

    def _is_still(self) -> bool | None:
        """Return whether no state is on its way any more; None where threads cannot be watched."""
        if self._watch is None:
            return None
        if self._still_at == math.inf:
            self._have_settled(time.monotonic(), 0.0)
        return self._looks >= self._still_at + _TURNS  # what came before they slept has had its turn since

    def _is_gone(self) -> bool:
        """Fail if PX4 has left; false in any case: nothing more can be done now."""
        if self.hil.is_left:
            self._fail("PX4 closed the connection to its simulator")
        return False

    def _may_go_on(self) -> bool:
        if self._are_outputs_due:  # the wrench is out; its outputs say that it has arrived
            is_over = self._have_settled(self._idle_from, self.settings.gate.linger)
            found = self.hil.newest(0.0)
            self._outputs = found or self._outputs
            self._are_outputs_due = not is_over and (found is None or self._watch is not None)
            if self._are_outputs_due:
                return False
        aloft = self.phase == FlightState.FLYING and self.sequence.phase == Phase.FLY
        is_flying = aloft and self.is_obeyed() and not (self.stop or self.guard.taken_over)
        idle = time.monotonic() - self._idle_from
        decision = self.gate.decide(self.hil.time_usec + self._period_us, idle, is_flying, self._is_still)
        if decision == Decision.UNANSWERED:
            waited = f"no {self.gate.missing} for {self.settings.gate.answer_timeout:g} s, for which the plant waited"
            self.stop = f"controllers: step {self.current_step}: {waited}"
            self.on_beat()
        if decision == Decision.OVERDUE:
            text = f"no vehicle_odometry for {self.settings.gate.overdue:g} s by the wall clock, though one was due"
            self.event(FlightEvent.WARNING, "state_overdue", text, self.elapsed_ns)
        return decision != Decision.WAIT

    def _integrate(self, answer: motors.Answer) -> None:
        """Go on by one step, and beat if it is time to."""
        step, model = self._step_at(self.hil.time_usec), self.hil.model
        truth = self.hil.integrate(max(step, BEFORE_STEP_0), answer)
        self._is_asked, self._idle_from = False, time.monotonic()
        self._steps += 1
        if diverged := self.hil.divergence(truth, step):
            self._fail(diverged)
            return
        at = self.hil.time_usec + self._period_us
        self._moved.append(Moved(at, truth, model.disturbance(), model.actuation))
        self._publish_moved()
        if self.clock() >= self._next_beat:
            self._next_beat = self.clock() + BEAT - 1e-6
            # nothing is asked of a PX4 that would not arm yet
            if self.sequence.phase != Phase.STREAM or (self.autopilot is not None and self.autopilot.checks_pass):
                self.on_beat()

    def _step_at(self, time_usec: int) -> int:
        """Return the step of the flight at a time of PX4, negative before step 0."""
        return (time_usec - self.origin) // self._period_us if self.origin >= 0 else BEFORE_STEP_0

    def _publish_moved(self) -> None:
        """Publish truth, disturbance and actuation of the flight's steps, those before its origin was known too."""
        if self.origin < 0 or self.phase != FlightState.FLYING or not (self.commanded or self.is_obeyed()):
            return
        while self._moved:
            at, truth, disturbance, actuation = self._moved.popleft()
            step = self._step_at(at)
            if step < 0:
                continue
            stamp = step * self.flight.plant_period
            self._announcer.announce(step, stamp)
            if step > 0:
                publisher, pack = self.actuation_out
                publisher.publish(pack(actuation, step - 1, step, stamp - self.flight.plant_period))
            for (publisher, pack), value in ((self._truth_out, truth), (self._disturbance_out, disturbance)):
                publisher.publish(pack(value, step, step + 1, stamp))

    def _fail(self, reason: str) -> None:
        """End the flight as it is: without its plant PX4 cannot land."""
        self.sequence = self.sequence._replace(phase=Phase.RELEASED)
        self.end(FlightState.FAILED, f"step {self.current_step}: {reason}")

    def measurements(self) -> dict[str, float]:
        """Return diagnostics: the bridge's, the exchange's, plant steps."""
        found = {**super().measurements(), **self.hil.measurements()}
        return {**found, "plant_steps": self._steps}

    def close(self) -> None:
        """Close the connection."""
        self.hil.close()
        if self._watch is not None:
            self._watch.close()


def main() -> None:
    """Run the plant under PX4 that our laws fly."""
    sys.exit(run(JOINED, JoinedPlant, SUMMARY))
