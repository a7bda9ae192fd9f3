"""The numbers of HIL_SENSOR, HIL_GPS and HIL_STATE_QUATERNION in the order and units in which MAVLink has them."""

import math
from typing import Any

from quad_autopilot import frames
from quad_core.geometry import clamp, norm
from quad_core.types import Vec3, VehicleState
from quad_mavlink.hil.earth import Place
from quad_mavlink.hil.sensors import Air, Fix, Inertial

INERTIAL, MAGNETIC, BAROMETRIC = 0b111111, 0b111 << 6, 1 << 9 | 1 << 11 | 1 << 12
"""HIL_SENSOR_UPDATED_FLAGS; bit 10, differential pressure, is never set: there is no air speed sensor."""
FIX_3D, SATELLITES = 3, 12
HORIZONTAL, VERTICAL = 90, 180
"""What the receiver says of its accuracy in cm: that of a good fix, for autopilots refuse to fly without one."""
UNKNOWN_COURSE = 65_535
_SLOWEST = 0.5
_SHORT = 32_767
_GRAVITY = 9.80665

Fields = tuple[Any, ...]


def sensor(time_usec: int, inertial: Inertial, field: Vec3 | None, air: Air | None) -> Fields:
    """Return a HIL_SENSOR: us, m/s^2, rad/s, gauss (FRD), hPa, hPa, m, degrees C, marks.

    What has no new reading is 0 and not marked.
    """
    marks = INERTIAL | (MAGNETIC if field is not None else 0) | (BAROMETRIC if air is not None else 0)
    mag, still = field or Vec3(), air or Air(0.0, 0.0, 0.0)
    pressure = 0.01 * still.pressure
    return (time_usec, *inertial.force, *inertial.rate, *mag, pressure, 0.0, still.altitude, still.temperature, marks)


def gps(time_usec: int, fix: Fix) -> Fields:
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


def truth(time_usec: int, state: VehicleState, place: Place, wind_w: Vec3, force: Vec3) -> Fields:
    """Return a HIL_STATE_QUATERNION; ``force`` is the specific force in m/s^2, FRD.

    us, FRD in NED (wxyz), rad/s (3), 1e-7 deg (2), mm, cm/s in NED (3), cm/s through the air (2), mG (3).
    """
    x, y, z, w = frames.attitude(state.q_wb)
    through_air = Vec3(state.v_w.x - wind_w.x, state.v_w.y - wind_w.y, state.v_w.z - wind_w.z)
    speed = min(round(100.0 * norm(through_air)), 65_535)
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
