"""What an autopilot's sensors read of the true motion: pure functions of truth, memory and drawn normals.

::

    gyro     = omega + b + n       accelerometer = R^T (v' + g e_z) + b + n       magnetometer = R^T B + b + n
    b_k+1    = e^(-dt/T) b_k + N_b sqrt(T/2 (1 - e^(-2 dt/T))) w          bias: first-order Gauss-Markov
    n        = N / sqrt(dt) w                                             white noise of density N

The accelerometer reads the mean specific force since its last reading, so that any plant will do: what it feels is the
change of its velocity. Sensors sit in the centre of gravity; there is no vibration, no quantisation, no range limit.
Defaults are those of RotorS (Furrer et al. 2016: twice the ADIS16448's data sheet) for the inertial sensors, of PX4's
Gazebo model for the magnetometer, of the MS5611's data sheet for the barometer; the GPS error is the model of Beard
and McLain (2012, section 7.5). Discretisation: Woodman, "An introduction to inertial navigation" (2007), and exact for
a Gauss-Markov process. Readings are in body FRD and world NED, as autopilots have them.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_autopilot import frames
from quad_core.geometry import add, rotate_inverse, scale
from quad_core.types import Quat, Vec3, VehicleState
from quad_mavlink.hil import earth
from quad_mavlink.hil.parameters import BarometerParameters, GpsParameters, HomeParameters, JoinedPlantParameters

STREAM_FAMILY = 4
BLOCK = 4096
"""Steps whose normals are drawn together."""
GYRO, GYRO_BIAS, ACCEL, ACCEL_BIAS, MAG, MAG_BIAS, GPS, GPS_VELOCITY = range(0, 24, 3)
BARO, COLUMNS = 24, 25


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


class Fix(NamedTuple):
    """A position, and the velocity m/s in NED."""

    place: earth.Place
    velocity: Vec3


def draw(seed: int, block: int) -> NDArray[np.float64]:
    """Return the standard normals of ``BLOCK`` steps, shape (4096, 25); blocks of a flight are independent."""
    sequence = np.random.SeedSequence(seed, spawn_key=(STREAM_FAMILY, block))
    return np.random.default_rng(sequence).standard_normal((BLOCK, COLUMNS))


def normals(row: NDArray[np.float64], first: int) -> Vec3:
    """Return three standard normals of a row of ``draw`` from column ``first``."""
    return Vec3(float(row[first]), float(row[first + 1]), float(row[first + 2]))


def init(parameters: JoinedPlantParameters, row: NDArray[np.float64]) -> Memory:
    """Return the biases at step 0; ``row`` of ``draw`` must not be used again."""
    return Memory(
        gyro=scale(parameters.gyro.turn_on, normals(row, GYRO_BIAS)),
        accelerometer=scale(parameters.accelerometer.turn_on, normals(row, ACCEL_BIAS)),
    )


def wander(value: Vec3, walk: float, time: float, dt: float, w: Vec3) -> Vec3:
    """Return a Gauss-Markov value ``dt`` s later, exactly: driven by density ``walk``, correlation time ``time`` s."""
    kept = math.exp(-dt / time)
    drive = walk * math.sqrt(0.5 * time * (1.0 - kept * kept))
    return add(scale(kept, value), scale(drive, w))


def white(density: float, dt: float, w: Vec3) -> Vec3:
    """Return white noise of ``density`` (unit per sqrt(Hz)) as a reading every ``dt`` s has it."""
    return scale(density / math.sqrt(dt), w)


def inertial(
    parameters: JoinedPlantParameters,
    memory: Memory,
    before: VehicleState,
    now: VehicleState,
    gravity: float,
    dt: float,
    row: NDArray[np.float64],
) -> tuple[Inertial, Memory]:
    """Return what gyro and accelerometer read at ``now``, ``dt`` s after ``before``; gravity in m/s^2."""
    gyro, accelerometer = parameters.gyro, parameters.accelerometer
    gyro_bias = wander(memory.gyro, gyro.bias_walk, gyro.bias_time, dt, normals(row, GYRO_BIAS))
    force_bias = wander(
        memory.accelerometer, accelerometer.bias_walk, accelerometer.bias_time, dt, normals(row, ACCEL_BIAS)
    )
    change = add(now.v_w, scale(-1.0, before.v_w))
    felt = rotate_inverse(middle(before.q_wb, now.q_wb), add(scale(1.0 / dt, change), Vec3(0.0, 0.0, gravity)))
    rate = add(now.omega_b, add(gyro_bias, white(gyro.noise_density, dt, normals(row, GYRO))))
    force = add(felt, add(force_bias, white(accelerometer.noise_density, dt, normals(row, ACCEL))))
    kept = memory._replace(gyro=gyro_bias, accelerometer=force_bias)
    return Inertial(frames.body(rate), frames.body(force)), kept


def middle(a: Quat, b: Quat) -> Quat:
    """Return the attitude half way between two that are near each other, whatever their signs."""
    sign = math.copysign(1.0, a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w)
    x, y, z, w = (p + sign * q for p, q in zip(a, b, strict=True))
    length = math.sqrt(x * x + y * y + z * z + w * w)
    return Quat(x / length, y / length, z / length, w / length)


def compass(
    parameters: JoinedPlantParameters, memory: Memory, q_wb: Quat, dt: float, row: NDArray[np.float64]
) -> tuple[Vec3, Memory]:
    """Return what a magnetometer reads in gauss, body FRD, ``dt`` s after its last reading."""
    own = parameters.magnetometer
    bias = wander(memory.magnetometer, own.bias_walk, own.bias_time, dt, normals(row, MAG_BIAS))
    field = rotate_inverse(q_wb, earth.magnetic_field(parameters.home))
    noise = white(own.noise_density, dt, normals(row, MAG))
    return frames.body(add(field, add(bias, noise))), memory._replace(magnetometer=bias)


def air(
    parameters: BarometerParameters, home: HomeParameters, height: float, time: float, row: NDArray[np.float64]
) -> Air:
    """Return what a barometer reads at ``height`` m above home, ``time`` s after step 0."""
    altitude = home.altitude + height
    pressure = earth.pressure(altitude) + parameters.drift * time + parameters.noise * float(row[BARO])
    return Air(pressure, earth.pressure_altitude(pressure), earth.temperature(altitude))


def fix(
    parameters: GpsParameters,
    home: HomeParameters,
    memory: Memory,
    late: VehicleState,
    dt: float,
    row: NDArray[np.float64],
) -> tuple[Fix, Memory]:
    """Return the fix of a receiver whose delay ago the motion was ``late``; ``dt`` s since the last one."""
    w = normals(row, GPS)
    level = wander(memory.gps, parameters.walk, parameters.walk_time, dt, w)
    upright = wander(memory.gps, parameters.vertical_walk, parameters.walk_time, dt, w)
    error = Vec3(level.x, level.y, upright.z)
    velocity = add(late.v_w, scale(parameters.velocity_noise, normals(row, GPS_VELOCITY)))
    found = Fix(earth.place(home, add(late.p_w, error)), frames.world(velocity))
    return found, memory._replace(gps=error)
