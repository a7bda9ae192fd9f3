"""One autopilot over MAVLink, without ROS: what it says, what it is asked, what it is sent.

It is asked for its states (SET_MESSAGE_INTERVAL), for its time (TIMESYNC) and, ArduPilot, for the parameters that
decide what a thrust means. Nothing here decides to arm or to fly: ``quad_autopilot.arming`` does.
"""

import math
from typing import Any

from quad_autopilot import frames, thrust
from quad_autopilot.autopilot import NAV_TAKEOFF, Ack, Autopilot, Profile, Request, Stamps
from quad_autopilot.odometry import Sample
from quad_autopilot.parameters import Flier
from quad_core.geometry import body_z, clamp
from quad_core.types import AttitudeThrust
from quad_mavlink import words
from quad_mavlink.link import AUTOPILOT, Link
from quad_mavlink.parameters import MavlinkBridgeParameters

SET_MESSAGE_INTERVAL = 511
GUID_OPTIONS, ANGLE_BOOST = "GUID_OPTIONS", "ATC_ANGLE_BOOST"
THRUST_AS_THRUST = 8
"""Bit 3 of GUID_OPTIONS: without it SET_ATTITUDE_TARGET's thrust is a climb rate."""
_PREARM = 0x10000000  # MAV_SYS_STATUS_PREARM_CHECK
_ONBOARD_CONTROLLER, _NO_AUTOPILOT, _ACTIVE = 18, 8, 4
_HEARTBEAT, _SYS_STATUS, _ATTITUDE_QUATERNION, _LOCAL_POSITION_NED, _ODOMETRY = 0, 1, 31, 32, 331
_STATES = {words.PX4: (_ODOMETRY,), words.ARDUPILOT: (_ATTITUDE_QUATERNION, _LOCAL_POSITION_NED)}
_ATTITUDE_ONLY = 7  # type_mask: body rates are ignored
_SHARE = 0.1  # how fast the clock's offset is corrected


_LEAST_COSINE = 0.1  # ArduPilot multiplies the thrust by 1 / cos(tilt) (ATC_ANGLE_BOOST), and boosts no further


def fraction(settings: MavlinkBridgeParameters, setpoint: AttitudeThrust, boosts: bool) -> float:
    """Return what the autopilot needs for the thrust of ``setpoint``: 0..1; ``boosts``: it divides by cos(tilt)."""
    newtons = setpoint.thrust * (clamp(body_z(setpoint.q_wb).z, _LEAST_COSINE, 1.0) if boosts else 1.0)
    share = clamp(newtons / (4.0 * settings.max_rotor_thrust), 0.0, 1.0)
    return clamp(thrust.compensated(settings.autopilot_curve, settings.thrust_curve, share), 0.0, 1.0)


class MavlinkVehicle:
    """``autopilot``, ``ack`` and ``profile`` are what the arming sequence takes; times in s of the steady clock."""

    def __init__(self, link: Link, settings: MavlinkBridgeParameters) -> None:
        """Nothing is known before the first HEARTBEAT."""
        self.link, self.settings, self._mavlink = link, settings, link.mavlink
        self.profile: Profile = words.UNKNOWN
        self.autopilot: Autopilot | None = None
        self.ack: Ack | None = None
        self.kind = 0
        self.parameters: dict[str, float] = {}
        self._charge = math.nan
        self.refused: list[str] = []
        self._checks_pass = True
        self._texts: tuple[words.Text, ...] = ()
        self._heartbeat: Any = None
        self._position: Any = None
        self._offset = math.nan  # autopilot's ns minus ours
        self._asked = False

    def handle(self, message: Any, now: float) -> Sample | None:
        """Take a message; return the estimate that it completes."""
        kind = message.get_type()
        if kind == "HEARTBEAT":
            self._on_heartbeat(message)
        elif kind == "COMMAND_ACK":
            self._on_ack(message)
        elif kind == "STATUSTEXT":
            self._texts = words.heard(self._texts, now, message.severity, message.text, message.id)
        elif kind == "SYS_STATUS":
            asked = message.onboard_control_sensors_enabled & _PREARM
            self._checks_pass = not asked or bool(message.onboard_control_sensors_health & _PREARM)
            self._charge = 0.01 * message.battery_remaining if message.battery_remaining >= 0 else math.nan
        elif kind == "TIMESYNC":
            self._on_timesync(message, now)
        elif kind == "PARAM_VALUE":
            self.parameters[message.param_id] = message.param_value
        elif kind in ("ODOMETRY", "ATTITUDE_QUATERNION", "LOCAL_POSITION_NED"):
            return self._on_state(kind, message)
        self._renew(now)
        return None

    def _on_heartbeat(self, message: Any) -> None:
        self._heartbeat = message
        if message.autopilot in words.PROFILES:
            self.kind, self.profile = message.autopilot, words.PROFILES[message.autopilot]
        elif not self.kind:
            self.profile = words.UNKNOWN._replace(
                hint=f"system {self.settings.target_system} is MAV_AUTOPILOT {message.autopilot}, "
                f"expected {words.PX4} (PX4) or {words.ARDUPILOT} (ArduPilot)"
            )

    def _renew(self, now: float) -> None:
        if self.kind and self._heartbeat is not None:
            texts = words.newest(self._texts, now)
            self.autopilot = words.said(self._heartbeat, self._checks_pass, texts, self._charge)

    def _on_ack(self, message: Any) -> None:
        if message.target_system not in (0, self.settings.source_system):
            return
        if message.command == SET_MESSAGE_INTERVAL:
            if message.result:
                self.refused.append(f"SET_MESSAGE_INTERVAL: result {message.result}")
        else:
            self.ack = Ack(message.command, message.result)

    def _on_timesync(self, message: Any, now: float) -> None:
        if message.tc1 == 0:
            return  # the autopilot's own question: its clock stays as it is
        taken = 1e9 * now - message.ts1
        if 0.0 <= taken < 1e9:
            offset = message.tc1 - (message.ts1 + 0.5 * taken)
            known = not math.isnan(self._offset) and abs(offset - self._offset) < 1e8
            self._offset = self._offset + _SHARE * (offset - self._offset) if known else offset

    def _on_state(self, kind: str, message: Any) -> Sample | None:
        if (kind == "ODOMETRY") != (self.kind == words.PX4):
            return None
        if kind == "ODOMETRY":
            return words.of_odometry(message)
        if kind == "LOCAL_POSITION_NED":
            self._position = message
            return None
        return words.of_pair(message, self._position)

    def stamped(self, sample: Sample, now: float) -> Sample:
        """Return a sample with the autopilot's time now, so that its age is known once TIMESYNC was answered."""
        if math.isnan(self._offset):
            return sample
        return sample._replace(timestamp=max(sample.timestamp_sample, round(1e-3 * (1e9 * now + self._offset))))

    def every_second(self, now: float) -> None:
        """Send our HEARTBEAT and a TIMESYNC, and ask for what is still missing."""
        mavlink = self._mavlink
        self.link.send(
            mavlink.MAVLink_heartbeat_message(_ONBOARD_CONTROLLER, _NO_AUTOPILOT, 0, 0, _ACTIVE, mavlink_version=3)
        )
        self.link.send(mavlink.MAVLink_timesync_message(0, round(1e9 * now)))
        if not self.kind:
            return
        for name in self.missing():
            self.link.send(
                mavlink.MAVLink_param_request_read_message(
                    self.settings.target_system, AUTOPILOT, name.encode("ascii"), -1
                )
            )
        interval = 1e6 * self.settings.state_interval
        for identity in _STATES[self.kind]:
            self._command(SET_MESSAGE_INTERVAL, (identity, interval), 0)
        for identity, microseconds in ((_HEARTBEAT, 1e5), (_SYS_STATUS, 1e6)):
            if not self._asked:
                self._command(SET_MESSAGE_INTERVAL, (identity, microseconds), 0)
        self._asked = True

    def missing(self) -> list[str]:
        """Return the parameters that must be known before a flight."""
        needed = (GUID_OPTIONS, ANGLE_BOOST) if self.kind == words.ARDUPILOT else ()
        return [name for name in needed if name not in self.parameters]

    def refusal(self) -> str:
        """Return what in the autopilot's parameters speaks against a flight; empty if nothing."""
        if self.kind == words.ARDUPILOT and self.settings.arming.takeoff == Flier.AUTOPILOT:
            return "arming.takeoff: found autopilot, expected ours: ArduPilot takes off in GUIDED, which is our mode"
        if missing := self.missing():
            return f"{', '.join(missing)}: asked for, not answered"
        if self.kind == words.ARDUPILOT and not int(self.parameters[GUID_OPTIONS]) & THRUST_AS_THRUST:
            found = int(self.parameters[GUID_OPTIONS])
            return f"GUID_OPTIONS: found {found}, expected bit 3 (8): a thrust would be taken for a climb rate"
        return ""

    @property
    def boosts(self) -> bool:
        """Whether the autopilot divides the thrust by the cosine of the tilt."""
        return self.kind == words.ARDUPILOT and bool(self.parameters.get(ANGLE_BOOST, 1.0))

    def request(self, request: Request) -> None:
        """Send a COMMAND_LONG."""
        self._command(request.command, (request.param1, request.param2), request.attempt)

    def _command(self, command: int, given: tuple[float, float], attempt: int) -> None:
        first, second = (0.0 if math.isnan(value) else float(value) for value in given)
        place = [math.nan if command == NAV_TAKEOFF else 0.0] * 4  # here, to the height of MIS_TAKEOFF_ALT
        self.link.send(
            self._mavlink.MAVLink_command_long_message(
                self.settings.target_system, AUTOPILOT, command, attempt % 256, first, second, 0.0, *place
            )
        )

    def fly(self, setpoint: AttitudeThrust, stamps: Stamps) -> None:
        """Send an attitude (FRD in NED) and a thrust as SET_ATTITUDE_TARGET, stamped with the state that it answers."""
        x, y, z, w = frames.attitude(setpoint.q_wb)
        self.link.send(
            self._mavlink.MAVLink_set_attitude_target_message(
                stamps.sampled // 1000 & 0xFFFFFFFF,
                self.settings.target_system,
                AUTOPILOT,
                _ATTITUDE_ONLY,
                [w, x, y, z],
                *(0.0, 0.0, 0.0),
                fraction(self.settings, setpoint, self.boosts),
            )
        )
