"""What an autopilot's sensors read of the true motion, and when, as MAVLink has it: body FRD, world NED.

::

    gyro     = omega + b + n       accelerometer = R^T (v' + g e_z) + b + n       magnetometer = R^T B + b + n
    b_k+1    = e^(-dt/T) b_k + N_b sqrt(T/2 (1 - e^(-2 dt/T))) w          bias: first-order Gauss-Markov
    n        = N / sqrt(dt) w                                             white noise of density N
    T = T0 - L h        p = p0 (T / T0)^(g0 / (R L))                            ISA, troposphere (ISO 2533)
    M = a (1 - e2) / W^3    N = a / W    W = sqrt(1 - e2 sin^2(latitude))       radii of WGS 84 (NIMA TR8350.2)
    B = |B| (cos I sin D, cos I cos D, -sin I)                                  east, north, up

The accelerometer reads the mean specific force since its last reading, so that any plant will do: what it feels is the
change of its velocity. Sensors sit in the centre of gravity; there is no vibration, no quantisation, no range limit.
Discretisation: Woodman, "An introduction to inertial navigation" (2007), and exact for a Gauss-Markov process. The
world is the tangent plane at home: over 1 km its height differs from the ellipsoid's by 8 cm, which is left out.
"""

import math
from collections import deque
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_autopilot import frames
from quad_core.cycle import seconds
from quad_core.geometry import add, clamp, norm, rotate_inverse, scale, subtract
from quad_core.parameters import ParameterError
from quad_core.types import Quat, Vec3, VehicleState

STREAM_FAMILY = 4
GYRO, GYRO_BIAS, ACCEL, ACCEL_BIAS, MAG, MAG_BIAS, GPS, GPS_VELOCITY = range(0, 24, 3)
BARO, COLUMNS = 24, 25
SEA_LEVEL_PRESSURE, SEA_LEVEL_TEMPERATURE = 101_325.0, 288.15  # Pa, K
LAPSE = 0.0065  # K/m
EXPONENT = 9.80665 / (287.05287 * LAPSE)  # g0 / (R L)
KELVIN = 273.15
SEMI_MAJOR, FLATTENING = 6_378_137.0, 1.0 / 298.257223563
INERTIAL, MAGNETIC, BAROMETRIC = 0b111111, 0b111 << 6, 1 << 9 | 1 << 11 | 1 << 12
"""HIL_SENSOR_UPDATED_FLAGS; bit 10, differential pressure, is never set: there is no air speed sensor."""
FIX_3D, SATELLITES = 3, 12
HORIZONTAL, VERTICAL = 90, 180
"""What the receiver says of its accuracy in cm: that of a good fix, for autopilots refuse to fly without one."""
UNKNOWN_COURSE = 65_535
_SLOWEST = 0.5
_SHORT = 32_767
_GRAVITY = 9.80665
_MICROSECOND = 1000

Row = NDArray[np.float64]  # the standard normals of a step, ``COLUMNS`` of them
Fields = tuple[Any, ...]  # the numbers of a message in the order and units in which MAVLink has them


class Noise(NamedTuple):
    """White noise of ``density`` per sqrt(Hz), and a bias: density, correlation time s, deviation at step 0."""

    density: float = 0.0
    walk: float = 0.0
    time: float = 1000.0
    turn_on: float = 0.0


class Home(NamedTuple):
    """Where the world's origin lies in deg and m (WGS 84), and the Earth's field there in gauss and deg (WMM 2025)."""

    latitude: float = 47.397742
    longitude: float = 8.545594
    altitude: float = 488.0
    field_strength: float = 0.484
    field_declination: float = 3.5
    field_inclination: float = 63.4


class Sensors(NamedTuple):
    """What the sensors are like, and how many plant steps lie between two readings.

    Gyro rad/s and accelerometer m/s^2: twice the ADIS16448's data sheet, as RotorS has it (Furrer et al. 2016), the
    accelerometer calibrated. Magnetometer gauss: PX4's Gazebo model. Barometer Pa and Pa/s: MS5611's data sheet, 1 hPa
    an hour. GPS m/sqrt(s): Beard and McLain (2012, table 7.1); its velocity m/s: u-blox NEO-M8's data sheet; its delay
    s: EKF2_GPS_DELAY of PX4's simulator start-up.
    """

    home: Home = Home()
    gyro: Noise = Noise(3.394e-4, 3.879e-5, 1000.0, 8.727e-3)
    accelerometer: Noise = Noise(4e-3, 6e-3, 300.0)
    magnetometer: Noise = Noise(4e-4, 6.4e-6, 600.0)
    magnetometer_steps: int = 4
    barometer_noise: float = 1.2
    barometer_drift: float = 0.028
    barometer_steps: int = 5
    gps_walk: float = 0.21
    gps_vertical_walk: float = 0.40
    gps_walk_time: float = 1100.0
    gps_velocity_noise: float = 0.05
    gps_delay: float = 0.01
    gps_steps: int = 25
    truth_steps: int = 5


class Memory(NamedTuple):
    """Biases of gyro rad/s, accelerometer m/s^2 (body FLU), magnetometer gauss (body FLU); error of GPS m (ENU)."""

    gyro: Vec3 = Vec3()
    accelerometer: Vec3 = Vec3()
    magnetometer: Vec3 = Vec3()
    gps: Vec3 = Vec3()


class Inertial(NamedTuple):
    """Angular rate rad/s and specific force m/s^2, body FRD."""

    rate: Vec3
    force: Vec3


class Air(NamedTuple):
    """Pressure Pa, its altitude m in the standard atmosphere, temperature degrees C."""

    pressure: float
    altitude: float
    temperature: float


class Place(NamedTuple):
    """Latitude and longitude in deg, height above sea level in m."""

    latitude: float
    longitude: float
    altitude: float


class Fix(NamedTuple):
    """A position, and the velocity m/s in NED."""

    place: Place
    velocity: Vec3


class Reading(NamedTuple):
    """What is sent for one step; GPS and truth only where they are due."""

    sensor: Fields
    gps: Fields | None
    truth: Fields | None


def normals(row: Row, first: int) -> Vec3:
    """Return three of the normals of a step from column ``first``."""
    return Vec3(float(row[first]), float(row[first + 1]), float(row[first + 2]))


def init(sensors: Sensors, row: Row) -> Memory:
    """Return the biases at step 0 from the normals of ``row``, which must not be used again."""
    return Memory(
        gyro=scale(sensors.gyro.turn_on, normals(row, GYRO_BIAS)),
        accelerometer=scale(sensors.accelerometer.turn_on, normals(row, ACCEL_BIAS)),
    )


def gauss_markov(value: Vec3, walk: float, time: float, dt: float, w: Vec3) -> Vec3:
    """Return a Gauss-Markov value ``dt`` s later, exactly: driven by density ``walk``, correlation time ``time`` s."""
    kept = math.exp(-dt / time)
    drive = walk * math.sqrt(0.5 * time * (1.0 - kept * kept))
    return add(scale(kept, value), scale(drive, w))


def white(density: float, dt: float, w: Vec3) -> Vec3:
    """Return white noise of ``density`` (unit per sqrt(Hz)) as a reading every ``dt`` s has it."""
    return scale(density / math.sqrt(dt), w)


def inertial(
    sensors: Sensors, memory: Memory, before: VehicleState, now: VehicleState, gravity: float, dt: float, row: Row
) -> tuple[Inertial, Memory]:
    """Return what gyro and accelerometer read at ``now``, ``dt`` s after ``before``; gravity in m/s^2."""
    gyro, accel = sensors.gyro, sensors.accelerometer
    gyro_bias = gauss_markov(memory.gyro, gyro.walk, gyro.time, dt, normals(row, GYRO_BIAS))
    force_bias = gauss_markov(memory.accelerometer, accel.walk, accel.time, dt, normals(row, ACCEL_BIAS))
    change = add(now.v_w, scale(-1.0, before.v_w))
    felt = rotate_inverse(middle(before.q_wb, now.q_wb), add(scale(1.0 / dt, change), Vec3(0.0, 0.0, gravity)))
    rate = add(now.omega_b, add(gyro_bias, white(gyro.density, dt, normals(row, GYRO))))
    force = add(felt, add(force_bias, white(accel.density, dt, normals(row, ACCEL))))
    kept = memory._replace(gyro=gyro_bias, accelerometer=force_bias)
    return Inertial(frames.body(rate), frames.body(force)), kept


def middle(a: Quat, b: Quat) -> Quat:
    """Return the attitude half way between two that are near each other, whatever their signs."""
    sign = math.copysign(1.0, a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w)
    x, y, z, w = (p + sign * q for p, q in zip(a, b, strict=True))
    length = math.sqrt(x * x + y * y + z * z + w * w)
    return Quat(x / length, y / length, z / length, w / length)


def compass(sensors: Sensors, memory: Memory, q_wb: Quat, dt: float, row: Row) -> tuple[Vec3, Memory]:
    """Return what a magnetometer reads in gauss, body FRD, ``dt`` s after its last reading."""
    own = sensors.magnetometer
    bias = gauss_markov(memory.magnetometer, own.walk, own.time, dt, normals(row, MAG_BIAS))
    field = rotate_inverse(q_wb, magnetic_field(sensors.home))
    noise = white(own.density, dt, normals(row, MAG))
    return frames.body(add(field, add(bias, noise))), memory._replace(magnetometer=bias)


def air(sensors: Sensors, height: float, time: float, row: Row) -> Air:
    """Return what a barometer reads at ``height`` m above home, ``time`` s after step 0."""
    altitude = sensors.home.altitude + height
    found = pressure(altitude) + sensors.barometer_drift * time + sensors.barometer_noise * float(row[BARO])
    return Air(found, pressure_altitude(found), temperature(altitude))


def fix(sensors: Sensors, memory: Memory, late: VehicleState, dt: float, row: Row) -> tuple[Fix, Memory]:
    """Return the fix of a receiver whose delay ago the motion was ``late``; ``dt`` s since the last one."""
    w = normals(row, GPS)
    level = gauss_markov(memory.gps, sensors.gps_walk, sensors.gps_walk_time, dt, w)
    upright = gauss_markov(memory.gps, sensors.gps_vertical_walk, sensors.gps_walk_time, dt, w)
    error = Vec3(level.x, level.y, upright.z)
    velocity = add(late.v_w, scale(sensors.gps_velocity_noise, normals(row, GPS_VELOCITY)))
    found = Fix(place(sensors.home, add(late.p_w, error)), frames.world(velocity))
    return found, memory._replace(gps=error)


def temperature(altitude: float) -> float:
    """Return the temperature of the standard atmosphere in degrees C at ``altitude`` m."""
    return SEA_LEVEL_TEMPERATURE - LAPSE * altitude - KELVIN


def pressure(altitude: float) -> float:
    """Return the pressure of the standard atmosphere in Pa at ``altitude`` m, below 11 km."""
    return SEA_LEVEL_PRESSURE * math.pow(1.0 - LAPSE * altitude / SEA_LEVEL_TEMPERATURE, EXPONENT)


def pressure_altitude(pascals: float) -> float:
    """Return the altitude in m at which the standard atmosphere has a pressure in Pa; inverse of ``pressure``."""
    return SEA_LEVEL_TEMPERATURE / LAPSE * (1.0 - math.pow(pascals / SEA_LEVEL_PRESSURE, 1.0 / EXPONENT))


def place(home: Home, p_w: Vec3) -> Place:
    """Return where ``p_w`` m (east, north, up of home) is."""
    latitude = math.radians(home.latitude)
    square = FLATTENING * (2.0 - FLATTENING)
    w = math.sqrt(1.0 - square * math.sin(latitude) ** 2)
    meridian, across = SEMI_MAJOR * (1.0 - square) / w**3, SEMI_MAJOR / w
    return Place(
        home.latitude + math.degrees(p_w.y / (meridian + home.altitude)),
        home.longitude + math.degrees(p_w.x / ((across + home.altitude) * math.cos(latitude))),
        home.altitude + p_w.z,
    )


def magnetic_field(home: Home) -> Vec3:
    """Return the magnetic field at home in gauss, world frame (ENU)."""
    declination, inclination = math.radians(home.field_declination), math.radians(home.field_inclination)
    along = home.field_strength * math.cos(inclination)
    return Vec3(
        along * math.sin(declination), along * math.cos(declination), -home.field_strength * math.sin(inclination)
    )


def sensor_fields(time_usec: int, inertial: Inertial, field: Vec3 | None, air: Air | None) -> Fields:
    """Return a HIL_SENSOR: us, m/s^2, rad/s, gauss (FRD), hPa, hPa, m, degrees C, marks.

    What has no new reading is 0 and not marked.
    """
    marks = INERTIAL | (MAGNETIC if field is not None else 0) | (BAROMETRIC if air is not None else 0)
    mag, still = field or Vec3(), air or Air(0.0, 0.0, 0.0)
    pressure = 0.01 * still.pressure
    return (time_usec, *inertial.force, *inertial.rate, *mag, pressure, 0.0, still.altitude, still.temperature, marks)


def gps_fields(time_usec: int, fix: Fix) -> Fields:
    """Return a HIL_GPS: us, fix, 1e-7 deg (2), mm, cm (2), cm/s, cm/s in NED (3), 0.01 deg, satellites."""
    north, east, down = fix.velocity
    speed = math.hypot(north, east)
    course = math.degrees(math.atan2(east, north)) % 360.0
    return (
        time_usec,
        FIX_3D,
        *_coordinates(fix.place),
        HORIZONTAL,
        VERTICAL,
        min(round(100.0 * speed), _SHORT),
        _short(100.0 * north),
        _short(100.0 * east),
        _short(100.0 * down),
        round(100.0 * course) % 36_000 if speed > _SLOWEST else UNKNOWN_COURSE,
        SATELLITES,
    )


def truth_fields(time_usec: int, state: VehicleState, place: Place, wind_w: Vec3, force: Vec3) -> Fields:
    """Return a HIL_STATE_QUATERNION; ``force`` is the specific force in m/s^2, FRD.

    us, FRD in NED (wxyz), rad/s (3), 1e-7 deg (2), mm, cm/s in NED (3), cm/s through the air (2), mG (3).
    """
    x, y, z, w = frames.attitude(state.q_wb)
    speed = min(round(100.0 * norm(subtract(state.v_w, wind_w))), 65_535)
    north, east, down = frames.world(state.v_w)
    return (
        time_usec,
        (w, x, y, z),
        *frames.body(state.omega_b),
        *_coordinates(place),
        _short(100.0 * north),
        _short(100.0 * east),
        _short(100.0 * down),
        speed,
        speed,
        *(_short(1000.0 * each / _GRAVITY) for each in force),
    )


def _coordinates(place: Place) -> tuple[int, int, int]:
    return round(1e7 * place.latitude), round(1e7 * place.longitude), round(1000.0 * place.altitude)


def _short(value: float) -> int:
    return round(clamp(value, -_SHORT, _SHORT))


class Suite:
    """Reads the sensors at every step of its own clock, which begins one period after 0 and never stands still.

    ``time_usec`` is the time of the last reading in us.
    """

    def __init__(self, sensors: Sensors, seed: int, plant_period: int, gravity: float) -> None:
        """Draw the first biases; ``plant_period`` in ns, a whole number of us, or ParameterError is raised."""
        if plant_period % _MICROSECOND:
            raise ParameterError(f"flight.plant_period: found {plant_period} ns, expected whole microseconds")
        self.time_usec = 0
        self._sensors, self._gravity = sensors, gravity
        self._period, self._dt = plant_period, seconds(1, plant_period)
        self._count = 0
        self._random = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(STREAM_FAMILY, 0)))
        self._memory = init(sensors, self._random.standard_normal(COLUMNS))
        late = round(1e9 * sensors.gps_delay / plant_period)
        self._past: deque[VehicleState] = deque(maxlen=late + 1)
        self._before: VehicleState | None = None

    def read(self, truth: VehicleState, wind_w: Vec3) -> Reading:
        """Return what the sensors read of ``truth``, one period after the last reading; ``wind_w`` in m/s."""
        sensors, dt = self._sensors, self._dt
        self._count += 1
        self.time_usec = self._count * self._period // _MICROSECOND
        row = self._random.standard_normal(COLUMNS)
        self._past.append(truth)
        before, self._before = self._before or truth, truth
        felt, self._memory = inertial(sensors, self._memory, before, truth, self._gravity, dt, row)
        field, reading, fixed, true = None, None, None, None
        if self._is_due(sensors.magnetometer_steps):
            since = dt * sensors.magnetometer_steps
            field, self._memory = compass(sensors, self._memory, truth.q_wb, since, row)
        if self._is_due(sensors.barometer_steps):
            reading = air(sensors, truth.p_w.z, seconds(self._count, self._period), row)
        if self._is_due(sensors.gps_steps):
            found, self._memory = fix(sensors, self._memory, self._past[0], dt * sensors.gps_steps, row)
            fixed = gps_fields(self.time_usec, found)
        if self._is_due(sensors.truth_steps):
            true = truth_fields(self.time_usec, truth, place(sensors.home, truth.p_w), wind_w, felt.force)
        return Reading(sensor_fields(self.time_usec, felt, field, reading), fixed, true)

    def _is_due(self, period_steps: int) -> bool:
        return self._count % period_steps == 0
