"""What flows between the stages, as NamedTuples of floats.

Each type here has a message of the same name and field names in ``quad_msgs`` (``Wrench`` travels as
``geometry_msgs/WrenchStamped``). SI units, radians, ENU world, FLU body, quaternion xyzw (body to
world), Z-Y-X Euler angles. A comment ``[unit]`` follows every number, as in the .msg files.
"""

import math
from typing import NamedTuple


class Vec3(NamedTuple):
    """Three components; the frame is named by the field that holds it (``_w`` world, ``_b`` body)."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


class Quat(NamedTuple):
    """Unit quaternion, xyzw, rotating body vectors into the world."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    w: float = 1.0


class VehicleState(NamedTuple):
    """Rigid-body state: position m, velocity m/s (world), attitude, body rates rad/s (x1..x12).

    The ages are those of the four at the time of the state. ``ground_z``: height of the vehicle as it stands on the
    ground, as the estimate had it at arming. ``on_ground``: it has not risen clear of there (``quad_core.lift_off``).
    Compiled text makes a state with the three functions below only: Numba takes no defaults and no ``_replace``.
    """

    p_w: Vec3 = Vec3()  # [m]
    v_w: Vec3 = Vec3()  # [m/s]
    q_wb: Quat = Quat()  # [1]
    omega_b: Vec3 = Vec3()  # [rad/s]
    position_age: float = 0.0  # [s]
    velocity_age: float = 0.0  # [s]
    attitude_age: float = 0.0  # [s]
    rate_age: float = 0.0  # [s]
    ground_z: float = 0.0  # [m]
    on_ground: bool = False


def fresh(p_w: Vec3, v_w: Vec3, q_wb: Quat, omega_b: Vec3) -> VehicleState:
    """Return a state without age, in the air."""
    return VehicleState(p_w, v_w, q_wb, omega_b, 0.0, 0.0, 0.0, 0.0, 0.0, False)


def with_ages(state: VehicleState, position: float, velocity: float, attitude: float, rate: float) -> VehicleState:
    """Return ``state`` with the ages of its four parts in s."""
    return VehicleState(
        p_w=state.p_w,
        v_w=state.v_w,
        q_wb=state.q_wb,
        omega_b=state.omega_b,
        position_age=position,
        velocity_age=velocity,
        attitude_age=attitude,
        rate_age=rate,
        ground_z=state.ground_z,
        on_ground=state.on_ground,
    )


def with_ground(state: VehicleState, ground_z: float, on_ground: bool) -> VehicleState:
    """Return ``state`` of a vehicle that stands at ``ground_z`` m, and whether it is still there."""
    return VehicleState(
        p_w=state.p_w,
        v_w=state.v_w,
        q_wb=state.q_wb,
        omega_b=state.omega_b,
        position_age=state.position_age,
        velocity_age=state.velocity_age,
        attitude_age=state.attitude_age,
        rate_age=state.rate_age,
        ground_z=ground_z,
        on_ground=on_ground,
    )


class TrajectoryPoint(NamedTuple):
    """Reference at one instant, world frame (eqs. 61-68).

    ``trajectory_time`` is t of eqs. 61-68: negative during the approach, 0 at its end.
    """

    trajectory_time: float = 0.0  # [s]
    p_w: Vec3 = Vec3()  # [m]
    v_w: Vec3 = Vec3()  # [m/s]
    a_w: Vec3 = Vec3()  # [m/s^2]
    jerk_w: Vec3 = Vec3()  # [m/s^3]
    snap_w: Vec3 = Vec3()  # [m/s^4]
    yaw: float = 0.0  # [rad]
    yaw_rate: float = 0.0  # [rad/s]
    yaw_acceleration: float = 0.0  # [rad/s^2]


NOT_BEGUN = -1e6  # ``trajectory_time`` of a mission's reference while its trajectory has not begun, rests or has ended


class FlightMode(NamedTuple):
    """What the commander decided in one of its steps, in numbers: those of ``quad_commander.mode_table``.

    ``since``: step at which the mode was entered, ``reason`` the condition, -1 none, -2 on request; ``raised``: one bit
    per condition. ``request``, ``answer`` (1 done, 2 refused) and ``request_step``: the last request.
    ``guard_request`` is what is asked of the guard. ``is_over``: the flight may end.
    """

    since: int = 0  # [1]
    request_step: int = 0  # [1]
    raised: int = 0  # [1]
    reason: int = -1  # [1]
    mode: int = 0  # [1]
    request: int = 0  # [1]
    answer: int = 0  # [1]
    guard_request: int = 0  # [1]
    is_over: bool = False


class GuardStatus(NamedTuple):
    """What the guard did in a plant step, in numbers: those of ``quad_guard.guard``.

    ``mode`` holds since step ``since`` for ``reason``; ``condition`` is wrong now, whatever the latched mode.
    ``command_age`` counts from when the last good wrench answered the newest good state: while it does that it is not
    late, however old it is, for then the state alone is late. ``warning``: a wrench or state is late. ``land``: samples
    were refused, but the position is good: a commander should land. ``stopped``: the backup law has landed and stopped
    the motors. ``on_ground``: low, at rest, under too little thrust to fly, as an accepted state has it; ``contact``:
    for ``contact.time``.
    """

    since: int = 0  # [1]
    refused_commands: int = 0  # [1]
    refused_samples: int = 0  # [1]
    command_age: float = 0.0  # [s]
    state_age: float = 0.0  # [s]
    mode: int = 0  # [1]
    reason: int = 0  # [1]
    condition: int = 0  # [1]
    warning: bool = False
    land: bool = False
    stopped: bool = False
    on_ground: bool = False
    contact: bool = False


class AttitudeThrust(NamedTuple):
    """Attitude and collective thrust commanded by the position law (eq. 38).

    ``angles`` are (phi, theta, psi), phi and theta in the heading the law tilts in. ``q_wb`` has their thrust axis,
    turned about it to psi; autopilots fly it, and every attitude law but abfnitsm and itsm, which fly ``angles``.
    ``rates`` and ``accelerations`` are derivatives of ``angles`` for attitude laws that are set to feed forward; else
    zero.
    ``thrust`` in N, ``thrust_fraction`` = thrust / maximum thrust, 0..1.
    """

    angles: Vec3 = Vec3()  # [rad]
    rates: Vec3 = Vec3()  # [rad/s]
    accelerations: Vec3 = Vec3()  # [rad/s^2]
    q_wb: Quat = Quat()  # [1]
    thrust: float = 0.0  # [N]
    thrust_fraction: float = 0.0  # [1]


class Wrench(NamedTuple):
    """Collective thrust along body z in N and physical torque about the body axes in N m (eq. 56)."""

    thrust: float = 0.0  # [N]
    torque_b: Vec3 = Vec3()  # [N m]


class Rotors(NamedTuple):
    """One number per rotor in the paper's order: 1 rear, 2 right, 3 front, 4 left (plus layout)."""

    r1: float = 0.0
    r2: float = 0.0
    r3: float = 0.0
    r4: float = 0.0


class Actuation(NamedTuple):
    """What the vehicle made of the last wrench (eqs. 3 and 8): speeds, achieved wrench, limits met."""

    rotor_speed: Rotors = Rotors()  # [rad/s]
    rotor_thrust: Rotors = Rotors()  # [N]
    thrust: float = 0.0  # [N]
    torque_b: Vec3 = Vec3()  # [N m]
    thrust_high: bool = False
    thrust_low: bool = False
    roll_limited: bool = False
    pitch_limited: bool = False
    yaw_limited: bool = False


class SensorFault(NamedTuple):
    """What goes wrong between truth and ``state``: a frozen reading, a jump in position m and in heading rad.

    ``misread`` applies it; ``quad_dynamics.sensor`` freezes.
    """

    frozen: bool = False
    offset_w: Vec3 = Vec3()  # [m]
    yaw_offset: float = 0.0  # [rad]


class LinkFault(NamedTuple):
    """What goes wrong between the command and the plant: this step's command comes ``delay`` s late, or never."""

    delay: float = 0.0  # [s]
    lost: bool = False


ALL_ROTORS = Rotors(1.0, 1.0, 1.0, 1.0)
NO_SENSOR_FAULT = SensorFault()
NO_LINK_FAULT = LinkFault()


def is_faulty(fault: SensorFault) -> bool:
    """Return whether ``fault`` changes a reading."""
    return fault != NO_SENSOR_FAULT


def misread(reading: VehicleState, fault: SensorFault) -> VehicleState:
    """Return ``reading`` with the jump of ``fault``: position shifted, attitude turned about the world's z axis."""
    p, q, offset = reading.p_w, reading.q_wb, fault.offset_w
    if fault.yaw_offset != 0.0:
        s, c = math.sin(0.5 * fault.yaw_offset), math.cos(0.5 * fault.yaw_offset)
        q = Quat(c * q.x - s * q.y, c * q.y + s * q.x, c * q.z + s * q.w, c * q.w - s * q.z)
    shifted = Vec3(p.x + offset.x, p.y + offset.y, p.z + offset.z)
    jumped = fresh(shifted, reading.v_w, q, reading.omega_b)
    return with_ages(jumped, reading.position_age, reading.velocity_age, reading.attitude_age, reading.rate_age)


class Conditions(NamedTuple):
    """All that acts on a flight over one plant step beyond the nominal model; the default is a calm day.

    ``force_w`` N (world) and ``torque_b`` N m (body) from outside; ``wind_w`` m/s velocity of the air (world);
    ``rotor_effectiveness`` true over nominal thrust and drag torque of each rotor; ``thrust_limit`` largest thrust
    that the battery allows over the nominal one; ``payload_mass`` kg hangs at the centre. Parameter errors of eq. 10
    belong to the plant, not here.
    """

    force_w: Vec3 = Vec3()  # [N]
    torque_b: Vec3 = Vec3()  # [N m]
    wind_w: Vec3 = Vec3()  # [m/s]
    payload_mass: float = 0.0  # [kg]
    rotor_effectiveness: Rotors = ALL_ROTORS  # [1]
    thrust_limit: float = 1.0  # [1]
    sensor: SensorFault = NO_SENSOR_FAULT
    link: LinkFault = NO_LINK_FAULT


CALM = Conditions()


class Disturbance(NamedTuple):
    """What truly acts on the vehicle beyond the nominal model (eqs. 10-12): and the ``Conditions`` themselves.

    ``force_w`` N and ``torque_b`` N m are applied from outside; ``D_P`` m/s^2 (world) and ``D_A``
    rad/s^2 (body axes) are the lumped uncertainties of eqs. 10-12, parameter errors and conditions included.
    """

    force_w: Vec3 = Vec3()  # [N]
    torque_b: Vec3 = Vec3()  # [N m]
    lumped_acceleration_w: Vec3 = Vec3()  # [m/s^2]
    lumped_angular_acceleration_b: Vec3 = Vec3()  # [rad/s^2]
    wind_w: Vec3 = Vec3()  # [m/s]
    rotor_effectiveness: Rotors = ALL_ROTORS  # [1]
    thrust_limit: float = 1.0  # [1]
    payload_mass: float = 0.0  # [kg]
    sensor_frozen: bool = False
    sensor_offset_w: Vec3 = Vec3()  # [m]
    sensor_yaw_offset: float = 0.0  # [rad]
    link_delay: float = 0.0  # [s]
    link_lost: bool = False


class PositionInputs(NamedTuple):
    """All that a position law may look at in one step. ``actuation`` is that of the previous plant step."""

    state: VehicleState
    reference: TrajectoryPoint
    actuation: Actuation


class AttitudeInputs(NamedTuple):
    """All that an attitude law may look at in one step. ``actuation`` is that of the previous plant step."""

    state: VehicleState
    setpoint: AttitudeThrust
    actuation: Actuation


class InputSteps(NamedTuple):
    """Plant step (a count) of each input of a stage other than the state, in the order of its row; -1: missing."""

    first: int = -1
    second: int = -1
    third: int = -1
    fourth: int = -1


class StepRecord(NamedTuple):
    """How a stage came to its answer: ``dt`` s that it computed with, and which inputs it took.

    ``replaced_inputs`` has bit k set if input k was too old and a safe one stood in for it.
    """

    dt: float = 0.0  # [s]
    input_steps: InputSteps = InputSteps()
    replaced_inputs: int = 0


class PositionInternals(NamedTuple):
    """What a position law shows of one step, world frame; fields of a law that has no such quantity are 0.

    ``position_error`` e_7, e_9, e_11 in m and ``velocity_error`` e_8, e_10, e_12 in m/s (actual less desired);
    ``error_integral`` Gamma in m s; ``adaptive_gain`` xi_hat in 1/s; ``virtual_velocity`` x_8d, x_10d, x_12d in m/s;
    ``acceleration_command`` U in m/s^2, before the limits; ``disturbance_estimate`` in m/s^2; ``lyapunov`` L and
    ``lyapunov_rate`` L' as far as they can be known in flight. The flags say which limits this step met, and
    ``adaptation_frozen`` whether integrals and adaptive gains rested for it.
    """

    position_error: Vec3 = Vec3()  # [m]
    velocity_error: Vec3 = Vec3()  # [m/s]
    error_integral: Vec3 = Vec3()  # [m s]
    adaptive_gain: Vec3 = Vec3()  # [1/s]
    virtual_velocity: Vec3 = Vec3()  # [m/s]
    acceleration_command: Vec3 = Vec3()  # [m/s^2]
    disturbance_estimate: Vec3 = Vec3()  # [m/s^2]
    lyapunov: float = 0.0  # [mixed]
    lyapunov_rate: float = 0.0  # [mixed/s]
    velocity_limited: bool = False
    acceleration_limited: bool = False
    tilt_limited: bool = False
    thrust_limited: bool = False
    descent_limited: bool = False
    adaptation_frozen: bool = False


class AxisFlags(NamedTuple):
    """One flag per axis: roll, pitch, yaw."""

    x: bool = False
    y: bool = False
    z: bool = False


class AttitudeInternals(NamedTuple):
    """What an attitude law shows of one step, per axis; fields of a law that has no such quantity are 0.

    ``desired_angles`` x_1d in rad with ``desired_rates`` in rad/s and ``desired_accelerations`` in rad/s^2;
    ``angle_error`` e in rad and ``rate_error`` e' in rad/s (actual less desired); ``sliding_variable`` s and
    ``surface_integral`` in rad/s; ``surface_exponent`` eta; ``adaptive_constant`` in rad/s^2, ``adaptive_angle`` in
    1/s^2 and ``adaptive_rate`` in 1/s: Q_hat 1 to 3; ``equivalent_control`` and ``reaching_control`` (of other laws:
    feed-forward and feedback) in rad/s^2; ``lyapunov`` l and ``lyapunov_rate`` l' as far as they can be known in
    flight. ``torque_limited``: the torque met its limit; ``adaptation_frozen``: integral and estimates rested.
    """

    desired_angles: Vec3 = Vec3()  # [rad]
    desired_rates: Vec3 = Vec3()  # [rad/s]
    desired_accelerations: Vec3 = Vec3()  # [rad/s^2]
    angle_error: Vec3 = Vec3()  # [rad]
    rate_error: Vec3 = Vec3()  # [rad/s]
    sliding_variable: Vec3 = Vec3()  # [rad/s]
    surface_integral: Vec3 = Vec3()  # [rad/s]
    surface_exponent: Vec3 = Vec3()  # [1]
    adaptive_constant: Vec3 = Vec3()  # [rad/s^2]
    adaptive_angle: Vec3 = Vec3()  # [1/s^2]
    adaptive_rate: Vec3 = Vec3()  # [1/s]
    equivalent_control: Vec3 = Vec3()  # [rad/s^2]
    reaching_control: Vec3 = Vec3()  # [rad/s^2]
    lyapunov: Vec3 = Vec3()  # [mixed]
    lyapunov_rate: Vec3 = Vec3()  # [mixed/s]
    torque_limited: AxisFlags = AxisFlags()
    adaptation_frozen: AxisFlags = AxisFlags()
