"""`ros2 run quad_px4 px4_bridge`: takes the simulator's place with a vehicle that PX4 flies, over uXRCE-DDS.

PX4's odometry becomes ``state``; ``wrench_setpoint`` (mode attitude and rates: ``attitude_setpoint``) becomes PX4's
setpoint. ``actuation`` is a prediction of the bridge's own mixer model: PX4 reports none over DDS.
"""

import math
import sys
import time
from collections import deque
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.qos import QoSProfile, ReliabilityPolicy

from quad_core.cascade import POSITION, PX4, SIGNALS, STAGE, STAGES
from quad_core.guard import ASK_DESCEND
from quad_core.guard_checks import StateSample, WrenchCommand
from quad_core.parameters import ParameterError
from quad_core.types import AttitudeThrust, VehicleState, Wrench
from quad_msgs.msg import FlightEvent, FlightState
from quad_node.codec import MALFORMED, packer, unpacker
from quad_node.main import run
from quad_node.topics import message_type
from quad_node.vehicle_node import VehicleNode
from quad_px4 import arming, messages, odometry, spacing
from quad_px4.arming import Phase, Setpoint
from quad_px4.autopilot import COMMANDS, NAV_LAND, OFFBOARD, Ack, Autopilot, Request
from quad_px4.setpoints import Setpoints, Stamps

BEAT = 0.02
"""Seconds between two heartbeats; PX4 leaves offboard 1.0 s after the last."""
_SPACINGS = 200
_RESET_ANGLE = math.radians(10.0)
_LAST_WORDS = 3


class Px4Bridge(VehicleNode):
    """Arms PX4, flies it with the controllers' commands, lands it."""

    def __init__(self) -> None:
        """Look for px4_msgs and set up the mapping; raises as FlightNode, ParameterError for what cannot fly."""
        super().__init__(PX4)
        self.settings = self.resolved.node
        if self.lockstep:
            raise ParameterError("flight.mode: found lockstep, expected realtime: nobody can halt an autopilot's clock")
        if self.commanded:
            raise ParameterError("flight.roles: found commander, expected none: PX4 itself arms and lands")
        self.px4 = messages.load()
        self.setpoints = Setpoints(self.px4, self.settings, self.vehicle)
        self.sequence = arming.Memory()
        self.autopilot: Autopilot | None = None
        self.state: VehicleState | None = None
        self._reasons, self._stop, self._ended = "", "", False
        self._ack: Ack | None = None
        self._odometry: odometry.Sample | None = None
        self._heard, self._commanded = -math.inf, -math.inf
        self._origin = -1
        self._guarded_step, self._flown = -1, Wrench()
        self._is_command_new = self._is_state_new = False
        self._spacings: deque[int] = deque(maxlen=_SPACINGS)
        self._listen()
        self._state_out, self._actuation_out = self._output("state"), self._output("actuation")
        self.create_timer(BEAT, self._on_beat, clock=Clock(clock_type=ClockType.STEADY_TIME))
        self.event(FlightEvent.INFO, "px4_msgs", f"release {messages.release(self.px4)}", always=True)

    def _output(self, topic: str) -> tuple[Any, Any]:
        kind = SIGNALS[topic].kind
        return self.publisher(topic), packer(kind, message_type(kind))

    def _listen(self) -> None:
        quality = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
        space = self.settings.namespace

        def out(name: str) -> Any:
            kind = getattr(self.px4, name)
            return self.create_publisher(kind, messages.topic(space, "in", kind), quality)

        self._heartbeat_out, self._command_out = out("OffboardControlMode"), out("VehicleCommand")
        self._setpoints_out = [out(name) for name in messages.SETPOINTS[self.setpoints.mode]]
        for name, callback in (
            ("VehicleOdometry", self._on_odometry),
            ("VehicleStatus", self._on_status),
            ("VehicleCommandAck", self._on_ack),
            ("FailsafeFlags", self._on_flags),
        ):
            kind = getattr(self.px4, name)
            self.create_subscription(kind, messages.topic(space, "out", kind), callback, quality)
        if self.setpoints.by_attitude:
            self._read_setpoint = unpacker(AttitudeThrust, message_type(AttitudeThrust))
            self.subscribe(STAGE[POSITION].gives, self._on_setpoint, raw=True)

    def _on_status(self, message: Any) -> None:
        self.autopilot = messages.autopilot(message, self._reasons)

    def _on_flags(self, message: Any) -> None:
        self._reasons = messages.reasons(message)

    def _on_ack(self, message: Any) -> None:
        self._ack = messages.ack(message)

    def _on_odometry(self, message: Any) -> None:
        if self.phase in (FlightState.ENDED, FlightState.FAILED):
            return
        sample, last = messages.sample(message), self._odometry
        refused = odometry.refusal(sample, last.timestamp_sample if last else -1)
        if refused:
            self.counters["rejected"] += 1
            self.event(
                FlightEvent.WARNING, "rejected_odometry", f"vehicle_odometry: {refused}; dropped", self.elapsed_ns
            )
            return
        state = odometry.state(sample)
        if last is not None and self.state is not None:
            elapsed = sample.timestamp_sample - last.timestamp_sample
            self._spacings.append(1000 * elapsed)
            if sample.reset_counter != last.reset_counter:
                self._on_reset(odometry.jump(self.state, state, 1e-6 * elapsed))
        self._odometry, self.state, self._heard = sample, state, time.monotonic()
        # until PX4 has taken over to land, the controllers go on
        obeyed = self.autopilot is not None and self.autopilot.nav_state == OFFBOARD
        if self.phase == FlightState.FLYING and obeyed and self.sequence.phase in (Phase.FLY, Phase.LAND):
            self._publish_step(sample, state)

    def _on_reset(self, jump: odometry.Jump) -> None:
        text = f"the estimate jumped by {jump.distance:.2f} m and {math.degrees(jump.angle):.1f} deg"
        self.event(FlightEvent.WARNING, "estimator_reset", text, self.elapsed_ns, always=True)
        if self.sequence.phase == Phase.FLY and (
            jump.distance > self.settings.reset_limit or jump.angle > _RESET_ANGLE
        ):
            self._stop = self._stop or f"vehicle_odometry: {text}"

    def _publish_step(self, sample: odometry.Sample, state: VehicleState) -> None:
        """Publish what was made of the last command, and the state; stamps stand on the plant period's grid."""
        first, period = self._origin < 0, self.flight.plant_period
        if first:
            self._origin = sample.timestamp_sample
        step = round(1000 * (sample.timestamp_sample - self._origin) / period)
        if not first and step <= self.current_step:
            self.counters["crowded_states"] += 1
            return
        if not first:
            publisher, pack = self._actuation_out
            publisher.publish(pack(self.setpoints.predicted, self.current_step, self.current_step + 1, self.elapsed_ns))
        self.current_step, self._is_state_new = step, True
        self._ended = bool(self.end_step) and step >= self.end_step
        self.asked_at = time.monotonic()
        publisher, pack = self._state_out
        publisher.publish(pack(state, step, step + 1, self.elapsed_ns))

    def begin(self) -> None:
        """Go: the next odometry is step 0."""
        text = "actuation is a prediction of the bridge's mixer model; rotor speeds are unknown"
        self.event(FlightEvent.INFO, "actuation_predicted", text, always=True)

    def prepare(self) -> list[str]:
        """Return what PX4 still has to do before step 0."""
        phase = self.sequence.phase
        return [] if phase == Phase.FLY else [f"PX4 ({phase.name.lower()})"]

    def waits_for(self) -> list[str]:
        """Return what must come before the flight begins, PX4's part included."""
        return super().waits_for() or self.prepare()

    def progress(self) -> None:
        """Pass on a wrench that has just come."""
        if self.command is not None and self.command.arrived > self._commanded and not self.setpoints.by_attitude:
            self._commanded, self._is_command_new = self.command.arrived, True
            if self.sequence.phase == Phase.FLY:
                self._step_guard()
                wrench = self._flown if self.guard.taken_over else self.command.wrench
                sampled = self._origin + self.command.step * self.flight.plant_period // 1000
                self._send(self.setpoints.of_wrench(wrench, self._stamps()._replace(sampled=sampled)))

    def _step_guard(self) -> None:
        """Bring the guard up to now, on the grid of PX4's own time; it rests until the first command is there."""
        if self.command is None or self.state is None or self._origin < 0 or self.setpoints.by_attitude:
            return
        period = self.flight.plant_period
        now = self.current_step + int(1e9 * (time.monotonic() - self._heard)) // period
        for step in range(self._guarded_step + 1 if self._guarded_step >= 0 else now, now + 1):
            newest, (answered, wrench, _), of = step == now, self.command, self.current_step
            command = WrenchCommand(wrench, answered, answered * period, newest and self._is_command_new, True)
            sample = StateSample(self.state, of, of * period, newest and self._is_state_new, True)
            self._flown = self.guarded(command, sample, step)
            self._guarded_step = step
            if newest:
                self._is_command_new = self._is_state_new = False

    def on_given_up(self) -> None:
        """Have PX4 land."""
        self._stop = self._stop or self.cause

    def _on_setpoint(self, payload: bytes) -> None:
        try:
            stamped = self._read_setpoint(payload)
        except MALFORMED as error:
            self._reject("rejected_malformed", f"a malformed attitude_setpoint ({error})", 0)
            return
        if not stamped.finite:
            self._reject("rejected_nonfinite", "a non-finite number in attitude_setpoint", stamped.stamp_ns)
            return
        self._commanded = time.monotonic()
        if self.sequence.phase == Phase.FLY and self.state is not None:
            self._send(self.setpoints.of_attitude(stamped.value, self.state.q_wb, self._stamps()))

    def _on_beat(self) -> None:
        """Ask, answer and keep PX4 in offboard, 50 times a second, once all nodes are ready."""
        if self.phase in (FlightState.ENDED, FlightState.FAILED) or self.handshake.missing():
            return
        now = time.monotonic()
        self._step_guard()
        if self.guard.taken_over:
            self._stop = self._stop or self.failure
        periods = {stage.role: self.handshake.period(stage.role) for stage in STAGES if stage.role in self.roles}
        output, self.sequence = arming.step(
            self.settings.arming,
            self.sequence,
            arming.Inputs(
                now,
                1e-6 * self._stamps().now,
                self.autopilot,
                self._ack,
                now - self._commanded,
                now - self._heard,
                self._refusal(periods) if self.sequence.phase == Phase.STREAM else "",
                self._stop,
                self._ended,
            ),
        )
        self._ack = None
        if output.request is not None:
            self._ask(output.request)
        if output.heartbeat:
            self._heartbeat_out.publish(messages.heartbeat(self.px4, self.setpoints.mode, self._stamps().now))
        if output.setpoint == Setpoint.LEVEL:
            self.guard_request = ASK_DESCEND
        if output.setpoint == Setpoint.LEVEL and self.guard.taken_over:
            self._send(self.setpoints.of_wrench(self._flown, self._stamps()))
        elif output.setpoint in (Setpoint.IDLE, Setpoint.LEVEL) and self.state is not None:
            thrust = self.vehicle.mass * self.vehicle.gravity if output.setpoint == Setpoint.LEVEL else 0.0
            self._send(self.setpoints.safe(thrust, self.state, self._stamps()))
        if output.phase in (Phase.LANDED, Phase.RELEASED):
            if report := self.setpoints.hover_report():
                self.event(FlightEvent.INFO, "hover_thrust", report, self.elapsed_ns, always=True)
            super().end(FlightState.FAILED if output.failed else FlightState.ENDED, output.reason)

    def _refusal(self, periods: dict[str, int]) -> str:
        """Return why the flight must not begin."""
        return self.setpoints.weakness() or spacing.misfit(self.flight.plant_period, periods, self._spacings)

    def _ask(self, request: Request) -> None:
        text = f"{COMMANDS[request.command]}, attempt {request.attempt + 1}"
        self.event(FlightEvent.INFO, "px4_command", text, self.elapsed_ns, always=True)
        message = messages.command(self.px4, request, self.settings.target_system, self._stamps().now)
        self._command_out.publish(message)

    def _stamps(self) -> Stamps:
        last = self._odometry
        return Stamps(last.timestamp, last.timestamp_sample) if last else Stamps()

    def _send(self, found: tuple[Any, ...]) -> None:
        for publisher, message in zip(self._setpoints_out, found, strict=True):
            publisher.publish(message)
        if self.state is not None and self.sequence.phase == Phase.FLY:
            self.setpoints.note(self.state)

    def end(self, phase: int, reason: str) -> None:
        """End the flight; a vehicle in the air is landed first."""
        if self.sequence.phase in (Phase.SPOOL_UP, Phase.FLY, Phase.LAND):
            self._stop = self._stop or reason
        else:
            super().end(phase, reason)

    def on_interrupt(self, name: str) -> None:
        """Have PX4 land; the bridge cannot stay to see it."""
        flown = self.sequence.phase in (Phase.SPOOL_UP, Phase.FLY, Phase.LAND)
        for attempt in range(_LAST_WORDS if flown else 0):
            self._ask(Request(NAV_LAND, attempt=attempt))
            time.sleep(BEAT)
        self.sequence = self.sequence._replace(phase=Phase.RELEASED)
        super().end(FlightState.FAILED, f"{self.role} stopped by {name}{'; PX4 was asked to land' if flown else ''}")
        self.exit_code = 1

    def measurements(self) -> dict[str, float]:
        """Return diagnostics: the base's, where PX4 stands, and how old its states are when they are sent."""
        found = {**super().measurements(), "actuation_predicted": 1, "px4_phase": int(self.sequence.phase)}
        if self._odometry is not None:
            found["state_age_ms"] = 1e-3 * (self._odometry.timestamp - self._odometry.timestamp_sample)
        return found


def main() -> None:
    """Run the bridge to PX4."""
    sys.exit(run(PX4, Px4Bridge, "Bridge to PX4: takes wrench_setpoint or attitude_setpoint, publishes state."))
