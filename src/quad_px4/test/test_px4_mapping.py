"""What PX4 allocates for our setpoints is the wrench that was asked for; of each planted mistake it is not."""

import math

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st
from px4_oracle import BODY, allocated, made

from quad_core.parameters import ParameterError
from quad_core.types import Vec3, Wrench
from quad_px4 import mapping
from quad_px4.parameters import AirframeParameters, RotorPlace

TM, LX, LY, KQ = 5.0, 0.14, 0.14, 0.05
S = math.sqrt(0.5)


def airframe(**changes):
    return AirframeParameters(
        max_rotor_thrust=TM,
        rotor0=RotorPlace(LX, LY, KQ),
        rotor1=RotorPlace(-LX, -LY, KQ),
        rotor2=RotorPlace(LX, -LY, -KQ),
        rotor3=RotorPlace(-LX, LY, -KQ),
    )._replace(**changes)


def rotors_of(frame):
    return [tuple(rotor) for rotor in (frame.rotor0, frame.rotor1, frame.rotor2, frame.rotor3)]


def hovering(rotors):
    """Return the share of the thrust that each rotor has where no torque is made."""
    rows = [[-y for _, y, _ in rotors], [x for x, _, _ in rotors], [math.copysign(1.0, km) for *_, km in rotors]]
    return np.linalg.solve([*rows, [1.0] * 4], [0.0, 0.0, 0.0, 1.0])


def flown(frame, setpoint):
    """Return FLU torque and thrust that PX4 makes of a setpoint."""
    commands = allocated(rotors_of(frame), np.array(setpoint.torque), np.array(setpoint.thrust))
    return made(rotors_of(frame), commands, frame.max_rotor_thrust, frame.drag_ratio or None)


thrusts = st.floats(2.0, 18.0)
tilting = st.floats(-0.3, 0.3)
turning = st.floats(-0.1, 0.1)
wrenches = st.builds(lambda t, x, y, z: Wrench(t, Vec3(x, y, z)), thrusts, tilting, tilting, turning)


@given(wrenches)
def test_the_setpoint_is_that_of_the_closed_form_for_a_symmetric_x(wrench):
    found = mapping.thrust_torque(mapping.build(airframe()), wrench)
    x, y, z = wrench.torque_b
    assert found.thrust == pytest.approx((0.0, 0.0, -wrench.thrust / (4 * TM)))
    assert found.torque == pytest.approx((x / (4 * LY * TM * S), -y / (4 * LX * TM * S), -z / (4 * KQ * TM)), abs=1e-12)


arms = st.floats(0.05, 0.5)


@given(wrenches, st.lists(arms, min_size=8, max_size=8), st.floats(0.01, 0.1))
def test_arms_may_differ_and_the_true_drag_ratio_too(wrench, lengths, drag_ratio):
    frame = airframe(
        drag_ratio=drag_ratio,
        rotor0=RotorPlace(lengths[0], lengths[1], KQ),
        rotor1=RotorPlace(-lengths[2], -lengths[3], KQ),
        rotor2=RotorPlace(lengths[4], -lengths[5], -KQ),
        rotor3=RotorPlace(-lengths[6], lengths[7], -KQ),
    )
    assume(min(hovering(rotors_of(frame))) > 1e-3)
    setpoint = mapping.thrust_torque(mapping.build(frame), wrench)
    assume(max(abs(part) for part in setpoint.torque) < 1.0 and setpoint.thrust.z > -1.0)
    assume(setpoint.thrust.z < 0.0)
    torque, thrust = flown(frame, setpoint)
    assert thrust == pytest.approx(wrench.thrust, rel=1e-6)
    assert torque == pytest.approx(np.array(wrench.torque_b), abs=1e-6)


MISTAKES = {
    "y and z swapped": lambda sp, w: sp._replace(torque=Vec3(sp.torque.x, sp.torque.z, sp.torque.y)),
    "N instead of normalised": lambda sp, w: sp._replace(thrust=Vec3(0.0, 0.0, -w.thrust)),
    "N m instead of normalised": lambda sp, w: sp._replace(torque=Vec3(*(BODY @ w.torque_b))),
    "s left out": lambda sp, w: sp._replace(torque=Vec3(S * sp.torque.x, S * sp.torque.y, sp.torque.z)),
    "yaw sign": lambda sp, w: sp._replace(torque=Vec3(sp.torque.x, sp.torque.y, -sp.torque.z)),
    "FLU torque sent as FRD": lambda sp, w: sp._replace(torque=Vec3(*(BODY @ sp.torque))),
    "thrust up": lambda sp, w: sp._replace(thrust=Vec3(0.0, 0.0, -sp.thrust.z)),
}


@pytest.mark.parametrize("mistake", MISTAKES.values(), ids=MISTAKES)
def test_each_planted_mistake_is_seen(mistake):
    wrench = Wrench(9.8, Vec3(0.11, -0.09, 0.03))
    right = mapping.thrust_torque(mapping.build(airframe()), wrench)
    torque, thrust = flown(airframe(), mistake(right, wrench))
    worst = max(abs(thrust - wrench.thrust) / wrench.thrust, *(abs(torque - wrench.torque_b) / np.abs(wrench.torque_b)))
    assert worst > 0.2


@given(wrenches)
def test_motors_make_the_same_wrench_and_the_rest_is_off(wrench):
    controls = mapping.motors(mapping.build(airframe()), wrench)
    assert len(controls) == 12
    assert all(math.isnan(control) for control in controls[4:])
    assert all(0.0 <= control <= 1.0 for control in controls[:4])
    assume(all(0.0 < share < 1.0 for share in shares(wrench.thrust, *wrench.torque_b)))
    torque, thrust = made(rotors_of(airframe()), controls[:4], TM)
    assert thrust == pytest.approx(wrench.thrust)
    assert torque == pytest.approx(np.array(wrench.torque_b), abs=1e-9)


beyond = st.builds(
    lambda t, x, y, z: Wrench(t, Vec3(x, y, z)), st.floats(0, 30), st.floats(-3, 3), st.floats(-3, 3), st.floats(-2, 2)
)


@example(Wrench(20.0, Vec3(0.0, 0.10261252282414857, 0.0)))  # a rotor at its most but for rounding, and no yaw
@given(beyond)
def test_yaw_gives_way_first_and_roll_and_pitch_last(wrench):
    found = mapping.allocated(mapping.build(airframe()), wrench)
    assert all(0.0 <= share <= 1.0 for share in found)
    assume(not all(0.0 <= share <= 1.0 for share in shares(wrench.thrust, *wrench.torque_b)))
    (x, y, z), thrust = made(rotors_of(airframe()), found, TM)
    asked = wrench.torque_b
    whole = 1e-6 + 1e-6 * abs(asked.x) + 1e-6 * abs(asked.y)
    # what is left of each has its direction
    assert x * asked.y == pytest.approx(y * asked.x, abs=1e-6)
    assert -1e-9 <= z * asked.z <= asked.z * asked.z + 1e-9
    assert thrust <= wrench.thrust + 1e-6
    cut = math.hypot(x - asked.x, y - asked.y) > whole
    if cut or thrust < wrench.thrust - 1e-6:
        # some rotor stands at an end, for tilting alone
        tilting = [t + u for t, u in zip(shares(0.0, x, y, 0.0), shares(thrust, 0.0, 0.0, 0.0), strict=True)]
        assert min(*tilting, *(1.0 - share for share in tilting)) == pytest.approx(0.0, abs=1e-6)
    if abs(z - asked.z) > 1e-6:
        assert min(*found, *(1.0 - share for share in found)) == pytest.approx(0.0, abs=1e-6)


def shares(thrust, x, y, z):
    """Rotor commands of a symmetric X for FLU torque, by hand."""
    signs = [(-1, -1, -1), (1, 1, -1), (1, -1, 1), (-1, 1, 1)]  # front right, rear left, front left, rear right
    return [(thrust + r * x / LY + p * y / LX + t * z / KQ) / (4 * TM) for r, p, t in signs]


def test_a_yaw_that_the_rotors_cannot_give_takes_no_roll_nor_pitch():
    wrench = Wrench(9.8, Vec3(0.3, -0.2, 1.5))
    torque, thrust = made(rotors_of(airframe()), mapping.allocated(mapping.build(airframe()), wrench), TM)
    assert (*torque[:2], thrust) == pytest.approx((0.3, -0.2, 9.8))
    assert 0.0 < torque[2] < 1.5
    assert mapping.predict(mapping.build(airframe()), wrench).yaw_limited


def px4_signal(command, factor):
    """What PX4 makes of a command: the root of factor u^2 + (1 - factor) u = command."""
    return command if factor == 0.0 else float(max(np.roots([factor, 1.0 - factor, -command]).real))


curves = st.just(0.0) | st.floats(0.05, 1.0)


@given(st.floats(0.05, 0.95), curves, curves)
def test_the_motors_give_the_thrust_whatever_curve_px4_believes_in(share, believed, true):
    frame = airframe(thr_mdl_fac=believed, thrust_curve=true)
    command = -mapping.collective(mapping.build(frame), share * 4 * TM).z
    u = px4_signal(command, believed)
    assert true * u * u + (1.0 - true) * u == pytest.approx(share, abs=1e-9)


def test_about_a_hover_the_torque_is_right_to_first_order_whatever_the_curve():
    frame = airframe(thr_mdl_fac=0.0, thrust_curve=0.6)
    small = Wrench(9.8, Vec3(0.01, -0.008, 0.002))
    setpoint = mapping.thrust_torque(mapping.build(frame), small)
    commands = allocated(rotors_of(frame), np.array(setpoint.torque), np.array(setpoint.thrust))
    torque, thrust = made(rotors_of(frame), 0.6 * commands**2 + 0.4 * commands, TM)
    assert thrust == pytest.approx(small.thrust, rel=1e-3)
    assert torque == pytest.approx(np.array(small.torque_b), rel=1e-2)


def test_the_prediction_is_the_wrench_where_the_rotors_can_and_says_where_they_cannot():
    asked = Wrench(9.8, Vec3(0.1, -0.05, 0.02))
    found = mapping.predict(mapping.build(airframe()), asked)
    assert found.thrust == pytest.approx(9.8)
    assert found.torque_b == pytest.approx(asked.torque_b)
    assert not any((found.thrust_high, found.thrust_low, found.roll_limited, found.pitch_limited, found.yaw_limited))
    assert sum(found.rotor_thrust) == pytest.approx(9.8)
    # left side up (+roll) means more thrust on the left, rotors 3 and 4 of the stack
    rolling = mapping.predict(mapping.build(airframe()), Wrench(9.8, Vec3(0.1, 0.0, 0.0))).rotor_thrust
    assert min(rolling.r3, rolling.r4) > 2.5 > 2.4 > max(rolling.r1, rolling.r2)
    # nose down (+pitch) means more thrust behind, rotors 1 and 4
    pitching = mapping.predict(mapping.build(airframe()), Wrench(9.8, Vec3(0.0, 0.1, 0.0))).rotor_thrust
    assert min(pitching.r1, pitching.r4) > 2.5 > 2.4 > max(pitching.r2, pitching.r3)
    beyond = mapping.predict(mapping.build(airframe()), Wrench(25.0, Vec3(0.1, 0.0, 0.0)))
    assert (beyond.thrust_high, beyond.roll_limited) == (True, False)
    assert beyond.torque_b.x == pytest.approx(0.1)
    assert beyond.thrust == pytest.approx(4 * TM - 0.1 / LY)
    assert mapping.predict(mapping.build(airframe()), Wrench(-1.0, Vec3(0.0, 0.0, 0.0))).thrust_low


PULLED_DOWN = {
    "rotor0": RotorPlace(0.2, 0.2, 0.05),
    "rotor1": RotorPlace(-0.05, -0.05, 0.05),
    "rotor2": RotorPlace(0.2, -0.05, -0.05),
    "rotor3": RotorPlace(-0.05, 0.2, -0.05),
}
"""A level hover without torque asks rotor 0 for thrust downwards."""


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"max_rotor_thrust": 0.0}, "airframe.max_rotor_thrust: found 0.0, .*; docs/how_to/px4.md"),
        (PULLED_DOWN, "found shares of -0.05, 0.55, 0.25, 0.25 in the thrust of a hover, expected all above 0"),
        ({"rotor0": RotorPlace(-0.1, -0.1, 0.05)}, "one rotor in each quadrant"),
        ({"rotor0": RotorPlace(0.0, 0.1, 0.05)}, "one rotor in each quadrant"),
        ({"rotor2": RotorPlace(LX, -LY, KQ), "rotor3": RotorPlace(-LX, LY, KQ)}, "yaw"),
    ],
)
def test_an_airframe_that_cannot_be_is_refused_by_name(changes, named):
    with pytest.raises(ParameterError, match=named):
        mapping.build(airframe(**changes))
