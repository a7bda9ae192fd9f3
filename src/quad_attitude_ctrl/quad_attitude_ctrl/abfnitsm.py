"""ABFNITSM: adaptive backstepping fast nonsingular integral terminal sliding mode, a ``quad.attitude_law`` plug-in.

The paper's attitude law (eqs. 39-60). One step: Euler rates (13) -> commands x_1d, x_1d', x_1d'' -> errors (40, 41) ->
surface (45, 46) -> equivalent (52) and reaching control (53) -> torque (56), limited -> then, with the values *before*
this step used throughout, forward Euler of the surface integral (45) and the estimates (54, 55), and the filter.
``axis`` is the law of one axis; ``surface``, ``sliding_control``, ``body_torque`` and ``command_filter`` hold the
equations. Why parameters leave Table 2:
docs/decisions/0002-additions-to-the-paper.md.
"""

from typing import Annotated, NamedTuple

from quad_attitude_ctrl.axis import Axis, AxisControl, AxisMemory, Filter, axis_command, axis_control, axis_memory
from quad_attitude_ctrl.body_torque import body_acceleration, coefficients, inverse_dynamics, model_acceleration
from quad_attitude_ctrl.command_filter import Command
from quad_attitude_ctrl.sliding_control import FORM_ABS, Estimates, force_difference
from quad_core.parameters import Choice, Flag, Value
from quad_core.rotations import euler_from_quaternion, euler_rates, wrap_angle
from quad_core.types import AttitudeInputs, Vec3, Wrench
from quad_core.vehicle import Vehicle

MAPPING_PRINTED = 0


class Parameters(NamedTuple):
    """Parameters of ABFNITSM; the defaults are the preset ``tuned``."""

    roll: Axis = Axis()
    pitch: Axis = Axis(angle_gain=50.0)
    yaw: Axis = Axis(rate_gain=12.0, filter=Filter(bandwidth=8.0, max_rate=1.5))
    command: Annotated[
        int,
        Choice(
            ("filter", "feed_forward", "raw"),
            "where x_1d' and x_1d'' come from: the command filter, the setpoint, or zero",
            "Eq. 41, addition",
        ),
    ] = 0
    adaptation_form: Annotated[
        int, Choice(("abs", "sat"), "Q_hat' in proportion to |s| (assumed printed) or to s sat(s)", "Eq. 54")
    ] = FORM_ABS
    mapping: Annotated[
        int,
        Choice(
            ("printed", "exact"),
            "Euler acceleration to torque: identity (Eq. 14), or Eq. 13 and Eq. 1 in full",
            "Eq. 14",
        ),
    ] = 1
    drag_sign: Annotated[
        int, Choice(("corrected", "printed"), "a_2 x_2^2: opposing the motion, or as printed", "eqs. 9, 52")
    ] = 0
    anti_windup: Annotated[
        bool, Flag("surface integral and estimates of an axis rest while its torque is limited, here or in `actuation`")
    ] = True


class Memory(NamedTuple):
    """What ABFNITSM keeps from step to step, per axis."""

    roll: AxisMemory = AxisMemory()
    pitch: AxisMemory = AxisMemory()
    yaw: AxisMemory = AxisMemory()
    initialised: float = 0.0


class AxisFlags(NamedTuple):
    """One flag per axis: roll, pitch, yaw."""

    x: bool = False
    y: bool = False
    z: bool = False


class Internals(NamedTuple):
    """Fields of quad_msgs/AttitudeInternals."""

    desired_angles: Vec3 = Vec3()
    desired_rates: Vec3 = Vec3()
    desired_accelerations: Vec3 = Vec3()
    angle_error: Vec3 = Vec3()
    rate_error: Vec3 = Vec3()
    sliding_variable: Vec3 = Vec3()
    surface_integral: Vec3 = Vec3()
    surface_exponent: Vec3 = Vec3()
    adaptive_constant: Vec3 = Vec3()
    adaptive_angle: Vec3 = Vec3()
    adaptive_rate: Vec3 = Vec3()
    equivalent_control: Vec3 = Vec3()
    reaching_control: Vec3 = Vec3()
    lyapunov: Vec3 = Vec3()
    lyapunov_rate: Vec3 = Vec3()
    torque_limited: AxisFlags = AxisFlags()
    adaptation_frozen: AxisFlags = AxisFlags()


def init(parameters: Parameters, vehicle: Vehicle) -> Memory:  # noqa: ARG001 (the contract's signature)
    """Return the memory before the first step: no surface integral, estimates at Q_hat(0)."""
    return Memory(_fresh(parameters.roll), _fresh(parameters.pitch), _fresh(parameters.yaw), 0.0)


def step(
    parameters: Parameters, vehicle: Vehicle, memory: Memory, inputs: AttitudeInputs, dt: float
) -> tuple[Wrench, Memory, Internals]:
    """Return wrench, memory and internals of one step of ``dt`` s (eqs. 39-60). Never raises on flyable inputs."""
    angles = euler_from_quaternion(inputs.state.q_wb)
    omega_b = inputs.state.omega_b
    rates = euler_rates(angles, omega_b)
    known = memory
    if memory.initialised <= 0.0:
        known = _started(memory, angles)
    roll, pitch, yaw = _controls(parameters, vehicle, known, inputs, angles, rates)

    wanted = _torque(parameters, vehicle, angles, rates, omega_b, Vec3(roll.control, pitch.control, yaw.control))
    torque = Vec3(
        _held(wanted.x, parameters.roll.max_torque),
        _held(wanted.y, parameters.pitch.max_torque),
        _held(wanted.z, parameters.yaw.max_torque),
    )
    limited = AxisFlags(torque.x != wanted.x, torque.y != wanted.y, torque.z != wanted.z)

    actuation = inputs.actuation
    rest_roll = parameters.anti_windup and (limited.x or actuation.roll_limited)
    rest_pitch = parameters.anti_windup and (limited.y or actuation.pitch_limited)
    rest_yaw = parameters.anti_windup and (limited.z or actuation.yaw_limited)
    setpoint = inputs.setpoint
    kept = Memory(
        axis_memory(parameters.roll, known.roll, roll, setpoint.angles.x, rest_roll, dt),
        axis_memory(parameters.pitch, known.pitch, pitch, setpoint.angles.y, rest_pitch, dt),
        axis_memory(parameters.yaw, known.yaw, yaw, setpoint.angles.z, rest_yaw, dt),
        1.0,
    )
    frozen = AxisFlags(rest_roll or roll.dead, rest_pitch or pitch.dead, rest_yaw or yaw.dead)
    return Wrench(setpoint.thrust, torque), kept, _internals(known, roll, pitch, yaw, limited, frozen)


def _controls(
    parameters: Parameters, vehicle: Vehicle, memory: Memory, inputs: AttitudeInputs, angles: Vec3, rates: Vec3
) -> tuple[AxisControl, AxisControl, AxisControl]:
    """Return eqs. 40-55 of the three axes. The model terms of Eq. 52 are left to Eq. 1 when the mapping is exact."""
    model = Vec3(0.0, 0.0, 0.0)
    if parameters.mapping == MAPPING_PRINTED:
        model = model_acceleration(coefficients(vehicle), rates, parameters.drag_sign)
    setpoint = inputs.setpoint
    form = parameters.adaptation_form
    mode = parameters.command
    roll = axis_command(mode, memory.roll, setpoint.angles.x, setpoint.rates.x, setpoint.accelerations.x)
    pitch = axis_command(mode, memory.pitch, setpoint.angles.y, setpoint.rates.y, setpoint.accelerations.y)
    yaw = axis_command(mode, memory.yaw, setpoint.angles.z, setpoint.rates.z, setpoint.accelerations.z)
    return (
        axis_control(parameters.roll, memory.roll, roll, angles.x - roll.angle, angles.x, rates.x, model.x, form),
        axis_control(parameters.pitch, memory.pitch, pitch, angles.y - pitch.angle, angles.y, rates.y, model.y, form),
        axis_control(
            parameters.yaw, memory.yaw, yaw, wrap_angle(angles.z - yaw.angle), angles.z, rates.z, model.z, form
        ),
    )


def _torque(parameters: Parameters, vehicle: Vehicle, angles: Vec3, rates: Vec3, omega_b: Vec3, control: Vec3) -> Vec3:
    """Return physical torque in N m from b U in rad/s^2 (Eq. 56): (d U_phi, d U_theta, U_psi), or the exact mapping."""
    if parameters.mapping == MAPPING_PRINTED:
        b = coefficients(vehicle)
        arm = vehicle.arm_length
        return Vec3(
            arm * force_difference(control.x, b.b1),
            arm * force_difference(control.y, b.b2),
            force_difference(control.z, b.b3),
        )
    acceleration_b = body_acceleration(angles, rates, control)
    return inverse_dynamics(vehicle, omega_b, acceleration_b, parameters.drag_sign)


def _held(torque: float, most: float) -> float:
    if torque > most:
        return most
    if torque < -most:
        return -most
    return torque


def _fresh(axis: Axis) -> AxisMemory:
    estimates = Estimates(axis.initial_constant, axis.initial_angle, axis.initial_rate)
    return AxisMemory(Command(0.0, 0.0, 0.0, 0.0), 0.0, estimates)


def _started(memory: Memory, angles: Vec3) -> Memory:
    """Return the memory with the command filters at the attitude of the first sample, at rest."""
    roll, pitch, yaw = memory.roll, memory.pitch, memory.yaw
    return Memory(
        AxisMemory(Command(angles.x, 0.0, 0.0, angles.x), roll.surface_integral, roll.estimates),
        AxisMemory(Command(angles.y, 0.0, 0.0, angles.y), pitch.surface_integral, pitch.estimates),
        AxisMemory(Command(angles.z, 0.0, 0.0, angles.z), yaw.surface_integral, yaw.estimates),
        1.0,
    )


def _internals(
    memory: Memory, roll: AxisControl, pitch: AxisControl, yaw: AxisControl, limited: AxisFlags, frozen: AxisFlags
) -> Internals:
    x, y, z = memory.roll.estimates, memory.pitch.estimates, memory.yaw.estimates
    return Internals(
        desired_angles=Vec3(roll.command.angle, pitch.command.angle, yaw.command.angle),
        desired_rates=Vec3(roll.command.rate, pitch.command.rate, yaw.command.rate),
        desired_accelerations=Vec3(roll.command.acceleration, pitch.command.acceleration, yaw.command.acceleration),
        angle_error=Vec3(roll.error, pitch.error, yaw.error),
        rate_error=Vec3(roll.error_rate, pitch.error_rate, yaw.error_rate),
        sliding_variable=Vec3(roll.sliding, pitch.sliding, yaw.sliding),
        surface_integral=Vec3(memory.roll.surface_integral, memory.pitch.surface_integral, memory.yaw.surface_integral),
        surface_exponent=Vec3(roll.exponent, pitch.exponent, yaw.exponent),
        adaptive_constant=Vec3(x.constant, y.constant, z.constant),
        adaptive_angle=Vec3(x.angle, y.angle, z.angle),
        adaptive_rate=Vec3(x.rate, y.rate, z.rate),
        equivalent_control=Vec3(roll.equivalent, pitch.equivalent, yaw.equivalent),
        reaching_control=Vec3(roll.reaching, pitch.reaching, yaw.reaching),
        lyapunov=Vec3(roll.lyapunov, pitch.lyapunov, yaw.lyapunov),
        lyapunov_rate=Vec3(roll.lyapunov_rate, pitch.lyapunov_rate, yaw.lyapunov_rate),
        torque_limited=limited,
        adaptation_frozen=frozen,
    )


_AXES = ("roll", "pitch", "yaw")
_MINIMAL: dict[str, Value] = {
    "mapping": "printed",
    "anti_windup": False,
    **{f"{axis}.linear_gain": 3.0 for axis in _AXES},
    **{f"{axis}.surface_width": 1.0 for axis in _AXES},
    **{f"{axis}.max_surface_integral": 1e9 for axis in _AXES},
    **{f"{axis}.max_estimate": 1e9 for axis in _AXES},
    **{f"{axis}.max_torque": 1e6 for axis in _AXES},
    "yaw.filter.bandwidth": 40.0,
    "yaw.filter.max_rate": 1e6,
}

PRESETS: dict[str, dict[str, Value]] = {
    "tuned": {},
    "minimal": _MINIMAL,
    "printed": {**_MINIMAL, "drag_sign": "printed"},
}
