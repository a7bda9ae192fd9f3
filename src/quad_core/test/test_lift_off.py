"""On the ground a law lifts the vehicle straight up and remembers nothing; clear of it, it flies as ever."""

import math

import pytest

from quad_core import plugins
from quad_core.cascade import ATTITUDE, POSITION, STAGE
from quad_core.geometry import ZERO, euler_from_quaternion, norm, quaternion_from_euler
from quad_core.lift_off import Standing, airborne, lifted_off, sinks, standing, with_lift_off
from quad_core.plugins import law_of
from quad_core.resolution import resolve
from quad_core.types import (
    Actuation,
    AttitudeInputs,
    AttitudeThrust,
    PositionInputs,
    TrajectoryPoint,
    Vec3,
    VehicleState,
)
from quad_core.vehicle import Vehicle

LAWS = {role: plugins.names(STAGE[role].group) for role in (POSITION, ATTITUDE)}
PAIRS = [(role, name) for role, names in LAWS.items() for name in names]
DT = {POSITION: 0.01, ATTITUDE: 0.002}
YAW = 0.7
STATE = VehicleState(
    Vec3(4.0, -3.0, 13.0), Vec3(0.3, -0.2, 0.0), quaternion_from_euler(Vec3(0.02, -0.03, YAW)), Vec3(0.01, 0.0, 0.02)
)


def inputs_of(role, state, height=13.4):
    reference = TrajectoryPoint(p_w=Vec3(0.0, 0.0, height), a_w=Vec3(2.0, 1.0, 0.0), yaw=0.1, yaw_rate=0.5)
    tilted = AttitudeThrust(angles=Vec3(0.5, -0.4, 0.1), q_wb=quaternion_from_euler(Vec3(0.5, -0.4, 0.1)), thrust=6.0)
    if role == POSITION:
        return PositionInputs(state, reference, Actuation())
    return AttitudeInputs(state, tilted, Actuation())


def law(role, name):
    return resolve(role, {"law": name}).law


def steps(role, name, state, count=200):
    """Return the outputs of ``count`` steps with ``state``, and the memories before and after them."""
    own = law(role, name)
    memory = first = own.module.init(own.parameters, Vehicle())
    outputs = []
    for _ in range(count):
        output, memory, _ = own.module.step(own.parameters, Vehicle(), memory, inputs_of(role, state), DT[role])
        outputs.append(output)
    return outputs, first, memory


@pytest.mark.parametrize(("role", "name"), PAIRS)
def test_on_the_ground_every_law_gives_the_same_for_ever_and_learns_nothing(role, name):
    outputs, first, memory = steps(role, name, STATE._replace(on_ground=True, ground_z=13.0))
    assert len(set(outputs)) == 1
    assert getattr(memory, "law", memory) == getattr(first, "law", first)


@pytest.mark.parametrize("name", LAWS[POSITION])
def test_a_position_law_on_the_ground_asks_for_no_tilt_and_for_lift(name):
    (setpoint, *_), _, _ = steps(POSITION, name, STATE._replace(on_ground=True, ground_z=13.0))
    # a vehicle that drifts over its reference at 0.4 m/s has some air drag: a tenth of a degree is level
    assert math.hypot(setpoint.angles.x, setpoint.angles.y) < math.radians(0.5)
    assert euler_from_quaternion(setpoint.q_wb).z == pytest.approx(YAW, abs=0.02)
    assert setpoint.thrust > Vehicle().mass * Vehicle().gravity


@pytest.mark.parametrize("name", LAWS[ATTITUDE])
def test_a_vehicle_on_its_way_up_stays_level_under_a_steady_torque(name):
    """2 rad/s^2 from outside lean it by 2 / 8^2 rad, 1.8 deg: also under a law whose integral holds the angle."""
    vehicle, roll, rate = Vehicle(), 0.0, 0.0
    own = law(ATTITUDE, name)
    memory = own.module.init(own.parameters, vehicle)
    for _ in range(1000):
        angles = Vec3(roll, 0.0, YAW)
        state = STATE._replace(q_wb=quaternion_from_euler(angles), omega_b=Vec3(rate, 0.0, 0.0), on_ground=True)
        wrench, memory, _ = own.module.step(own.parameters, vehicle, memory, inputs_of(ATTITUDE, state), DT[ATTITUDE])
        rate += DT[ATTITUDE] * (2.0 + wrench.torque_b.x / vehicle.inertia_xx)
        roll += DT[ATTITUDE] * rate
    assert math.degrees(roll) == pytest.approx(1.79, abs=0.02)


@pytest.mark.parametrize(("role", "name"), PAIRS)
def test_in_the_air_it_is_the_law_to_the_bit(role, name):
    own, bare = law(role, name), resolve(role, {"law": name}).plugins["law"]
    memory, plain = own.module.init(own.parameters, Vehicle()), bare.module.init(bare.parameters, Vehicle())
    for _ in range(50):
        given = inputs_of(role, STATE)
        output, memory, internals = own.module.step(own.parameters, Vehicle(), memory, given, DT[role])
        expected, plain, shown = bare.module.step(bare.parameters, Vehicle(), plain, given, DT[role])
        assert (output, internals) == (expected, shown)
    assert getattr(memory, "law", memory) == plain


def test_what_the_vehicle_was_carried_aside_is_taken_back_by_and_by():
    own = law(POSITION, "pid")
    memory = own.module.init(own.parameters, Vehicle())
    tilts = []
    for k in range(1000):
        state = STATE._replace(v_w=Vec3(), on_ground=k == 0)
        beside = TrajectoryPoint(p_w=Vec3(4.3, -3.4, 13.0), yaw=YAW)
        given = inputs_of(POSITION, state)._replace(reference=beside)
        setpoint, memory, internals = own.module.step(own.parameters, Vehicle(), memory, given, 0.01)
        tilts.append(math.hypot(setpoint.angles.x, setpoint.angles.y))
        if k == 1:
            assert norm(internals.position_error) < 0.01
    assert memory.distance == pytest.approx(Vec3(0.0, 0.0, 0.0), abs=2e-3)
    assert not memory.returns
    assert norm(internals.position_error) == pytest.approx(0.5, abs=0.01)
    assert tilts[0] < tilts[50] < tilts[200]


def test_a_stage_without_place_or_attitude_only_forgets():
    own = resolve(ATTITUDE, {}).plugins["law"]
    module = with_lift_off(law_of(own.module), tuple)
    first = own.module.init(own.parameters, Vehicle())
    for on_ground in (True, False):
        given = inputs_of(ATTITUDE, STATE._replace(on_ground=on_ground))
        output, memory, _ = module.step(own.parameters, Vehicle(), first, given, 0.002)
        assert output == own.module.step(own.parameters, Vehicle(), first, given, 0.002)[0]
        assert (memory == first) == on_ground
    assert STAGE[ATTITUDE].inputs_type is AttitudeInputs


def risen(offset, heights, drift=0.0, tells=True):
    """Return (ground_z - offset, on_ground) of states 0.1 s apart; armed from the third on."""
    lift, seen, before = standing(0.0), [], heights[0]
    for k, height in enumerate(heights):
        speed = 10.0 * (height - before) if tells else 0.0
        state = VehicleState(Vec3(0.0, 0.0, offset + height + 0.1 * k * drift), Vec3(0.0, 0.0, speed))
        lift, before = lifted_off(lift, state, k > 1, 0.1), height
        seen.append((round(lift.ground_z - offset, 9), lift.on_ground))
    return seen


@pytest.mark.parametrize("offset", [-20.0, 0.0, 13.2])
def test_the_ground_is_where_the_estimate_has_it_at_arming(offset):
    # armed at 0.3 m: 1.0 m is 0.7 m above it and not more, and once clear it stays so
    seen = risen(offset, [0.0, 0.3, 0.4, 0.99, 1.01, 0.2])
    assert seen == [(0.0, True), (0.3, True), (0.3, True), (0.3, True), (0.3, False), (0.3, False)]


def test_a_position_that_drifts_up_is_not_taken_for_a_climb():
    heights = [0.0, 0.0, *(0.06 * k for k in range(16))]
    assert [on for _, on in risen(0.0, heights, drift=0.4)].index(False) == 2 + 12  # at 0.72 m


def test_who_hovers_low_flies_after_two_seconds():
    seen = risen(0.0, [0.0, 0.0, 0.1, 0.2, *[0.4] * 30])
    assert [on for _, on in seen].index(False) == pytest.approx(3 + 20, abs=1)


def test_an_estimate_without_velocity_flies_from_twice_the_height_on():
    seen = risen(0.0, [0.0, 0.0, 0.5, 1.0, 1.39, 1.41], tells=False)
    assert [on for _, on in seen] == [True, True, True, True, True, False]


def test_an_estimate_whose_z_points_down_sinks_at_lift_off():
    falling = VehicleState(Vec3(0.0, 0.0, 1.89), Vec3(0.0, 0.0, -0.6), STATE.q_wb, Vec3())
    assert sinks(standing(2.0), falling)
    assert not sinks(airborne(2.0), falling)
    assert not sinks(standing(2.0), falling._replace(p_w=Vec3(0.0, 0.0, 1.91)))
    assert not sinks(standing(2.0), falling._replace(v_w=Vec3(0.0, 0.0, -0.4)))  # a drift that passes for rest


def seen_for(seconds, moved=ZERO, shown=ZERO, rate=100):
    """Return what ``seconds`` of an estimate show that moves at ``moved`` m/s and tells ``shown`` m/s."""
    found = Standing()
    for k in range(round(seconds * rate) + 1):
        time = k / rate
        place = Vec3(-17.0 + moved.x * time, 4.0 + moved.y * time, 13.2 + moved.z * time)
        found.note(100.0 + time, VehicleState(place, shown))
    return found


def test_one_that_rests_anywhere_or_drifts_slowly_may_fly():
    slow = Vec3(0.0, 0.0, -0.07)
    assert seen_for(2.0).refusal(0.15, "odom") == seen_for(2.0, slow, slow).refusal(0.15, "odom") == ""


@pytest.mark.parametrize(("moved", "shown"), [(Vec3(0.0, 0.0, -0.2), Vec3()), (Vec3(), Vec3(0.0, 0.2, 0.0))])
def test_a_drift_is_refused_by_name_whether_or_not_the_velocity_tells_it(moved, shown):
    text = seen_for(2.0, moved, shown).refusal(0.15, "vehicle_odometry")
    assert text.startswith("vehicle_odometry: the estimate moves while the vehicle stands: found")
    assert "0.20 m/s" in text
    assert text.endswith("expected less than 0.15 m/s")


def test_only_the_last_second_counts():
    found = seen_for(2.0, Vec3(1.0, 0.0, 0.0), Vec3(1.0, 0.0, 0.0))
    for k in range(1, 121):
        found.note(102.0 + k / 100, VehicleState(Vec3(-15.0, 4.0, 13.2)))
    assert found.refusal(0.15, "odom") == ""


def test_too_little_is_no_rest():
    assert Standing().refusal(0.15, "odom") == "odom: found states over 0.0 s, expected 0.5 s of them at rest"
    assert "0.3 s" in seen_for(0.3).refusal(0.15, "odom")
