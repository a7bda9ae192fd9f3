"""`ros2 run quad_px4 px4_bridge`: takes the simulator's place with a vehicle that PX4 flies, over uXRCE-DDS.

Subscribes: of PX4 VehicleOdometry, VehicleStatus, VehicleControlMode, FailsafeFlags, VehicleLandDetected,
BatteryStatus, VehicleCommandAck; of the flight wrench_setpoint, in mode attitude attitude_setpoint, and flight/plan,
flight/nodes, flight/recorded, flight/mode.
Publishes: for PX4 OffboardControlMode, VehicleCommand and the setpoints of its mode; for the flight state, actuation,
flight/autopilot, flight/state, flight/guard, flight/request, and what every node does.
An external mode adds registration, configuration and arming checks; ``actuation`` is the bridge's own prediction, for
PX4 reports none over DDS.

A step of the flight begins with an odometry, which becomes ``state``, and ends with the controllers' answer, which goes
to PX4 as it arrives. ``Px4Bridge.step`` runs every 20 ms: ``AutopilotFlight.step`` takes the arming sequence on and
sends its requests, then heartbeat and idle or level setpoint follow. ``AutopilotFlight`` ends the flight by FAILED or
ENDED on flight/state, after a landing by us or by PX4.
"""

import math
import sys
from collections.abc import Callable
from functools import partial
from typing import Any

from rclpy.qos import QoSProfile, ReliabilityPolicy

from quad_autopilot import thrust
from quad_autopilot.arming import Setpoint
from quad_autopilot.autopilot import Profile, Request, Stamps
from quad_autopilot.autopilot_flight import BEAT, AutopilotFlight, Taken
from quad_autopilot.odometry import Sample
from quad_autopilot.parameters import Flier
from quad_core.cascade import POSITION, STAGE
from quad_core.parameters import ParameterError
from quad_core.resolution import Resolved
from quad_core.types import AttitudeThrust, Vec3, Wrench
from quad_node.codec import Stamped
from quad_node.main import run
from quad_px4 import mapping, messages
from quad_px4.external_mode import ExternalMode
from quad_px4.messages import LOSS_ADVICE, MODE_LOSS, PROFILE, Flags, autopilot, mode_name
from quad_px4.parameters import PX4, AirframeParameters, ChosenBy, Mode


class Px4Bridge:
    """PX4 over uXRCE-DDS; it leaves offboard COM_OF_LOSS_T after the last heartbeat."""

    def __init__(
        self,
        kind: str = PX4,
        airframe: Callable[[Resolved], AirframeParameters] = lambda resolved: resolved.node.airframe,
        take_estimate: Callable[[Sample], object] | None = None,
        **flight: Any,
    ) -> None:
        """Look for px4_msgs and set up the mapping; raises ParameterError for what cannot fly.

        ``airframe``: the vehicle as PX4 has it. What has a bridge of its own hands it in ``take_estimate`` and
        ``flight``, arguments of the ``AutopilotFlight``, what it does instead; it calls ``step`` by its own ``clock``.
        """
        given = {"activate": self.activate, "progress": self.take_wrench, "missing": self.missing, **flight}
        given = {"refusal": self.refusal, "shut_down": self.shut_down, **given}
        self.flight = AutopilotFlight(kind, PROFILE, ask=self._request, **given)
        self.node, self.leader, self.settings = self.flight.node, self.flight.leader, self.flight.settings
        self.px4 = messages.load()
        self._mode = Mode(getattr(self.settings, "mode", Mode.WRENCH))
        self.mapping = mapping.build(airframe(self.node.resolved))
        self._by_attitude = self.flight.by_attitude = self._mode == Mode.ATTITUDE
        self.flight.predicted = mapping.predict(self.mapping, Wrench())
        self._status: Any = None
        self._control_mode: Any = None
        self._flags, self._landed, self._battery = Flags(), False, math.nan
        self._refused = ""
        self._external = self._registered()
        self.passed_on: Stamped | None = None
        self._listen(take_estimate or self.take_estimate)
        if self._external is None:
            self.flight.profile = self._offboard()
        self.node.measures.append(self._measured)
        if "clock" not in flight:
            self.node.every(BEAT, self.step)

    def _offboard(self) -> Profile:
        """Return how PX4 is asked for offboard; where it stabilises nothing it must notice a lost stream in time."""
        if self._by_attitude:
            return PROFILE
        return PROFILE._replace(loss_limit=self.settings.loss_limit, loss_advice=LOSS_ADVICE)

    def _registered(self) -> ExternalMode | None:
        """Return the registration of parameter external_mode, None without; raises ParameterError."""
        name = getattr(self.settings, "external_mode", "")
        if not name:
            return None
        if self.settings.chosen_by == ChosenBy.PILOT and self.settings.arming.takeoff == Flier.AUTOPILOT:
            raise ParameterError(
                "arming.takeoff: found autopilot with chosen_by pilot, expected ours: nothing would change PX4 back to "
                f"{name!r} in the air"
            )
        space, refusal = self.settings.namespace, self._arming_refusal
        external = ExternalMode(self.node.ros, self.px4, space, name, self._mode, refusal, self.settings.loss_limit)
        if not self._by_attitude and not (external.watches and self.settings.loss_limit):
            watched = "a loss_limit above 0, " if external.watches else ""
            raise ParameterError(
                f"external_mode: found {name!r} in mode wrench or motors, expected {watched}mode attitude, or none: "
                f"a lost link turns the vehicle over, for this PX4 holds the last torque for {MODE_LOSS:g} s"
            )
        return external

    def _listen(self, take_estimate: Callable[[Sample], object]) -> None:
        quality = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
        space, target, ros = self.settings.namespace, self.settings.target_system, self.node.ros

        def out(name: str) -> Any:
            kind = getattr(self.px4, name)
            return ros.create_publisher(kind, messages.topic(space, "in", kind), quality)

        def hear(name: str, callback: Callable[[Any], object]) -> None:
            kind = getattr(self.px4, name)
            ros.create_subscription(kind, messages.topic(space, "out", kind), callback, quality)

        self._heartbeat_out, self._command_out = out("OffboardControlMode"), out("VehicleCommand")
        self._setpoints_out = [out(name) for name in messages.SETPOINTS[self._mode]]
        for name, attribute, read in (
            ("VehicleStatus", "_status", lambda message: message),
            ("VehicleControlMode", "_control_mode", lambda message: message),
            ("FailsafeFlags", "_flags", lambda message: messages.flags(message, self._flags)),
            ("VehicleLandDetected", "_landed", lambda message: bool(message.landed)),
            ("BatteryStatus", "_battery", messages.share),
        ):
            hear(name, partial(self._note, attribute, read))
        hear("VehicleCommandAck", lambda message: self._note_ack(messages.ack(message, target)))
        hear("VehicleOdometry", lambda message: take_estimate(messages.sample(message)))
        if self._by_attitude:
            self.node.links.subscribe(STAGE[POSITION].output, self._take_setpoint, raw=True)

    def activate(self) -> None:
        """Say what a reader of the bag needs to know of PX4; the flight begins."""
        events = self.node.events
        events.info("px4_msgs", f"release {messages.release(self.px4)}", always=True)
        if not self._by_attitude:
            text = "PX4 stabilises nothing in this mode: while the stream of setpoints is lost the last torque holds"
            events.warn("px4_parameters", f"{text}; {LOSS_ADVICE}", always=True)

    def step(self) -> None:
        """Send heartbeat, requests, idle and level set points every 20 ms; the controllers' go out as they arrive."""
        flight, guard = self.flight, self.leader.guard
        if not flight.begin_step():
            return
        self._register()
        if self._external is not None and self._status is not None:
            self._external.selected(self._status.nav_state == self._ours, flight.stamps().now)
            if self._external.failure:
                flight.stop = flight.stop or f"external_mode: {self._external.failure}"
        due = flight.step()
        if due.heartbeat and self._ours < 0:  # an external mode is kept by the answers to its arming checks
            self._heartbeat_out.publish(messages.heartbeat(self.px4, self._mode, flight.stamps().now))
        newtons = flight.safe_thrust(due.setpoint)
        if newtons is None:
            return
        if self._by_attitude:
            self._send_attitude(flight.level(newtons))
        else:  # where the guard has taken over: what it flies
            is_guarded = due.setpoint == Setpoint.LEVEL and guard.taken_over
            self._send_wrench(flight.guarded if is_guarded else Wrench(newtons, Vec3()), flight.stamps())

    def take_estimate(self, sample: Sample) -> Taken:
        """Make a state of an estimate."""
        self.flight.spoke_at = self.flight.clock()
        return self.flight.take(sample)

    def take_wrench(self) -> None:
        """Pass on a wrench that has just come."""
        flight, command = self.flight, self.leader.wrenches.newest
        if command is None or command is self.passed_on or self._by_attitude:
            return
        self.passed_on = command
        flight.note_command()
        if flight.may_fly():
            flight.step_guard()
            wrench = flight.guarded if self.leader.guard.taken_over else command.value
            wrench = wrench._replace(thrust=flight.within_thrust_range(wrench.thrust))
            sampled = flight.origin + command.step * self.node.flight.plant_period // 1000
            self._send_wrench(wrench, flight.stamps()._replace(sampled=sampled))

    def _take_setpoint(self, payload: bytes) -> None:
        if (setpoint := self.flight.accepted(payload)) is not None:
            self._send_attitude(setpoint)

    def _note(self, attribute: str, read: Callable[[Any], Any], message: Any) -> None:
        """Keep what PX4 says as ``attribute``."""
        self.flight.spoke_at = self.flight.clock()
        setattr(self, attribute, read(message))
        if self._status is not None:
            vehicle = self._landed, self._battery
            self.flight.said = autopilot(self._status, self._control_mode, self._flags, *vehicle, self._ours)

    def _note_ack(self, ack: Any) -> None:
        self.flight.spoke_at = self.flight.clock()
        self.flight.ack = ack or self.flight.ack

    def missing(self) -> list[str]:
        """Return what PX4 has to answer before it is asked for anything: the registration of our mode."""
        if self._external is None or not self._external.is_open:
            return []
        heard = f"PX4's answer to the registration of mode {self.settings.external_mode}"
        return [heard if self._status is not None else "vehicle_status from PX4: is its uXRCE-DDS agent running?"]

    def refusal(self) -> str:
        """Return why the vehicle must not fly: rotors that cannot lift it, or no message that tells of a pilot."""
        if self._control_mode is None:
            return "no vehicle_control_mode from PX4: is it among the topics of its uXRCE-DDS client?"
        return thrust.weakness(self.node.vehicle, self.mapping.airframe.max_rotor_thrust, "airframe.max_rotor_thrust")

    @property
    def _ours(self) -> int:
        """Number of our external mode in PX4, -1 until PX4 gives one."""
        return self._external.nav_state if self._external is not None else -1

    def _register(self) -> None:
        """Ask for our external mode; once it is known whether there is one, say so."""
        external, events = self._external, self.node.events
        if external is None or self.flight.profile is not PROFILE:
            return
        if self._status is not None:  # before PX4 is heard there is no answer
            external.ask(self.flight.stamps().now)
        chosen_by = ChosenBy(self.settings.chosen_by)
        if external.failure:
            external.close()
            self._external, self.flight.profile = None, self._offboard()
            text = f"{self.settings.external_mode}: {external.failure}"
            if chosen_by == ChosenBy.PILOT:  # in offboard nothing would choose when it takes off
                self.flight.stop = f"arming refused: external_mode {text}, and chosen_by pilot needs it"
            else:
                text += "; flown in offboard instead"
            events.warn("external_mode", text, always=True)
        elif not external.is_open:
            self.flight.profile = external.profile(PROFILE, chosen_by)
            text = f"{self.settings.external_mode} is {mode_name(external.nav_state)} of PX4"
            events.info("external_mode", text, always=True)

    def _arming_refusal(self) -> str:
        """Return why our mode cannot be armed now; PX4 shows texts of its firmware alone, so an event tells ours."""
        before, self._refused = self._refused, self.flight.arming_refusal()
        if self._refused and self._refused != before:
            self.node.events.info("arming_check", self._refused, self.leader.elapsed_ns)
        return self._refused

    def _request(self, request: Request) -> None:
        """Send a VehicleCommand."""
        stamp = self.flight.stamps().now
        self._command_out.publish(messages.command(self.px4, request, self.settings.target_system, stamp))

    def _send_attitude(self, setpoint: AttitudeThrust) -> None:
        """Send an attitude and a thrust in N."""
        self.flight.predicted = mapping.predict(self.mapping, Wrench(setpoint.thrust, Vec3()))
        thrust_body = mapping.collective(self.mapping, setpoint.thrust)
        self._send(messages.attitude(self.px4, setpoint.q_wb, thrust_body, self.flight.stamps().now))

    def _send_wrench(self, wrench: Wrench, stamps: Stamps) -> None:
        self.flight.predicted = mapping.predict(self.mapping, wrench)
        if self._mode == Mode.MOTORS:
            self._send(messages.motors(self.px4, mapping.motors(self.mapping, wrench), *stamps))
        else:
            self._send(*messages.thrust_torque(self.px4, mapping.thrust_torque(self.mapping, wrench), *stamps))

    def _send(self, *found: Any) -> None:
        for publisher, message in zip(self._setpoints_out, found, strict=True):
            publisher.publish(message)

    def _measured(self) -> dict[str, float]:
        """Return how old PX4's states are when it sends them."""
        stamps = self.flight.stamps()
        return {"state_age_ms": 1e-3 * (stamps.now - stamps.sampled)}

    def shut_down(self) -> None:
        """Take our mode out of PX4's list."""
        if self._external is not None:
            self._external.close()


def main() -> None:
    """Run the bridge to PX4."""
    sys.exit(run(PX4, Px4Bridge, "Bridge to PX4: takes wrench_setpoint or attitude_setpoint, publishes state."))
