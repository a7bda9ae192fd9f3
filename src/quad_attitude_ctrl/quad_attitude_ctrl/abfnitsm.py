"""ABFNITSM: adaptive backstepping fast nonsingular integral terminal sliding mode, a ``quad.attitude_law`` plug-in.

The paper's attitude law, per axis and written for roll (pitch and yaw are the same law; Q_hat are estimates):

    e_1      = x_1 - x_1d,  e_1' = x_2 - x_1d'                               angle error, rad, and its rate  (40, 41)
    I'       = delta_1 |e_1|^eta_1 sat(e_1) + delta_2 |e_1'|^eta_2 sat(e_1')
    s_1      = e_1' + I                                                      surface, rad/s                  (45, 46)
    b_1 U_0  = x_1d'' - a_1 x_4 x_6 - a_2 x_2^2 - I' - e_1                   equivalent control, rad/s^2     (52)
    Phi_hat  = Q_hat_1 + Q_hat_2 |x_1| + Q_hat_3 |x_2|                       bound of the uncertainty        (60)
    b_1 U_1  = -(rho_1 s_1 + rho_2 |s_1|^sigma sat(s_1) + Phi_hat sat(s_1))  reaching control, rad/s^2       (53)
    Q_hat_i' = Delta_i |s_1| {1, |x_1|, |x_2|}, 0 while |s_1| <= delta       adaptation                      (54, 55)
    torque   = from b_1 (U_0 + U_1)                                          N m                             (56)

Added: a command filter that gives x_1d' and x_1d'' (``command``), torque limits (``torque``), bounds on I and Q_hat,
the exact mapping to torque in the place of Eq. 14. I and Q_hat move by forward Euler after the values *before* the step
were used throughout. ``sliding_control`` is the law of one axis, ``torque`` the mapping to torque. Why parameters leave
Table 2: docs/explanation/additions.md.
"""

from typing import Annotated, NamedTuple

from quad_attitude_ctrl.command import (
    CommandFilter,
    CommandSource,
    Desired,
    FilterStates,
    Shaping,
    desired,
    filters_at_rest,
    next_filters,
)
from quad_attitude_ctrl.sliding_control import (
    AdaptationForm,
    AxisControl,
    AxisGains,
    AxisMemory,
    AxisState,
    Estimates,
    angle_exponents,
    axis_control,
    force_difference,
    next_axis_memory,
)
from quad_attitude_ctrl.torque import (
    AntiWindup,
    TorqueLimits,
    TorqueMapping,
    body_acceleration,
    coefficients,
    integrals_frozen,
    inverse_dynamics,
    limited_torque,
    model_acceleration,
)
from quad_core.geometry import ZERO, euler_from_quaternion, euler_rates, wrap_angle
from quad_core.parameters import Choice, Value
from quad_core.types import AttitudeInputs, AttitudeInternals, AxisFlags, Vec3, Wrench
from quad_core.vehicle import DragSign, Vehicle

Internals = AttitudeInternals


class Parameters(NamedTuple):
    """Parameters of ABFNITSM; the defaults are the preset ``tuned``."""

    roll: AxisGains = AxisGains()
    pitch: AxisGains = AxisGains(angle_gain=50.0)
    yaw: AxisGains = AxisGains(rate_gain=12.0, filter=CommandFilter(bandwidth=8.0, max_rate=1.5))
    command: Annotated[
        int, Choice(CommandSource, "x_1d', x_1d'' from command filter, setpoint, or zero", "Eq. 41, addition")
    ] = CommandSource.FILTER.value
    adaptation_form: Annotated[
        int, Choice(AdaptationForm, "Q_hat' in proportion to |s| (assumed printed) or to s sat(s)", "Eq. 54")
    ] = AdaptationForm.ABS.value
    mapping: Annotated[
        int,
        Choice(TorqueMapping, "Euler acceleration to torque: identity (Eq. 14), or Eq. 13 and Eq. 1 in full", "Eq. 14"),
    ] = TorqueMapping.EXACT.value
    drag_sign: Annotated[int, Choice(DragSign, "a_2 x_2^2: opposing the motion, or as printed", "eqs. 9, 52")] = (
        DragSign.CORRECTED
    )
    anti_windup: AntiWindup = True


class Memory(NamedTuple):
    """What ABFNITSM keeps from step to step, per axis; ``initialised``: the filters started at an attitude."""

    roll: AxisMemory = AxisMemory()
    pitch: AxisMemory = AxisMemory()
    yaw: AxisMemory = AxisMemory()
    filters: FilterStates = FilterStates()
    initialised: bool = False


def init(parameters: Parameters, vehicle: Vehicle) -> Memory:  # noqa: ARG001 (the contract's signature)
    """Return the memory before the first step: no surface integral, estimates at Q_hat(0)."""
    roll, pitch, yaw = initial_axis(parameters.roll), initial_axis(parameters.pitch), initial_axis(parameters.yaw)
    return Memory(roll, pitch, yaw, filters_at_rest(ZERO), False)


def step(
    parameters: Parameters, vehicle: Vehicle, memory: Memory, inputs: AttitudeInputs, dt: float
) -> tuple[Wrench, Memory, Internals]:
    """Return wrench, memory and internals of one step of ``dt`` s (eqs. 39-60). Never raises on flyable inputs."""
    setpoint, omega_b = inputs.setpoint, inputs.state.omega_b
    angles = euler_from_quaternion(inputs.state.q_wb)
    rates = euler_rates(angles, omega_b)
    filters = memory.filters if memory.initialised else filters_at_rest(angles)
    goal = desired(parameters.command, filters, setpoint)
    states = _axis_states(parameters, vehicle, goal, angles, rates)
    eta, form = angle_exponents(states), parameters.adaptation_form
    roll = axis_control(parameters.roll, memory.roll, states[0], eta.x, form)
    pitch = axis_control(parameters.pitch, memory.pitch, states[1], eta.y, form)
    yaw = axis_control(parameters.yaw, memory.yaw, states[2], eta.z, form)

    control = Vec3(roll.control, pitch.control, yaw.control)
    torque_command = _torque(parameters, vehicle, angles, rates, omega_b, control)
    limits = TorqueLimits(parameters.roll.max_torque, parameters.pitch.max_torque, parameters.yaw.max_torque)
    torque = limited_torque(torque_command, limits)

    rest = integrals_frozen(parameters.anti_windup, torque.limited, inputs.actuation)
    shaping = Shaping(parameters.command, parameters.roll.filter, parameters.pitch.filter, parameters.yaw.filter)
    next_memory = Memory(
        roll=next_axis_memory(parameters.roll, memory.roll, roll, rest.x, dt),
        pitch=next_axis_memory(parameters.pitch, memory.pitch, pitch, rest.y, dt),
        yaw=next_axis_memory(parameters.yaw, memory.yaw, yaw, rest.z, dt),
        filters=next_filters(shaping, filters, setpoint, dt),
        initialised=True,
    )
    frozen = AxisFlags(rest.x or roll.in_deadband, rest.y or pitch.in_deadband, rest.z or yaw.in_deadband)
    internals = shown((memory.roll, memory.pitch, memory.yaw), goal, states, (roll, pitch, yaw), torque.limited, frozen)
    return Wrench(setpoint.thrust, torque.torque), next_memory, internals


def _axis_states(
    parameters: Parameters, vehicle: Vehicle, goal: Desired, angles: Vec3, rates: Vec3
) -> tuple[AxisState, AxisState, AxisState]:
    """Return eqs. 40 and 41 of the three axes. The model terms of Eq. 52 are left to Eq. 1 if the mapping is exact."""
    model = ZERO
    if parameters.mapping == TorqueMapping.PRINTED:
        model = model_acceleration(coefficients(vehicle), rates, parameters.drag_sign)
    x_d, v_d, a_d = goal.angles, goal.rates, goal.accelerations
    roll_error, yaw_error = wrap_angle(angles.x - x_d.x), wrap_angle(angles.z - x_d.z)
    return (
        AxisState(angles.x, rates.x, roll_error, rates.x - v_d.x, a_d.x, model.x),
        AxisState(angles.y, rates.y, angles.y - x_d.y, rates.y - v_d.y, a_d.y, model.y),
        AxisState(angles.z, rates.z, yaw_error, rates.z - v_d.z, a_d.z, model.z),
    )


def _torque(parameters: Parameters, vehicle: Vehicle, angles: Vec3, rates: Vec3, omega_b: Vec3, control: Vec3) -> Vec3:
    """Return physical torque in N m from b U in rad/s^2 (Eq. 56): (d U_phi, d U_theta, U_psi), or the exact mapping."""
    if parameters.mapping == TorqueMapping.PRINTED:
        b = coefficients(vehicle)
        arm = vehicle.arm_length
        return Vec3(
            arm * force_difference(control.x, b.b1),
            arm * force_difference(control.y, b.b2),
            force_difference(control.z, b.b3),
        )
    acceleration_b = body_acceleration(angles, rates, control)
    return inverse_dynamics(vehicle, omega_b, acceleration_b, parameters.drag_sign)


def initial_axis(gains: AxisGains) -> AxisMemory:
    """Return the memory of one axis before the first step."""
    return AxisMemory(0.0, Estimates(gains.initial_constant, gains.initial_angle, gains.initial_rate))


def shown(
    axes: tuple[AxisMemory, AxisMemory, AxisMemory],
    goal: Desired,
    states: tuple[AxisState, AxisState, AxisState],
    controls: tuple[AxisControl, AxisControl, AxisControl],
    limited: AxisFlags,
    frozen: AxisFlags,
) -> Internals:
    """Return what the step shows; ``axes`` are the memories of roll, pitch and yaw before the step."""
    roll, pitch, yaw = controls
    x, y, z = axes[0].estimates, axes[1].estimates, axes[2].estimates
    return Internals(
        desired_angles=goal.angles,
        desired_rates=goal.rates,
        desired_accelerations=goal.accelerations,
        angle_error=Vec3(states[0].error, states[1].error, states[2].error),
        rate_error=Vec3(states[0].error_rate, states[1].error_rate, states[2].error_rate),
        sliding_variable=Vec3(roll.sliding, pitch.sliding, yaw.sliding),
        surface_integral=Vec3(axes[0].surface_integral, axes[1].surface_integral, axes[2].surface_integral),
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


_MINIMAL_AXIS = {
    "linear_gain": 3.0, "surface_width": 1.0, "max_surface_integral": 1e9, "max_estimate": 1e9, "max_torque": 1e6
}  # fmt: skip
_MINIMAL: dict[str, Value] = {
    "mapping": "printed",
    "anti_windup": False,
    **{f"{axis}.{name}": value for axis in ("roll", "pitch", "yaw") for name, value in _MINIMAL_AXIS.items()},
    "yaw.filter.bandwidth": 40.0,
    "yaw.filter.max_rate": 1e6,
}

PRESETS: dict[str, dict[str, Value]] = {
    "tuned": {},
    "minimal": _MINIMAL,
    "printed": {**_MINIMAL, "drag_sign": "printed"},
    # a step asks for at most 0.23 step bandwidth^2 rad/s^2: 60 degrees at 40 rad/s are 386, and 0.5 N m give 143
    "agile": {f"{axis}.filter.bandwidth": 28.0 for axis in ("roll", "pitch")},
}
