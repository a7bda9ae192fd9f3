"""`ros2 run quad_px4 px4_bridge`: takes the simulator's place with a vehicle that PX4 flies, over uXRCE-DDS.

PX4's odometry becomes ``state``; ``wrench_setpoint`` (mode attitude: ``attitude_setpoint``) becomes PX4's
setpoint. ``actuation`` is a prediction of the bridge's own mixer model: PX4 reports none over DDS.
"""

import math
import sys
from collections.abc import Callable
from functools import partial
from typing import Any

from rclpy.qos import QoSProfile, ReliabilityPolicy

from quad_autopilot import thrust
from quad_autopilot.arming import Phase, Setpoint
from quad_autopilot.autopilot import Request, Stamps
from quad_autopilot.node import AutopilotInterface, AutopilotNode
from quad_core.enumerations import GuardReason
from quad_core.parameters import ParameterError
from quad_core.types import AttitudeThrust, Vec3, VehicleState, Wrench
from quad_guard.checks import StateSample, WrenchCommand
from quad_msgs.msg import FlightEvent
from quad_node.codec import Stamped
from quad_node.main import run
from quad_px4 import mapping, messages
from quad_px4.autopilot import LOSS_ADVICE, MODE_LOSS, PROFILE, Flags, autopilot, mode_name
from quad_px4.external_mode import ExternalMode
from quad_px4.parameters import PX4, AirframeParameters, ChosenBy, Mode


class Px4Interface(AutopilotInterface):
    """PX4 over uXRCE-DDS; it leaves offboard COM_OF_LOSS_T after the last heartbeat."""

    profile = PROFILE

    def __init__(self, node: AutopilotNode, airframe: AirframeParameters | None = None) -> None:
        """Look for px4_msgs and set up the mapping; raises ParameterError for what cannot fly.

        ``airframe``: the vehicle as PX4 has it, that of the parameters unless it is given.
        """
        super().__init__(node)
        self.px4 = messages.load()
        airframe = airframe or self.settings.airframe
        self._mode, self.mapping = Mode(getattr(self.settings, "mode", Mode.WRENCH)), mapping.build(airframe)
        self.by_attitude = self._mode == Mode.ATTITUDE
        self.predicted = mapping.predict(self.mapping, Wrench())
        self._status: Any = None
        self._control_mode: Any = None
        self._flags, self._landed, self._battery = Flags(), False, math.nan
        self._guarded_step, self._flown, self._refused = -1, Wrench(), ""
        self._external = self._registered()
        self.passed_on: Stamped | None = None
        self._is_command_new = self._is_state_new = False
        self._listen()
        if not self.by_attitude and self._external is None:
            self.profile = PROFILE._replace(loss_limit=self.settings.loss_limit, loss_advice=LOSS_ADVICE)

    def on_ready(self) -> None:
        """Publish what a reader of the bag needs to know of PX4."""
        super().on_ready()
        self.node.event(FlightEvent.INFO, "px4_msgs", f"release {messages.release(self.px4)}", always=True)
        if not self.by_attitude:
            text = "PX4 stabilises nothing in this mode: while the stream of setpoints is lost the last torque holds"
            self.node.event(FlightEvent.WARNING, "px4_parameters", f"{text}; {LOSS_ADVICE}", always=True)

    def _registered(self) -> ExternalMode | None:
        """Return the registration of parameter external_mode, None without; raises ParameterError."""
        name, limit = getattr(self.settings, "external_mode", ""), self.settings.loss_limit
        if not name:
            return None
        if not self.by_attitude and 0.0 < limit < MODE_LOSS:
            raise ParameterError(
                f"external_mode: found {name!r} in mode wrench or motors, loss_limit {limit:g} s; expected "
                f"loss_limit 0 or at least {MODE_LOSS:g}: PX4 holds the last torque until it misses the mode"
            )
        return ExternalMode(self.node.ros, self.px4, self.settings.namespace, name, self._mode, self._arming_refusal)

    def _arming_refusal(self) -> str:
        """Return why our mode cannot be armed now; PX4 shows texts of its firmware alone, so an event tells ours."""
        before, self._refused = self._refused, self.node.arming_refusal()
        if self._refused and self._refused != before:
            self.node.event(FlightEvent.INFO, "arming_check", self._refused, self.node.elapsed_ns)
        return self._refused

    @property
    def _chosen_by(self) -> ChosenBy:
        return ChosenBy(self.settings.chosen_by)

    @property
    def _ours(self) -> int:
        """Number of our external mode in PX4, -1 while it has none."""
        return self._external.nav_state if self._external is not None else -1

    def missing(self) -> list[str]:
        """Return what PX4 has to answer before it is asked for anything: the registration of our mode."""
        if self._external is None or not self._external.is_open:
            return []
        heard = f"PX4's answer to the registration of mode {self.settings.external_mode}"
        return [heard if self._status is not None else "vehicle_status from PX4: is its uXRCE-DDS agent running?"]

    def _register(self) -> None:
        """Ask for our external mode; once it is known whether there is one, say so."""
        external = self._external
        if external is None or self.profile is not PROFILE:
            return
        if self._status is not None:  # before PX4 is heard nobody can answer
            external.ask(self.node.stamps().now)
        if external.failure:
            self._external = None
            text, is_pilots = f"{self.settings.external_mode}: {external.failure}", self._chosen_by == ChosenBy.PILOT
            if is_pilots:  # in offboard nobody would choose when it takes off
                self.node.stop = f"arming refused: external_mode {text}, and chosen_by pilot needs it"
            else:
                text += "; flown in offboard instead"
            self.node.event(FlightEvent.WARNING, "external_mode", text, always=True)
        elif not external.is_open:
            self.profile = external.profile(PROFILE, self._chosen_by)
            text = f"{self.settings.external_mode} is {mode_name(external.nav_state)} of PX4"
            self.node.event(FlightEvent.INFO, "external_mode", text, always=True)

    def _listen(self) -> None:
        quality = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
        space, target = self.settings.namespace, self.settings.target_system

        def out(name: str) -> Any:
            kind = getattr(self.px4, name)
            return self.node.ros.create_publisher(kind, messages.topic(space, "in", kind), quality)

        self._heartbeat_out, self._command_out = out("OffboardControlMode"), out("VehicleCommand")
        self._setpoints_out = [out(name) for name in messages.SETPOINTS[self._mode]]
        for name, attribute, read in (
            ("VehicleStatus", "_status", lambda message: message),
            ("VehicleControlMode", "_control_mode", lambda message: message),
            ("FailsafeFlags", "_flags", lambda message: messages.flags(message, self._flags)),
            ("VehicleLandDetected", "_landed", lambda message: bool(message.landed)),
            ("BatteryStatus", "_battery", messages.share),
            ("VehicleCommandAck", "ack", lambda message: messages.ack(message, target) or self.ack),
            ("VehicleOdometry", "", messages.sample),
        ):
            kind, take = getattr(self.px4, name), partial(self._take, attribute, read)
            self.node.ros.create_subscription(kind, messages.topic(space, "out", kind), take, quality)

    def _take(self, attribute: str, read: Callable[[Any], Any], message: Any) -> None:
        """Keep what PX4 says as ``attribute``; an estimate goes on at once."""
        self.spoke_at, found = self.clock(), read(message)
        if not attribute:
            self.node.on_sample(found)
            return
        setattr(self, attribute, found)
        if self._status is not None:
            vehicle = self._landed, self._battery
            self.autopilot = autopilot(self._status, self._control_mode, self._flags, *vehicle, self._ours)

    def on_shift(self) -> None:
        """Have the guard begin anew with the next state, unless it flies: it would refuse what lies a metre away."""
        if not self.node.guard.taken_over:
            self.node.guard.rest(self.node.current_step)
            self._guarded_step = -1

    def on_published(self) -> None:
        """Have the guard take the state as new."""
        self._is_state_new = True

    def on_wrench(self) -> None:
        """Pass on a wrench that has just come."""
        node, command = self.node, self.node.command
        if command is not None and command is not self.passed_on and not self.by_attitude:
            self.passed_on, self._is_command_new = command, True
            node.on_command()
            if node.may_fly():
                self._step_guard()
                wrench = self._flown if node.guard.taken_over else command.value
                sampled = node.origin + command.step * node.flight.plant_period // 1000
                self._send_wrench(wrench, node.stamps()._replace(sampled=sampled))

    def _step_guard(self) -> None:
        """Bring the guard up to now, in PX4's own time; it rests before the first command and as PX4 lands."""
        node = self.node
        given, state = node.command, node.state
        if node.sequence.phase in (Phase.CLIMB, Phase.RETURN):  # the autopilot flies: nothing grows old meanwhile
            node.guard.rest(node.current_step)
            self._guarded_step = -1
            return
        if given is None or state is None or node.origin < 0 or not node.is_obeyed():
            return
        period = node.flight.plant_period
        now = node.current_step + int(1e9 * (self.clock() - node.heard)) // period
        for step in range(self._guarded_step + 1 if self._guarded_step >= 0 else now, now + 1):
            newest, of = step == now, node.current_step
            command = WrenchCommand(given.value, given.step, newest and self._is_command_new)
            sample = StateSample(state, of, newest and self._is_state_new)
            self._flown = node.guarded(command, sample, step)
            self._guarded_step = step
            if newest:
                self._is_command_new = self._is_state_new = False

    def take(self) -> None:
        """Step the guard; what it took over ends the flight."""
        self._register()
        if not self.by_attitude:
            self._step_guard()
        if self.node.guard.taken_over and self.node.guard.memory.reason != GuardReason.REQUESTED:
            self.node.stop = self.node.stop or self.node.failure

    def refusal(self) -> str:
        """Return why the vehicle must not fly: rotors that cannot lift it, or no message that tells of a pilot."""
        if self._control_mode is None:
            return "no vehicle_control_mode from PX4: is it among the topics of its uXRCE-DDS client?"
        return thrust.weakness(self.node.vehicle, self.mapping.airframe.max_rotor_thrust, "airframe.max_rotor_thrust")

    def send_heartbeat(self) -> None:
        """Have PX4 stay in offboard."""
        if self._ours < 0:  # an external mode is kept by the answers to its arming checks
            self._heartbeat_out.publish(messages.heartbeat(self.px4, self._mode, self.node.stamps().now))

    def send_request(self, request: Request) -> None:
        """Send a VehicleCommand."""
        message = messages.command(self.px4, request, self.settings.target_system, self.node.stamps().now)
        self._command_out.publish(message)

    def send_attitude(self, setpoint: AttitudeThrust, _state: VehicleState) -> None:
        """Send an attitude and a thrust in N."""
        self.predicted = mapping.predict(self.mapping, Wrench(setpoint.thrust, Vec3()))
        thrust_body = mapping.collective(self.mapping, setpoint.thrust)
        self._send(messages.attitude(self.px4, setpoint.q_wb, thrust_body, self.node.stamps().now))

    def _send_wrench(self, wrench: Wrench, stamps: Stamps) -> None:
        self.predicted = mapping.predict(self.mapping, wrench)
        if self._mode == Mode.MOTORS:
            self._send(messages.motors(self.px4, mapping.motors(self.mapping, wrench), *stamps))
        else:
            self._send(*messages.thrust_torque(self.px4, mapping.thrust_torque(self.mapping, wrench), *stamps))

    def send_safe(self, output: Setpoint, newtons: float, state: VehicleState) -> None:
        """Send level attitude, or no torque; what the guard flies where it has taken over."""
        if self.by_attitude:
            super().send_safe(output, newtons, state)
        else:
            is_guarded = output == Setpoint.LEVEL and self.node.guard.taken_over
            self._send_wrench(self._flown if is_guarded else Wrench(newtons, Vec3()), self.node.stamps())

    def measurements(self) -> dict[str, float]:
        """Return how old PX4's states are when it sends them."""
        stamps = self.node.stamps()
        return {"state_age_ms": 1e-3 * (stamps.now - stamps.sampled)}

    def close(self) -> None:
        """Take our mode out of PX4's list."""
        if self._external is not None:
            self._external.close()

    def _send(self, *found: Any) -> None:
        for publisher, message in zip(self._setpoints_out, found, strict=True):
            publisher.publish(message)


def main() -> None:
    """Run the bridge to PX4."""
    text = "Bridge to PX4: takes wrench_setpoint or attitude_setpoint, publishes state."
    sys.exit(run(PX4, lambda: AutopilotNode(PX4, Px4Interface), text))
