"""`ros2 run quad_mavlink mavlink_bridge`: takes the simulator's place with a vehicle that PX4 or ArduPilot flies.

Subscribes: attitude_setpoint, which becomes SET_ATTITUDE_TARGET. Reads every 2 ms what has come over UDP: the
autopilot's estimate becomes ``state``. MAVLink has no torque message: attitude laws stay in shadow. ``actuation`` is a
prediction: the autopilot reports none. The autopilot is asked for its states (SET_MESSAGE_INTERVAL) and, ArduPilot, for
the parameters that decide what a thrust means. What it does for the flight: ``quad_autopilot.autopilot_flight``.
"""

import math
import sys
from typing import Any

from quad_autopilot import frames, thrust
from quad_autopilot.arming import Setpoint
from quad_autopilot.autopilot import NAV_TAKEOFF, Ack, Request
from quad_autopilot.autopilot_flight import BEAT, LOOK, AutopilotFlight
from quad_autopilot.odometry import Sample
from quad_autopilot.parameters import Flier
from quad_core.cascade import POSITION, STAGE
from quad_core.geometry import body_z, clamp
from quad_core.types import AttitudeThrust
from quad_mavlink import link, modes_and_texts
from quad_mavlink.link import AUTOPILOT
from quad_mavlink.parameters import INTERFACE, MAVLINK, MavlinkBridgeParameters
from quad_node.main import run

SET_MESSAGE_INTERVAL = 511
GUID_OPTIONS, ANGLE_BOOST = "GUID_OPTIONS", "ATC_ANGLE_BOOST"
THRUST_AS_THRUST = 8  # bit 3 of GUID_OPTIONS: without it SET_ATTITUDE_TARGET's thrust is a climb rate
_PREARM = 0x10000000  # MAV_SYS_STATUS_PREARM_CHECK
_ONBOARD_CONTROLLER, _NO_AUTOPILOT, _ACTIVE = 18, 8, 4
_HEARTBEAT, _SYS_STATUS, _EXTENDED_SYS_STATE = 0, 1, 245
_ATTITUDE_QUATERNION, _LOCAL_POSITION_NED, _ODOMETRY = 31, 32, 331
_STATES = {modes_and_texts.PX4: (_ODOMETRY,), modes_and_texts.ARDUPILOT: (_ATTITUDE_QUATERNION, _LOCAL_POSITION_NED)}
_ATTITUDE_ONLY = 7  # type_mask: body rates are ignored
_LEAST_COSINE = 0.1  # ArduPilot multiplies the thrust by 1 / cos(tilt) (ATC_ANGLE_BOOST), and boosts no further


def fraction(settings: MavlinkBridgeParameters, setpoint: AttitudeThrust, boosts: bool) -> float:
    """Return what the autopilot needs for the thrust of ``setpoint``: 0..1; ``boosts``: it divides by cos(tilt)."""
    newtons = setpoint.thrust * (clamp(body_z(setpoint.q_wb).z, _LEAST_COSINE, 1.0) if boosts else 1.0)
    share = clamp(newtons / (4.0 * settings.max_rotor_thrust), 0.0, 1.0)
    return clamp(thrust.compensated(settings.autopilot_curve, settings.thrust_curve, share), 0.0, 1.0)


class MavlinkBridge:
    """PX4 or ArduPilot over MAVLink: armed, flown by attitude, landed. Nothing is known before the first HEARTBEAT."""

    def __init__(self) -> None:
        """Look for pymavlink and open the port; raises ParameterError for what cannot fly."""
        self.flight = AutopilotFlight(
            MAVLINK,
            modes_and_texts.UNKNOWN,
            ask=self._request,
            activate=self.activate,
            refusal=self._refusal,
            shut_down=self.shut_down,
        )
        self.node, self.settings = self.flight.node, self.flight.settings
        found = self.settings
        thrust.require(found.max_rotor_thrust, INTERFACE.page)
        self.flight.predicted = thrust.predicted(0.0, found.max_rotor_thrust)
        self.link = link.Link(link.load(), found.listen, found.connect, found.source_system, found.target_system)
        self.kind = 0
        self.parameters: dict[str, float] = {}
        self._charge, self._checks_pass, self._landed, self._refused = math.nan, True, False, ""
        self._texts: tuple[modes_and_texts.Text, ...] = ()
        self._heartbeat: Any = None
        self._position: Any = None
        self._is_level_sent = False
        self.node.measures.append(self._measured)
        self.node.links.subscribe(STAGE[POSITION].output, self._take_setpoint, raw=True)
        self.node.every(1.0, self.ask_for_more)
        self.node.every(LOOK, self._read)
        self.node.every(BEAT, self.step)

    def activate(self) -> None:
        """Say which autopilot it is and where; the flight begins."""
        self.node.events.info("autopilot", f"{self.flight.profile.name} at {self.link.peer}", always=True)

    def step(self) -> None:
        """Keep the autopilot in our mode and ask it for what is due, every 20 ms."""
        if not self.flight.begin_step():
            return
        self._read()
        due = self.flight.step()
        newtons = self.flight.safe_thrust(due.setpoint)
        # level: as a stream before the flight, once when it is given up, for a stream keeps the mode
        if newtons is not None and not (due.setpoint == Setpoint.LEVEL and self._is_level_sent):
            self.send_attitude(self.flight.level(newtons))
        if newtons is not None:
            self._is_level_sent = due.setpoint == Setpoint.LEVEL

    def _take_setpoint(self, payload: bytes) -> None:
        if (setpoint := self.flight.accepted(payload)) is not None:
            self.send_attitude(setpoint)

    def _read(self) -> None:
        """Take what has come."""
        before = self.kind
        for message in self.link.messages():
            self.flight.spoke_at = self.flight.clock()
            sample = self.handle(message)
            if sample is not None:
                self.flight.take(sample)
        if self.kind != before:
            self.flight.leader.estimator = self.flight.profile.name
            self.ask_for_more()

    def handle(self, message: Any) -> Sample | None:
        """Take a message; return the estimate that it completes."""
        kind = message.get_type()
        if kind == "HEARTBEAT":
            self._on_heartbeat(message)
        elif kind == "COMMAND_ACK":
            self._on_ack(message)
        elif kind == "STATUSTEXT":
            self._texts = modes_and_texts.heard(
                self._texts, self.flight.clock(), message.severity, message.text, message.id
            )
        elif kind == "SYS_STATUS":
            asked = message.onboard_control_sensors_enabled & _PREARM
            self._checks_pass = not asked or bool(message.onboard_control_sensors_health & _PREARM)
            self._charge = 0.01 * message.battery_remaining if message.battery_remaining >= 0 else math.nan
        elif kind == "EXTENDED_SYS_STATE":
            self._landed = message.landed_state == modes_and_texts.ON_GROUND
        elif kind == "PARAM_VALUE":
            self.parameters[message.param_id] = message.param_value
        elif kind == "ODOMETRY" and self.kind == modes_and_texts.PX4:
            return modes_and_texts.of_odometry(message)
        elif kind == "LOCAL_POSITION_NED":
            self._position = message
        elif kind == "ATTITUDE_QUATERNION" and self.kind == modes_and_texts.ARDUPILOT:
            return modes_and_texts.of_pair(message, self._position)
        if self._heartbeat is not None:
            texts = modes_and_texts.newest(self._texts, self.flight.clock())
            self.flight.said = modes_and_texts.said(
                self._heartbeat, self._checks_pass, texts, self._charge, self._landed
            )
        return None

    def _on_heartbeat(self, message: Any) -> None:
        if message.autopilot in modes_and_texts.PROFILES:
            self._heartbeat = message
            self.kind, self.flight.profile = message.autopilot, modes_and_texts.PROFILES[message.autopilot]
        elif not self.kind:
            self.flight.profile = modes_and_texts.UNKNOWN._replace(
                hint=f"system {self.settings.target_system} is MAV_AUTOPILOT {message.autopilot}, "
                f"expected {modes_and_texts.PX4} (PX4) or {modes_and_texts.ARDUPILOT} (ArduPilot)"
            )

    def _on_ack(self, message: Any) -> None:
        if message.target_system not in (0, self.settings.source_system):
            return
        if message.command != SET_MESSAGE_INTERVAL:
            self.flight.ack = Ack(message.command, message.result)
        elif message.result:
            self._refused = f"SET_MESSAGE_INTERVAL: result {message.result}"

    def ask_for_more(self) -> None:
        """Send our HEARTBEAT, and ask for what is still missing, every second."""
        if self.flight.is_over:
            return
        mavlink, target = self.link.mavlink, self.settings.target_system
        self.link.send(
            mavlink.MAVLink_heartbeat_message(_ONBOARD_CONTROLLER, _NO_AUTOPILOT, 0, 0, _ACTIVE, mavlink_version=3)
        )
        if self._refused and not self.flight.sample:
            self.node.events.warn("states_refused", self._refused, self.flight.leader.elapsed_ns)
        if not self.kind:
            return
        for name in self._unanswered():
            self.link.send(mavlink.MAVLink_param_request_read_message(target, AUTOPILOT, name.encode("ascii"), -1))
        states = dict.fromkeys(_STATES[self.kind], 1e6 * self.settings.state_interval)
        for identity, microseconds in {**states, _HEARTBEAT: 1e5, _SYS_STATUS: 1e6, _EXTENDED_SYS_STATE: 2e5}.items():
            self._command(SET_MESSAGE_INTERVAL, identity, microseconds)

    def _unanswered(self) -> list[str]:
        """Return the parameters that must be known before a flight and are not."""
        needed = (GUID_OPTIONS, ANGLE_BOOST) if self.kind == modes_and_texts.ARDUPILOT else ()
        return [name for name in needed if name not in self.parameters]

    def _refusal(self) -> str:
        """Return what speaks against a flight: too weak rotors, or parameters of the autopilot."""
        if self.kind == modes_and_texts.ARDUPILOT and self.settings.arming.takeoff == Flier.AUTOPILOT:
            return "arming.takeoff: found autopilot, expected ours: ArduPilot takes off in GUIDED, which is our mode"
        if missing := self._unanswered():
            return f"{', '.join(missing)}: asked for, not answered"
        if (
            self.kind == modes_and_texts.ARDUPILOT
            and not (found := int(self.parameters[GUID_OPTIONS])) & THRUST_AS_THRUST
        ):
            return f"GUID_OPTIONS: found {found}, expected bit 3 (8): a thrust would be taken for a climb rate"
        return thrust.weakness(self.node.vehicle, self.settings.max_rotor_thrust, "max_rotor_thrust")

    @property
    def boosts(self) -> bool:
        """Whether the autopilot divides the thrust by the cosine of the tilt."""
        return self.kind == modes_and_texts.ARDUPILOT and bool(self.parameters.get(ANGLE_BOOST, 1.0))

    def _request(self, request: Request) -> None:
        """Send a COMMAND_LONG."""
        self._command(request.command, request.param1, request.param2, request.param3, request.attempt)

    def _command(self, command: int, param1: float, param2: float, param3: float = 0.0, attempt: int = 0) -> None:
        first, second = (0.0 if math.isnan(value) else float(value) for value in (param1, param2))
        place = [math.nan if command == NAV_TAKEOFF else 0.0] * 4  # here, to the height of MIS_TAKEOFF_ALT
        self.link.send(
            self.link.mavlink.MAVLink_command_long_message(
                self.settings.target_system, AUTOPILOT, command, attempt % 256, first, second, param3, *place
            )
        )

    def send_attitude(self, setpoint: AttitudeThrust) -> None:
        """Send an attitude (FRD in NED) and a thrust as SET_ATTITUDE_TARGET, stamped with the state that it answers."""
        self.flight.predicted = thrust.predicted(setpoint.thrust, self.settings.max_rotor_thrust)
        x, y, z, w = frames.attitude(setpoint.q_wb)
        self.link.send(
            self.link.mavlink.MAVLink_set_attitude_target_message(
                self.flight.stamps().sampled // 1000 & 0xFFFFFFFF,
                self.settings.target_system,
                AUTOPILOT,
                _ATTITUDE_ONLY,
                [w, x, y, z],
                *(0.0, 0.0, 0.0),
                fraction(self.settings, setpoint, self.boosts),
            )
        )

    def _measured(self) -> dict[str, float]:
        """Return what the link dropped."""
        return {"strangers": self.link.strangers, "lost_datagrams": self.link.lost}

    def shut_down(self) -> None:
        """Close the port."""
        self.link.close()


def main() -> None:
    """Run the bridge over MAVLink."""
    text = "Bridge to PX4 or ArduPilot over MAVLink: takes attitude_setpoint."
    sys.exit(run(MAVLINK, MavlinkBridge, text))
