"""Where markers are drawn, against SciPy's rotations."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from quad_core.types import Quat, Vec3
from quad_flight_log.live.shapes import ARROW, STRIP, Snapshot, Trail, shapes
from quad_flight_log.report.vehicle_drawing import ARM, DISTURBANCE_SCALE, THRUST_SCALE

PLACE = np.array([1.0, -2.0, 3.0])


def seen(snapshot, flown=(), planned=()):
    trails = Trail(100), Trail(100)
    for trail, points in zip(trails, (flown, planned), strict=True):
        for point in points:
            trail.add(Vec3(*point))
    return {shape.name: shape for shape in shapes(snapshot, *trails)}


@pytest.mark.parametrize("seed", range(4))
def test_body_and_thrust_turn_with_the_attitude(seed):
    turn = Rotation.random(rng=np.random.default_rng(seed))
    snapshot = Snapshot(0, Vec3(*PLACE), Quat(*turn.as_quat()), thrust=5.0)
    found = seen(snapshot)
    front = PLACE + turn.apply([ARM, 0.0, 0.0])
    left = PLACE + turn.apply([0.0, ARM, 0.0])
    np.testing.assert_allclose(found["rotors"].points[2], front, atol=1e-12)
    np.testing.assert_allclose(found["rotors"].points[3], left, atol=1e-12)
    start, tip = found["thrust"].points
    np.testing.assert_allclose(start, PLACE, atol=0)
    np.testing.assert_allclose(tip, PLACE + turn.apply([0.0, 0.0, 5.0 * THRUST_SCALE]), atol=1e-12)
    assert found["thrust"].kind == ARROW


def test_disturbance_stays_in_the_world():
    turned = Quat(0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5))
    found = seen(Snapshot(0, Vec3(*PLACE), turned, force=Vec3(0.5, 0.0, -0.25)))
    expected = PLACE + DISTURBANCE_SCALE * np.array([0.5, 0.0, -0.25])
    np.testing.assert_allclose(found["disturbance"].points[1], expected, atol=1e-12)


def test_only_what_is_known_is_drawn():
    found = seen(Snapshot(0, Vec3(), Quat()))
    assert set(found) == {"vehicle", "rotors", "forward"}
    found = seen(Snapshot(0, Vec3(), Quat(), reference=Vec3(1.0, 2.0, 3.0)), flown=[(0, 0, 0), (1, 0, 0)])
    assert set(found) == {"vehicle", "rotors", "forward", "reference", "flown"}
    assert found["reference"].points == ((1.0, 2.0, 3.0),)
    assert found["flown"].kind == STRIP


def test_a_trail_forgets_its_oldest_points_and_skips_near_ones():
    trail = Trail(3, spacing=0.1)
    for x in (0.0, 0.05, 0.2, 0.29, 0.4, 0.6):
        trail.add(Vec3(x, 0.0, 0.0))
    assert [point[0] for point in trail.points] == [0.2, 0.4, 0.6]
