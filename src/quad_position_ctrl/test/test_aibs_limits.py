"""What the position law promises whatever the flight does: finite, within its limits, at rest while limited."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from position_cases import DT, PRESETS, VEHICLE, any_inputs, any_memory, numbers

from quad_core.geometry import body_z
from quad_core.parameters import Choice, build, fields
from quad_core.types import Actuation, PositionInputs, Quat, TrajectoryPoint, Vec3, VehicleState
from quad_position_ctrl import aibs

MAX_THRUST = VEHICLE.thrust_to_weight * VEHICLE.mass * VEHICLE.gravity
LIVE = [field for field in fields(aibs.Parameters, "", True) if field.live]
FREEZING = ("velocity_limited", "acceleration_limited", "tilt_limited", "thrust_limited", "descent_limited")


def stepped(preset, data):
    parameters = PRESETS[preset]
    memory, inputs = data.draw(any_memory(parameters)), data.draw(any_inputs())
    return parameters, memory, inputs, *aibs.step(parameters, VEHICLE, memory, inputs, DT)


@pytest.mark.parametrize("preset", PRESETS)
@given(data=st.data())
@settings(max_examples=150, deadline=None)
def test_whatever_comes_every_number_is_finite_and_within_its_limits(preset, data):
    parameters, before, inputs, setpoint, after, internals = stepped(preset, data)
    assert all(math.isfinite(number) for number in numbers((setpoint, after, internals)))
    if preset == "printed":
        return
    assert parameters.limits.tilt == 0.87
    assert body_z(setpoint.q_wb).z >= math.cos(0.87) - 1e-12
    met = any(getattr(internals, name) for name in FREEZING)
    assert internals.adaptation_frozen == (met or inputs.actuation.thrust_high or inputs.actuation.thrust_low)
    if internals.adaptation_frozen:
        assert (after.error_integral, after.adaptive_gain) == (before.error_integral, before.adaptive_gain)
    if preset == "tuned":
        assert 0.02 * MAX_THRUST <= setpoint.thrust <= MAX_THRUST
        assert setpoint.thrust_fraction == pytest.approx(setpoint.thrust / MAX_THRUST, rel=1e-12)
        assert all(abs(value) <= 20.0 for value in after.error_integral)
        assert all(0.0 <= gain <= 10.0 for gain in after.adaptive_gain)
        assert all(abs(value) <= 5.0 for value in after.disturbance_estimate)


def test_integral_and_gain_move_when_no_limit_is_met():
    parameters = PRESETS["minimal"]
    inputs = calm_inputs(0.1)
    _, memory, internals = aibs.step(parameters, VEHICLE, aibs.init(parameters, VEHICLE), inputs, DT)
    assert not internals.adaptation_frozen
    # e_7 = 0.1 m: Gamma grows by 0.1 dt; e_8 = xi_7 e_7 = 0.425 m/s: xi_hat by 2.5 * 0.425^2 dt
    assert memory.error_integral.x == pytest.approx(0.001, rel=1e-12)
    assert memory.adaptive_gain.x == pytest.approx(1.0 + 0.01 * 2.5 * 0.180625, rel=1e-12)
    assert (memory.error_integral.y, memory.adaptive_gain.y) == (0.0, 1.0)


@pytest.mark.parametrize("flag", ["thrust_high", "thrust_low"])
def test_what_the_rotors_report_freezes_too(flag):
    parameters = PRESETS["minimal"]
    start = aibs.init(parameters, VEHICLE)
    inputs = calm_inputs(0.1)
    inputs = inputs._replace(actuation=inputs.actuation._replace(**{flag: True}))
    _, memory, internals = aibs.step(parameters, VEHICLE, start, inputs, DT)
    assert internals.adaptation_frozen
    assert (memory.error_integral, memory.adaptive_gain) == (start.error_integral, start.adaptive_gain)
    free = parameters._replace(anti_windup=False)
    _, memory, internals = aibs.step(free, VEHICLE, start, inputs, DT)
    assert not internals.adaptation_frozen
    assert memory.error_integral.x == pytest.approx(0.001, rel=1e-12)


@given(data=st.data())
@settings(max_examples=60, deadline=None)
def test_live_parameters_may_change_to_anything_they_admit(data):
    """Two steps with new values: finite at once, and inside the new bounds after a step in which nothing rests."""
    old = PRESETS[data.draw(st.sampled_from(sorted(PRESETS)))]
    memory = data.draw(any_memory(old))
    chosen = data.draw(st.lists(st.sampled_from(LIVE), min_size=1, max_size=6, unique=True))
    changed = build(old, {field.name: data.draw(admitted(field)) for field in chosen})
    for _ in range(2):
        setpoint, memory, internals = aibs.step(changed, VEHICLE, memory, data.draw(any_inputs()), DT)
        assert all(math.isfinite(number) for number in numbers((setpoint, memory, internals)))
        limits = changed.limits
        assert setpoint.thrust <= max(limits.thrust, limits.min_thrust) * MAX_THRUST
        if not internals.adaptation_frozen:
            for name, gain, integral in zip("xyz", memory.adaptive_gain, memory.error_integral, strict=True):
                assert 0.0 <= gain <= getattr(changed, name).max_gain
                assert abs(integral) <= getattr(changed, name).max_integral


def test_choices_that_change_the_meaning_of_the_memory_are_not_live():
    fixed = {field.name for field in fields(aibs.Parameters, "", True) if not field.live}
    assert fixed == {field.name for field in fields(aibs.Parameters) if isinstance(field.spec, Choice)}


def admitted(field):
    if isinstance(field.default, bool):
        return st.booleans()
    return st.floats(field.spec.low, field.spec.high, allow_subnormal=False)


def calm_inputs(offset):
    """Level, at rest, ``offset`` m east of a resting reference, carried by exactly the thrust it needs."""
    state = VehicleState(p_w=Vec3(offset, 0.0, 0.0), q_wb=Quat(0.0, 0.0, 0.0, 1.0))
    return PositionInputs(state, TrajectoryPoint(), Actuation(thrust=VEHICLE.mass * VEHICLE.gravity))
