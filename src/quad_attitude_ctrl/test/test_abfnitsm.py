"""What the attitude law promises whatever the flight does: finite, within its limits, at rest while limited or near."""

import math

import pytest
from attitude_cases import AXES, DT, LIMITED, PRESETS, VEHICLE, any_inputs, any_memory, numbers
from hypothesis import given, settings
from hypothesis import strategies as st

from quad_attitude_ctrl import abfnitsm
from quad_core.parameters import Choice, build, fields
from quad_core.types import Actuation, AttitudeInputs, AttitudeThrust, Vec3, VehicleState

LIVE = [field for field in fields(abfnitsm.Parameters, "", True) if field.live]


def stepped(preset, data):
    parameters = PRESETS[preset]
    memory, inputs = data.draw(any_memory(parameters)), data.draw(any_inputs())
    return parameters, memory, inputs, *abfnitsm.step(parameters, VEHICLE, memory, inputs, DT)


@pytest.mark.parametrize("preset", PRESETS)
@given(data=st.data())
@settings(max_examples=150, deadline=None)
def test_whatever_comes_every_number_is_finite_and_within_its_limits(preset, data):
    """Estimates never shrink, as Eq. 54 only grows: a property of the paper's law, and the reason for its bound."""
    _, before, inputs, wrench, after, seen = stepped(preset, data)
    assert all(math.isfinite(number) for number in numbers((wrench, after, seen)))
    assert wrench.thrust == inputs.setpoint.thrust
    reported = (inputs.actuation.roll_limited, inputs.actuation.pitch_limited, inputs.actuation.yaw_limited)
    for i, name in enumerate(AXES):
        old, new = getattr(before, name), getattr(after, name)
        assert all(b >= a for a, b in zip(old.estimates, new.estimates, strict=True))
        if abs(seen.sliding_variable[i]) <= 0.3:
            assert new.estimates == old.estimates
            assert seen.adaptation_frozen[i]
        if preset != "tuned":
            continue
        assert abs(wrench.torque_b[i]) <= 0.5
        assert abs(wrench.torque_b[i]) == 0.5 or not seen.torque_limited[i]
        assert abs(new.surface_integral) <= 10.0
        assert all(0.0 <= estimate <= 10.0 for estimate in new.estimates)
        if seen.torque_limited[i] or reported[i]:
            assert (new.surface_integral, new.estimates) == (old.surface_integral, old.estimates)
            assert seen.adaptation_frozen[i]


@pytest.mark.parametrize("axis", range(3))
def test_one_limited_axis_does_not_freeze_the_others(axis):
    """Every axis 0.2 rad off at 1 rad/s: outside the dead zone, far from the torque limit."""
    parameters = LIMITED
    flags = dict.fromkeys((f"{AXES[axis]}_limited",), True)
    state = VehicleState(omega_b=Vec3(1.0, 1.0, 1.0))
    inputs = AttitudeInputs(state, AttitudeThrust(angles=Vec3(-0.2, -0.2, -0.2)), Actuation(**flags))
    before = abfnitsm.init(parameters, VEHICLE)
    _, after, internals = abfnitsm.step(parameters, VEHICLE, before, inputs, DT)
    assert internals.torque_limited == (False, False, False)
    assert internals.adaptation_frozen == tuple(i == axis for i in range(3))
    for i, name in enumerate(AXES):
        # s = e' + 0 = 1 rad/s, level: Q_hat' = Delta |s| {1, |x1| = 0, |x2| = 1}
        moved = pytest.approx((0.0, 0.0, 0.0) if i == axis else (DT, 0.0, DT), abs=1e-15)
        assert getattr(after, name).estimates == moved
        assert (getattr(after, name).surface_integral == 0.0) == (i == axis)


def test_without_anti_windup_only_the_dead_zone_freezes():
    parameters = LIMITED._replace(anti_windup=False)
    state = VehicleState(omega_b=Vec3(900.0, 900.0, 900.0))
    inputs = AttitudeInputs(state, AttitudeThrust(), Actuation(roll_limited=True, pitch_limited=True, yaw_limited=True))
    _, after, internals = abfnitsm.step(parameters, VEHICLE, abfnitsm.init(parameters, VEHICLE), inputs, DT)
    assert internals.torque_limited == (True, True, True)
    assert internals.adaptation_frozen == (False, False, False)
    assert all(getattr(after, name).surface_integral > 0.0 for name in AXES)


@given(data=st.data())
@settings(max_examples=60, deadline=None)
def test_live_parameters_may_change_to_anything_they_admit(data):
    """Two steps with new values: finite at once, and inside the new bounds after a step in which nothing rests."""
    old = PRESETS[data.draw(st.sampled_from(sorted(PRESETS)))]
    memory = data.draw(any_memory(old))
    chosen = data.draw(st.lists(st.sampled_from(LIVE), min_size=1, max_size=6, unique=True))
    changed = build(old, {field.name: data.draw(admitted(field)) for field in chosen})
    for _ in range(2):
        wrench, memory, internals = abfnitsm.step(changed, VEHICLE, memory, data.draw(any_inputs()), DT)
        assert all(math.isfinite(number) for number in numbers((wrench, memory, internals)))
        for i, name in enumerate(AXES):
            axis = getattr(changed, name)
            assert abs(wrench.torque_b[i]) <= axis.max_torque
            if not internals.adaptation_frozen[i]:
                assert abs(getattr(memory, name).surface_integral) <= axis.max_surface_integral
                assert all(estimate <= axis.max_estimate for estimate in getattr(memory, name).estimates)


def test_choices_that_change_the_meaning_of_the_memory_are_not_live():
    fixed = {field.name for field in fields(abfnitsm.Parameters, "", True) if not field.live}
    assert fixed == {field.name for field in fields(abfnitsm.Parameters) if isinstance(field.spec, Choice)}


def admitted(field):
    if isinstance(field.default, bool):
        return st.booleans()
    return st.floats(field.spec.low, field.spec.high, allow_subnormal=False)
