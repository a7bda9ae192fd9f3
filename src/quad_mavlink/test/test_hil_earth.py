"""Air, ellipsoid and field against published tables and against geometry in three dimensions."""

import numpy as np
import pytest

from quad_core.types import Vec3
from quad_mavlink.hil import earth
from quad_mavlink.hil.parameters import HomeParameters

# ISO 2533: geopotential height m, pressure Pa, temperature degrees C
STANDARD = [(0.0, 101325.0, 15.0), (500.0, 95460.8, 11.75), (1000.0, 89874.6, 8.5), (5000.0, 54019.9, -17.5)]


@pytest.mark.parametrize(("height", "pascals", "celsius"), STANDARD)
def test_the_air_is_that_of_the_standard(height, pascals, celsius):
    assert earth.pressure(height) == pytest.approx(pascals, rel=1e-5)
    assert earth.temperature(height) == pytest.approx(celsius, abs=1e-6)
    assert earth.pressure_altitude(pascals) == pytest.approx(height, abs=0.1)


def ecef(latitude, longitude, altitude):
    a, b = 6378137.0, 6356752.314245  # WGS 84
    phi, lam = np.radians([latitude, longitude])
    n = a * a / np.hypot(a * np.cos(phi), b * np.sin(phi))
    across = (n + altitude) * np.cos(phi)
    return np.array([across * np.cos(lam), across * np.sin(lam), (b * b / (a * a) * n + altitude) * np.sin(phi)])


@pytest.mark.parametrize("home", [(47.397742, 8.545594, 488.0), (-33.9, 151.2, 20.0), (0.0, 0.0, 0.0)])
@pytest.mark.parametrize("point", [(100.0, 0.0, 0.0), (0.0, 100.0, 0.0), (-30.0, 70.0, 12.0)])
def test_a_place_is_as_far_east_north_and_up_as_it_says(home, point):
    found = earth.place(HomeParameters(*home), Vec3(*point))
    phi, lam = np.radians(home[:2])
    east = np.array([-np.sin(lam), np.cos(lam), 0.0])
    up = np.array([np.cos(phi) * np.cos(lam), np.cos(phi) * np.sin(lam), np.sin(phi)])
    north = np.cross(up, east)
    moved = ecef(*found) - ecef(*home)
    assert [moved @ axis for axis in (east, north, up)] == pytest.approx(point, abs=5e-3)


def test_the_field_points_north_and_into_the_ground_in_europe():
    home = HomeParameters(field_strength=0.5, field_declination=90.0, field_inclination=0.0)
    assert earth.magnetic_field(home) == pytest.approx((0.5, 0.0, 0.0), abs=1e-12)  # east
    home = HomeParameters(field_strength=0.5, field_declination=0.0, field_inclination=60.0)
    assert earth.magnetic_field(home) == pytest.approx((0.0, 0.25, -0.5 * np.sqrt(0.75)), abs=1e-12)
