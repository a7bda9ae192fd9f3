"""Air, ellipsoid and magnetic field: what a barometer, a GPS receiver and a compass measure.

::

    T = T0 - L h        p = p0 (T / T0)^(g0 / (R L))                            ISA, troposphere (ISO 2533)
    M = a (1 - e2) / W^3    N = a / W    W = sqrt(1 - e2 sin^2(latitude))       radii of WGS 84 (NIMA TR8350.2)
    B = |B| (cos I sin D, cos I cos D, -sin I)                                  east, north, up

The world is the tangent plane at home: over 1 km its height differs from the ellipsoid's by 8 cm, which is left out.
"""

import math
from typing import NamedTuple

from quad_core.types import Vec3
from quad_mavlink.hil.parameters import HomeParameters

SEA_LEVEL_PRESSURE, SEA_LEVEL_TEMPERATURE = 101_325.0, 288.15
"""Pa, K."""
LAPSE = 0.0065
"""K/m."""
EXPONENT = 9.80665 / (287.05287 * LAPSE)
"""g0 / (R L)."""
KELVIN = 273.15
SEMI_MAJOR, FLATTENING = 6_378_137.0, 1.0 / 298.257223563


class Place(NamedTuple):
    """Latitude and longitude in deg, height above sea level in m."""

    latitude: float
    longitude: float
    altitude: float


def temperature(altitude: float) -> float:
    """Return the temperature of the standard atmosphere in degrees C at ``altitude`` m."""
    return SEA_LEVEL_TEMPERATURE - LAPSE * altitude - KELVIN


def pressure(altitude: float) -> float:
    """Return the pressure of the standard atmosphere in Pa at ``altitude`` m, below 11 km."""
    return SEA_LEVEL_PRESSURE * math.pow(1.0 - LAPSE * altitude / SEA_LEVEL_TEMPERATURE, EXPONENT)


def pressure_altitude(pascals: float) -> float:
    """Return the altitude in m at which the standard atmosphere has a pressure in Pa; inverse of ``pressure``."""
    return SEA_LEVEL_TEMPERATURE / LAPSE * (1.0 - math.pow(pascals / SEA_LEVEL_PRESSURE, 1.0 / EXPONENT))


def place(home: HomeParameters, p_w: Vec3) -> Place:
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


def magnetic_field(home: HomeParameters) -> Vec3:
    """Return the magnetic field at home in gauss, world frame (ENU)."""
    declination, inclination = math.radians(home.field_declination), math.radians(home.field_inclination)
    along = home.field_strength * math.cos(inclination)
    return Vec3(
        along * math.sin(declination), along * math.cos(declination), -home.field_strength * math.sin(inclination)
    )
