"""From an autopilot's motor outputs to the wrench of our rotors: PX4's quad-x order, FRD places, one thrust curve.

PX4's mixer is `quad_px4.mapping`; here its airframe is the simulated vehicle itself, so that each output drives the
rotor in its place: 0 front right, 1 rear left, 2 front left, 3 rear right are the stack's 2, 4, 3, 1 of layout ``x``.
"""

import math
from typing import NamedTuple

from quad_autopilot import frames
from quad_core.parameters import ParameterError
from quad_core.types import Vec3, Wrench
from quad_core.vehicle import Layout, Vehicle, max_thrust
from quad_px4.mapping import Mapping, product
from quad_px4.parameters import AirframeParameters, RotorPlace

ARMED, LOCKSTEP = 128, 1
"""MAV_MODE_FLAG_SAFETY_ARMED; HIL_ACTUATOR_CONTROLS_FLAGS_LOCKSTEP."""
MOTORS = 4
_SLACK = 1e-6


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
    first, second, third, fourth = (largest * (curve * u * u + (1.0 - curve) * u) for u in answer.controls)
    x, y, z, thrust = product(mapping.wrench_of_rotors, (first, second, third, fourth))
    return Wrench(thrust, frames.body(Vec3(x, y, z)))
