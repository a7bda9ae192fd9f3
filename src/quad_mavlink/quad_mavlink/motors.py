"""One step of lockstep: sensors out, motors back, and the wrench of our rotors that these make.

The clock is ours, and it goes on only with an answer. While an autopilot boots it answers nothing, but needs a clock
that runs: until its first answer the sensors are sent at the pace of the steady clock, and the vehicle rests.

PX4's mixer is `quad_px4.mapping`; here its airframe is the simulated vehicle itself, so that each output drives the
rotor in its place: 0 front right, 1 rear left, 2 front left, 3 rear right are the stack's 2, 4, 3, 1 of layout ``x``.
"""

import math
import time
from types import ModuleType
from typing import Any, NamedTuple

from quad_autopilot import frames
from quad_core.parameters import ParameterError
from quad_core.types import Vec3, VehicleState, Wrench
from quad_core.vehicle import Layout, Vehicle, max_thrust
from quad_mavlink.link import Server
from quad_mavlink.sensors import Suite
from quad_px4.mapping import Mapping
from quad_px4.parameters import AirframeParameters, RotorPlace

ARMED, LOCKSTEP = 128, 1  # MAV_MODE_FLAG_SAFETY_ARMED; HIL_ACTUATOR_CONTROLS_FLAGS_LOCKSTEP
MOTORS = 4
_SLACK = 1e-6
_CONTROLS = "HIL_ACTUATOR_CONTROLS"


class Answer(NamedTuple):
    """The fields of HIL_ACTUATOR_CONTROLS that are used: us, 0..1 for each motor, MAV_MODE_FLAG, flags."""

    time_usec: int
    controls: tuple[float, float, float, float]
    mode: int
    flags: int

    @property
    def armed(self) -> bool:
        """Whether the motors may turn."""
        return bool(self.mode & ARMED)


AT_REST = Answer(0, (0.0, 0.0, 0.0, 0.0), 0, LOCKSTEP)


def airframe(vehicle: Vehicle, thrust_curve: float) -> AirframeParameters:
    """Return the vehicle as PX4 describes it; raises ParameterError for rotors that are no X."""
    if vehicle.layout != Layout.X:
        raise ParameterError("vehicle.layout: found plus, expected x: the motor outputs are those of a quad-x")
    side, ratio = math.sqrt(0.5) * vehicle.arm_length, vehicle.torque_coefficient / vehicle.lift_coefficient
    return AirframeParameters(
        max_rotor_thrust=0.25 * max_thrust(vehicle),
        thrust_curve=thrust_curve,
        rotor0=RotorPlace(side, side, ratio),
        rotor1=RotorPlace(-side, -side, ratio),
        rotor2=RotorPlace(side, -side, -ratio),
        rotor3=RotorPlace(-side, side, -ratio),
    )


def described(found: AirframeParameters) -> str:
    """Return what PX4 must be told about the vehicle, as its parameters."""
    rotors = (found.rotor0, found.rotor1, found.rotor2, found.rotor3)
    places = (f"CA_ROTOR{i}_PX {r.px:.4g} _PY {r.py:.4g} _KM {r.km:.4g}" for i, r in enumerate(rotors))
    return f"{', '.join(places)}, THR_MDL_FAC {found.thrust_curve:g}"


def refusal(answer: Answer, sent_usec: int) -> str:
    """Return why an answer to the sensors of ``sent_usec`` us cannot be flown; empty if it can."""
    if not answer.flags & LOCKSTEP:
        return "HIL_ACTUATOR_CONTROLS.flags: found no lockstep (bit 0), expected an autopilot built to run in lockstep"
    if answer.time_usec > sent_usec:
        return f"HIL_ACTUATOR_CONTROLS.time_usec: found {answer.time_usec}, expected at most our clock's {sent_usec}"
    for i, control in enumerate(answer.controls):
        if not -_SLACK <= control <= 1.0 + _SLACK:  # false for a NaN, too
            return f"HIL_ACTUATOR_CONTROLS.controls[{i}]: found {control:g}, expected 0 to 1"
    return ""


def wrench(mapping: Mapping, answer: Answer) -> Wrench:
    """Return the wrench (FLU, N and N m) that the motors are told to make; none while disarmed."""
    if not answer.armed:
        return Wrench()
    largest, curve = mapping.airframe.max_rotor_thrust, mapping.airframe.thrust_curve
    forces = [largest * (curve * u * u + (1.0 - curve) * u) for u in answer.controls]
    x, y, z, thrust = (mapping.wrench_of_rotors @ forces).tolist()
    return Wrench(thrust, frames.body(Vec3(x, y, z)))


class RefusedError(ValueError):
    """An answer that cannot be flown; the text names field, found and expected."""


class Exchange:
    """Sends what the sensors read, and takes the answer to it; one to an earlier reading is passed over."""

    def __init__(self, mavlink: ModuleType, server: Server, suite: Suite) -> None:
        self._mavlink, self.server, self.suite = mavlink, server, suite
        self._due = 0.0

    def send(self, truth: VehicleState, wind_w: Vec3) -> None:
        """Read the sensors and send them."""
        reading = self.suite.read(truth, wind_w)
        out: list[Any] = []
        if reading.truth is not None:
            out.append(self._mavlink.MAVLink_hil_state_quaternion_message(*reading.truth))
        if reading.gps is not None:
            out.append(self._mavlink.MAVLink_hil_gps_message(*reading.gps))
        # last: it moves the autopilot's clock
        out.append(self._mavlink.MAVLink_hil_sensor_message(*reading.sensor))
        self.server.send(out)

    def answer(self, patience: float, newest: bool = False) -> Answer | None:
        """Return the answer to the last reading, None if none comes within ``patience`` s; raises RefusedError.

        ``newest``: whatever outputs come count, those for an earlier reading too.
        """
        while True:
            message = self.server.next(_CONTROLS, patience)
            if message is None:
                return None
            first, second, third, fourth = message.controls[:MOTORS]
            found = Answer(message.time_usec, (first, second, third, fourth), message.mode, message.flags)
            if refused := refusal(found, self.suite.time_usec):
                raise RefusedError(refused)
            if newest or found.time_usec == self.suite.time_usec:
                return found

    def newest(self, patience: float) -> Answer | None:
        """Return the newest outputs, whatever they answer; None if none come in ``patience`` s; raises RefusedError."""
        found = self.answer(patience, newest=True)
        while found is not None and (later := self.answer(0.0, newest=True)) is not None:
            found = later
        return found

    def boot(self, truth: VehicleState, wind_w: Vec3, period: float, until: float) -> Answer | None:
        """Send readings every ``period`` s until the steady time ``until`` s; return the first answer if it comes."""
        while not self.server.is_closed and (now := time.monotonic()) < until:
            self._due = max(self._due + period, now)
            self.send(truth, wind_w)
            found = self.answer(max(self._due - time.monotonic(), 0.0))
            if found is not None:
                return found
        return None
