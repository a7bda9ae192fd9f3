"""A limit of a step is broken: the guard flies from that step on; a thrust beyond its range is cut."""

import math

import pytest
from guard_cases import HOVER, Owner, flying

from quad_core.enumerations import GuardMode, GuardReason
from quad_core.node_parameters import StateLimits, StepLimits
from quad_core.types import Vec3, Wrench

HOP = StepLimits(math.radians(10.0), 0.5, 1.0, 0.8, 1.2)
ANYWHERE = StateLimits(position_jump=100.0)


def at(p=(0.0, 0.0, 0.5), v=(0.0, 0.0, 0.0), roll=0.0):
    """Return what gives a sample of a vehicle there; its gyro shows that it lives."""

    def sample(owner):
        here = flying(roll=math.radians(roll), rates=(1e-4 * owner.step, 0.0, 0.0))
        return owner.sample(here._replace(p_w=Vec3(*p), v_w=Vec3(*v)))

    return sample


@pytest.mark.parametrize(("sample", "reason"), [
    (at(p=(0.99, -0.99, 0.99)), None),
    (at(p=(1.01, 0.0, 0.5)), GuardReason.STEP_BOX),
    (at(p=(0.0, -1.01, 0.5)), GuardReason.STEP_BOX),
    (at(p=(0.0, 0.0, 1.01)), GuardReason.STEP_BOX),
    (at(v=(0.3, 0.3, 0.2)), None),
    (at(v=(0.3, 0.3, 0.3)), GuardReason.STEP_SPEED),
    (at(roll=9.9), None),
    (at(roll=-10.1), GuardReason.STEP_TILT),
])  # fmt: skip
def test_beyond_a_limit_of_the_step_the_guard_flies_at_once(sample, reason):
    owner = Owner(step=HOP, state=ANYWHERE)
    owner.once(sample=at()(owner))
    owner.once(sample=sample(owner))
    assert owner.events == ([(1, GuardMode.DESCEND, reason)] if reason else [])
    free = Owner(state=ANYWHERE)
    free.once(sample=at()(free))
    free.once(sample=sample(free))
    assert free.events == []


@pytest.mark.parametrize(
    ("height", "sink", "is_broken"), [(0.5, 2.2, False), (0.5, 2.3, True), (0.05, 0.9, False), (0.05, 1.1, True)]
)
def test_it_sinks_no_faster_than_can_be_braked_before_the_ground(height, sink, is_broken):
    sample = at(p=(0.0, 0.0, height), v=(0.0, 0.0, -sink))
    owner, free = Owner(step=StepLimits(speed=5.0), state=ANYWHERE), Owner(state=ANYWHERE)
    owner.once(sample=sample(owner))
    free.once(sample=sample(free))
    assert owner.events == ([(0, GuardMode.DESCEND, GuardReason.STEP_SPEED)] if is_broken else [])
    assert free.events == []


def test_the_box_is_about_the_place_of_take_off():
    owner = Owner(step=HOP, state=ANYWHERE)
    owner.run(0.02, sample=at(p=(40.0, -7.0, 0.5)))
    owner.run(0.02, sample=at(p=(40.9, -7.9, 0.5)))
    assert owner.events == []
    owner.once(sample=at(p=(39.05, -8.02, 0.5))(owner))
    assert owner.events == [(20, GuardMode.DESCEND, GuardReason.STEP_BOX)]


@pytest.mark.parametrize(
    ("height", "asked", "flown"),
    [(0.5, 2.0, 1.2), (0.5, 1.1, 1.1), (0.5, 0.1, 0.8), (0.2, 0.1, 0.1), (0.2, 2.0, 1.2), (0.2, -0.5, 0.0)],
)
def test_a_thrust_beyond_the_range_is_cut_and_the_torque_stays(height, asked, flown):
    owner, torque = Owner(step=HOP, state=ANYWHERE), Vec3(0.01, -0.02, 0.03)
    owner.once(owner.good_command(Wrench(asked * HOVER.thrust, torque)), at(p=(0.0, 0.0, height))(owner))
    assert owner.wrench.torque_b == torque
    assert owner.wrench.thrust == pytest.approx(flown * HOVER.thrust)
