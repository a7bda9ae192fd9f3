"""ABFNITSM on SO(3): the paper's attitude law without Euler angles, a ``quad.attitude_law`` plug-in.

With q = q_d^-1 q_wb (scalar part q_w >= 0) and Omega_d of the command filter, per body axis i:

    e     = 2 (q_x, q_y, q_z)                                                attitude error, rad         (for 40)
    w     = Omega - R_e^T Omega_d                                            rate error, rad/s           (for 41)
    I_i'  = delta_1 |e_i|^eta_1 sat(e_i) + delta_2 |w_i|^eta_2 sat(w_i)
    s     = w + I                                                            surface, rad/s              (45, 46)
    U_i   = -I_i' - e_i - (rho_1 s_i + rho_2 |s_i|^sigma sat(s_i) + Phi_hat_i sat(s_i))     rad/s^2      (52, 53)
    torque = J (U + R_e^T Omega_d' - Omega x R_e^T Omega_d) + Omega x J Omega - tau_D       N m          (56, 1)

It has no singularity, as w, not e', stands in the surface: V = 4 (1 - q_w) + |s|^2 / 2 has e . w in the place of e e',
so the paper's Eq. 58 holds word for word, with its -e . I that Eq. 59 forgets. It never takes the long way round: q and
-q are one attitude, and the sign changes only ``margin`` beyond 180 degrees, so that noise there cannot hold it. Near
level e, w and U are those of Eqs. 40, 41, 52, 53. What Eq. 60 calls x_1 is 2 (q_x, q_y, q_z) of q_wb, x_2 is Omega.
At exactly 180 degrees a continuous law has to stand still (Bhat and Bernstein, 2000); this one turns.

The goal's heading is never farther than ``widest`` from the vehicle's: q_d is turned about its own thrust axis up to
there. A vehicle that spins, which small rotors cannot stop at once, would else feel a tilt that turns with it.
"""

from typing import Annotated, NamedTuple

from quad_attitude_ctrl import abfnitsm
from quad_attitude_ctrl.abfnitsm import initial_axis, shown
from quad_attitude_ctrl.command import CommandFilter, CommandSource
from quad_attitude_ctrl.rotation_filter import (
    NO_ROTATION,
    Goal,
    RotationShaping,
    RotationState,
    about_thrust,
    as_angles,
    at_rest,
    goal_of,
    next_rotation,
    swing_twist,
)
from quad_attitude_ctrl.sliding_control import (
    AdaptationForm,
    AxisGains,
    AxisMemory,
    AxisState,
    angle_exponents,
    axis_control,
    next_axis_memory,
)
from quad_attitude_ctrl.torque import AntiWindup, TorqueLimits, integrals_frozen, inverse_dynamics, limited_torque
from quad_core.geometry import add, clamp, cross, relative_attitude, rotate_inverse, subtract
from quad_core.parameters import Choice, Real, Value
from quad_core.types import AttitudeInputs, AttitudeInternals, AxisFlags, Quat, Vec3, Wrench
from quad_core.vehicle import DragSign, Vehicle

Internals = AttitudeInternals


class Parameters(NamedTuple):
    """Parameters of ABFNITSM on SO(3); the defaults are the preset ``tuned``, the gains those of ``abfnitsm``."""

    roll: AxisGains = AxisGains()
    pitch: AxisGains = AxisGains(angle_gain=50.0)
    yaw: AxisGains = AxisGains(rate_gain=12.0, filter=CommandFilter(bandwidth=8.0, max_rate=1.5))
    command: Annotated[int, Choice(CommandSource, "source of Omega_d and Omega_d', as in abfnitsm", "addition")] = (
        CommandSource.FILTER.value
    )
    adaptation_form: Annotated[
        int, Choice(AdaptationForm, "Q_hat' in proportion to |s| (assumed printed) or to s sat(s)", "Eq. 54")
    ] = AdaptationForm.ABS.value
    anti_windup: AntiWindup = True
    widest: Annotated[
        float,
        Real("rad", "largest attitude error that law and filter act on; larger: faster turns", 0.01, 6.3, "addition"),
    ] = 0.6
    margin: Annotated[
        float, Real("", "q_w beyond 180 degrees at which a turn changes direction; 0: at once", 0.0, 0.5, "addition")
    ] = 0.05


class Memory(NamedTuple):
    """What the law keeps: per axis, the command filter, and which of q, -q it follows (1 or -1)."""

    roll: AxisMemory = AxisMemory()
    pitch: AxisMemory = AxisMemory()
    yaw: AxisMemory = AxisMemory()
    filter: RotationState = RotationState()
    side: float = 1.0
    initialised: bool = False


def init(parameters: Parameters, vehicle: Vehicle) -> Memory:  # noqa: ARG001 (the contract's signature)
    """Return the memory before the first step: no surface integral, estimates at Q_hat(0)."""
    roll, pitch, yaw = initial_axis(parameters.roll), initial_axis(parameters.pitch), initial_axis(parameters.yaw)
    return Memory(roll, pitch, yaw, NO_ROTATION, 1.0, False)


def step(
    parameters: Parameters, vehicle: Vehicle, memory: Memory, inputs: AttitudeInputs, dt: float
) -> tuple[Wrench, Memory, Internals]:
    """Return wrench, memory and internals of one step of ``dt`` s. Raises nothing on flyable inputs.

    In the internals angles and rates are those of body axes, ``desired_angles`` the Euler angles of the goal.
    """
    setpoint, q_wb, omega_b = inputs.setpoint, inputs.state.q_wb, inputs.state.omega_b
    filtered = memory.filter if memory.initialised else at_rest(q_wb, setpoint)
    goal = with_heading_near(goal_of(parameters.command, filtered, setpoint), q_wb, parameters.widest)
    q = relative_attitude(goal.attitude, q_wb)
    side = chosen_side(memory, q.w, parameters.margin)
    error = doubled(q, side)
    turned_rates = rotate_inverse(q, goal.rates)
    error_rate = subtract(omega_b, turned_rates)
    states = _axis_states(q_wb, omega_b, error, error_rate)
    eta, form = angle_exponents(states), parameters.adaptation_form
    roll = axis_control(parameters.roll, memory.roll, states[0], eta.x, form)
    pitch = axis_control(parameters.pitch, memory.pitch, states[1], eta.y, form)
    yaw = axis_control(parameters.yaw, memory.yaw, states[2], eta.z, form)

    carried = subtract(rotate_inverse(q, goal.accelerations), cross(omega_b, turned_rates))
    acceleration = add(Vec3(roll.control, pitch.control, yaw.control), carried)
    command = inverse_dynamics(vehicle, omega_b, acceleration, DragSign.CORRECTED)
    limits = TorqueLimits(parameters.roll.max_torque, parameters.pitch.max_torque, parameters.yaw.max_torque)
    torque = limited_torque(command, limits)

    rest = integrals_frozen(parameters.anti_windup, torque.limited, inputs.actuation)
    frozen = AxisFlags(rest.x or roll.in_deadband, rest.y or pitch.in_deadband, rest.z or yaw.in_deadband)
    shaping = RotationShaping(
        parameters.command, parameters.roll.filter, parameters.pitch.filter, parameters.yaw.filter, parameters.widest
    )
    axes = (memory.roll, memory.pitch, memory.yaw)
    internals = shown(axes, as_angles(goal), states, (roll, pitch, yaw), torque.limited, frozen)
    next_memory = Memory(
        roll=next_axis_memory(parameters.roll, memory.roll, roll, rest.x, dt),
        pitch=next_axis_memory(parameters.pitch, memory.pitch, pitch, rest.y, dt),
        yaw=next_axis_memory(parameters.yaw, memory.yaw, yaw, rest.z, dt),
        filter=next_rotation(shaping, filtered, setpoint, dt),
        side=side,
        initialised=True,
    )
    return Wrench(setpoint.thrust, torque.torque), next_memory, internals


def with_heading_near(goal: Goal, q_wb: Quat, widest: float) -> Goal:
    """Return ``goal`` turned about its thrust axis until at most ``widest`` rad of turn from ``q_wb`` are left."""
    turn = swing_twist(relative_attitude(q_wb, goal.attitude)).z
    if abs(turn) <= widest:
        return goal
    return about_thrust(goal, clamp(turn, -widest, widest) - turn)


def chosen_side(memory: Memory, scalar: float, margin: float) -> float:
    """Return 1 or -1, with which q must be multiplied for the short way round; ``scalar`` is its q_w.

    Once chosen it stays until the other way is shorter by ``margin``.
    """
    if not memory.initialised:
        return 1.0 if scalar >= 0.0 else -1.0
    return -memory.side if memory.side * scalar < -margin else memory.side


def doubled(q: Quat, side: float) -> Vec3:
    """Return 2 side (q_x, q_y, q_z): near 0 the rotation vector in rad."""
    return Vec3(2.0 * side * q.x, 2.0 * side * q.y, 2.0 * side * q.z)


def _axis_states(q_wb: Quat, omega_b: Vec3, error: Vec3, error_rate: Vec3) -> tuple[AxisState, AxisState, AxisState]:
    """Return what the law of each axis looks at; acceleration and model terms are added for all axes at once."""
    angle = doubled(q_wb, 1.0 if q_wb.w >= 0.0 else -1.0)
    return (
        AxisState(angle.x, omega_b.x, error.x, error_rate.x, 0.0, 0.0),
        AxisState(angle.y, omega_b.y, error.y, error_rate.y, 0.0, 0.0),
        AxisState(angle.z, omega_b.z, error.z, error_rate.z, 0.0, 0.0),
    )


_MINIMAL = {name: value for name, value in abfnitsm.PRESETS["minimal"].items() if name != "mapping"}

PRESETS: dict[str, dict[str, Value]] = {
    "tuned": {},
    "minimal": {**_MINIMAL, "widest": 6.3},
    "agile": {f"{axis}.filter.bandwidth": 48.0 for axis in ("roll", "pitch")},
}
"""As those of ``abfnitsm``; ``minimal``: Table 2 and no bounds; ``agile``: large steps as fast as 0.5 N m allow."""
