"""What flows between the stages, as NamedTuples of floats.

Each type here has a message of the same name and field names in ``quad_msgs`` (``Wrench`` travels as
``geometry_msgs/WrenchStamped``). SI units, radians, ENU world, FLU body, quaternion xyzw (body to
world), Z-Y-X Euler angles.
"""

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
    """Rigid-body state: position m, velocity m/s (world), attitude, body rates rad/s (x1..x12)."""

    p_w: Vec3 = Vec3()
    v_w: Vec3 = Vec3()
    q_wb: Quat = Quat()
    omega_b: Vec3 = Vec3()


class TrajectoryPoint(NamedTuple):
    """Reference at one instant, world frame (eqs. 61-68).

    ``trajectory_time`` is t of eqs. 61-68: negative during the approach, 0 at its end.
    """

    trajectory_time: float = 0.0
    p_w: Vec3 = Vec3()
    v_w: Vec3 = Vec3()
    a_w: Vec3 = Vec3()
    jerk_w: Vec3 = Vec3()
    snap_w: Vec3 = Vec3()
    yaw: float = 0.0
    yaw_rate: float = 0.0
    yaw_acceleration: float = 0.0


class AttitudeThrust(NamedTuple):
    """Attitude and collective thrust wanted by the position law (eq. 38).

    ``angles`` are (phi, theta, psi) and carry the truth; ``q_wb`` is the same attitude.
    ``rates`` and ``accelerations`` are feed-forward derivatives of ``angles`` and are used only where
    the attitude law is told so; zero where the position law knows none.
    ``thrust`` in N, ``thrust_fraction`` = thrust / maximum thrust, 0..1.
    """

    angles: Vec3 = Vec3()
    rates: Vec3 = Vec3()
    accelerations: Vec3 = Vec3()
    q_wb: Quat = Quat()
    thrust: float = 0.0
    thrust_fraction: float = 0.0


class Wrench(NamedTuple):
    """Collective thrust along body z in N and physical torque about the body axes in N m (eq. 56)."""

    thrust: float = 0.0
    torque_b: Vec3 = Vec3()


class Rotors(NamedTuple):
    """One number per rotor in the paper's order: 1 rear, 2 right, 3 front, 4 left (plus layout)."""

    r1: float = 0.0
    r2: float = 0.0
    r3: float = 0.0
    r4: float = 0.0


class Actuation(NamedTuple):
    """What the vehicle made of the last wrench (eqs. 3 and 8): speeds, achieved wrench, limits met."""

    rotor_speed: Rotors = Rotors()
    rotor_thrust: Rotors = Rotors()
    thrust: float = 0.0
    torque_b: Vec3 = Vec3()
    thrust_high: bool = False
    thrust_low: bool = False
    roll_limited: bool = False
    pitch_limited: bool = False
    yaw_limited: bool = False


class Payload(NamedTuple):
    """What hangs on the vehicle beside its own body, summed about the body origin, so that payloads add.

    ``mass`` kg; ``moment_b`` first moment (mass times offset) kg m; ``inertia_b`` moments of inertia about the body
    axes kg m^2; ``products_b`` kg m^2: sums of m y z, m x z, m x y.
    """

    mass: float = 0.0
    moment_b: Vec3 = Vec3()
    inertia_b: Vec3 = Vec3()
    products_b: Vec3 = Vec3()


class SensorFault(NamedTuple):
    """What goes wrong between truth and ``state``: a frozen reading, a jump in position m and in heading rad."""

    frozen: bool = False
    offset_w: Vec3 = Vec3()
    yaw_offset: float = 0.0


class LinkFault(NamedTuple):
    """What goes wrong between the command and the plant: this step's command comes ``delay`` s late, or never."""

    delay: float = 0.0
    lost: bool = False


NO_PAYLOAD = Payload()
ALL_ROTORS = Rotors(1.0, 1.0, 1.0, 1.0)
NO_SENSOR_FAULT = SensorFault()
NO_LINK_FAULT = LinkFault()


class Conditions(NamedTuple):
    """All that acts on a flight over one plant step beyond the nominal model; the default is a calm day.

    ``force_w`` N (world) and ``torque_b`` N m (body) from outside; ``wind_w`` m/s velocity of the air (world);
    ``rotor_effectiveness`` true over nominal thrust and drag torque of each rotor; ``thrust_limit`` largest thrust
    that the battery allows over the nominal one. Parameter errors of eq. 10 belong to the plant, not here.
    """

    force_w: Vec3 = Vec3()
    torque_b: Vec3 = Vec3()
    wind_w: Vec3 = Vec3()
    payload: Payload = NO_PAYLOAD
    rotor_effectiveness: Rotors = ALL_ROTORS
    thrust_limit: float = 1.0
    sensor: SensorFault = NO_SENSOR_FAULT
    link: LinkFault = NO_LINK_FAULT


CALM = Conditions()


class Disturbance(NamedTuple):
    """What truly acts on the vehicle beyond the nominal model (eqs. 10-12): ``Conditions`` as far as they say more.

    ``force_w`` N and ``torque_b`` N m are applied from outside; ``D_P`` m/s^2 (world) and ``D_A``
    rad/s^2 (body axes) are the lumped uncertainties of eqs. 10-12, parameter errors and conditions included.
    """

    force_w: Vec3 = Vec3()
    torque_b: Vec3 = Vec3()
    lumped_acceleration_w: Vec3 = Vec3()
    lumped_angular_acceleration_b: Vec3 = Vec3()
    wind_w: Vec3 = Vec3()
    rotor_effectiveness: Rotors = ALL_ROTORS
    thrust_limit: float = 1.0
    payload_mass: float = 0.0
    sensor_frozen: bool = False
    sensor_offset_w: Vec3 = Vec3()
    sensor_yaw_offset: float = 0.0
    link_delay: float = 0.0
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
