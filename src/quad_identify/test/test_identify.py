"""A vehicle whose parameters are known is identified; what a log cannot tell is not told."""

import json
import math
from functools import cache

import numpy as np
import pytest
from samples import log_of
from simulated import Manoeuvre, Noise, Truth

from quad_identify.identify import identify
from quad_identify.model import Model
from quad_identify.record import RecordError, gridded
from quad_identify.verdict import evidence, judged

TRUTH = Truth(effectiveness=(1.03, 0.95, 1.04, 0.98))
LEVER = TRUTH.arm * math.sqrt(0.5)


@cache
def result_of(manoeuvre=Manoeuvre(duration=25.0), **how):  # noqa: B008
    return identify([log_of(TRUTH, manoeuvre, **how)], TRUTH.mass, (LEVER, LEVER), judge=False)


def test_a_manoeuvre_tells_the_vehicle_within_bounds():
    told = {name: found.value for name, found in result_of().parameters.items() if found.told}
    assert told["specific_thrust"] == pytest.approx(TRUTH.specific_thrust, rel=0.02)
    assert told["rotor_time_constant"] == pytest.approx(TRUTH.lag, abs=0.003)
    assert told["command_delay"] == pytest.approx(TRUTH.delay, abs=0.002)
    assert told["linear_drag"] == pytest.approx(TRUTH.drag, rel=0.1)
    assert told["rotor_effectiveness"] == pytest.approx(TRUTH.effectiveness, abs=0.01)
    assert told["yaw_drag_ratio"] == pytest.approx(TRUTH.yaw_arm, rel=0.05)
    for axis, moment in zip("xyz", TRUTH.inertia, strict=True):
        assert told[f"inertia_{axis * 2}"] == pytest.approx(moment, rel=0.05)
    for axis, lever, moment in zip(("roll", "pitch", "yaw"), (LEVER, LEVER, TRUTH.yaw_arm), TRUTH.inertia, strict=True):
        assert told[f"{axis}_torque_per_inertia"] == pytest.approx(TRUTH.mass * lever / moment, rel=0.05)


def test_every_number_has_an_interval_and_what_is_not_told_says_what_to_fly():
    for found in (*result_of().parameters.values(), *result_of(every=10, motors_every=20).parameters.values()):
        assert found.why
        if found.told:
            values, low, high = (np.atleast_1d(part) for part in (found.value, found.low, found.high))
            assert (low <= values).all()
            assert (values <= high).all()
        else:
            assert found.value is None
            assert found.fly


ROTATION = ("roll_torque_per_inertia", "pitch_torque_per_inertia", "yaw_torque_per_inertia", "inertia_xx", "inertia_zz")
HOVER = Manoeuvre(25.0, 0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("manoeuvre", "how", "refused"),
    [
        (HOVER, {}, ("specific_thrust", "thrust_square", "rotor_time_constant", *ROTATION)),
        (Manoeuvre(25.0), {"every": 20, "motors_every": 20}, ("rotor_time_constant", "command_delay", *ROTATION)),
        (Manoeuvre(25.0), {"motors_every": 20}, ("rotor_time_constant", *ROTATION)),
        (Manoeuvre(25.0, roll=0.0), {}, ("roll_torque_per_inertia", "inertia_xx", "yaw_drag_ratio")),
        (Manoeuvre(25.0, yaw=0.0), {}, ("yaw_torque_per_inertia", "yaw_drag_ratio")),
        (Manoeuvre(25.0, thrust=0.01), {}, ("thrust_square", "specific_thrust")),
        (Manoeuvre(25.0), {"without": ("velocity", "voltage")}, ("linear_drag", "thrust_battery", "velocity_age")),
        (Manoeuvre(25.0), {"without": ("body_rates",)}, ("specific_thrust", "rotor_time_constant", *ROTATION)),
    ],
    ids=["hover", "50 Hz", "motors at 50 Hz", "no roll", "no yaw", "no thrust", "no velocity, no voltage", "no gyro"],
)
def test_what_a_log_cannot_tell_is_not_told(manoeuvre, how, refused):
    found = result_of(manoeuvre, **how).parameters
    assert [name for name in refused if found[name].told] == []
    assert beside_the_truth(found) == []


def beside_the_truth(found):
    """Return which parameters are told with an interval that misses the truth by more than its half width."""
    truths = {"specific_thrust": TRUTH.specific_thrust, "rotor_time_constant": TRUTH.lag, "command_delay": TRUTH.delay}
    truths |= {"linear_drag": TRUTH.drag, "thrust_battery": TRUTH.sag}
    truths |= {f"inertia_{axis * 2}": moment for axis, moment in zip("xyz", TRUTH.inertia, strict=True)}
    truths["rotor_effectiveness"] = TRUTH.effectiveness
    told = {name: found[name] for name in truths if found[name].told}
    off = {name: np.abs(np.subtract(one.value, truths[name])) for name, one in told.items()}
    return [name for name, one in told.items() if np.any(off[name] > np.subtract(one.high, one.low))]


def test_motors_logged_more_rarely_than_they_are_commanded_widen_the_timing():
    found = result_of(every=4, motors_every=4).parameters
    for name, value in (("rotor_time_constant", TRUTH.lag), ("command_delay", TRUTH.delay)):
        assert found[name].told
        assert found[name].low < value < found[name].high


@pytest.mark.parametrize("push", [0.05, 0.15, 0.5])
def test_pushes_that_last_widen_intervals_and_move_no_value_out_of_them(push):
    found = result_of(Manoeuvre(50.0), noise=Noise(push=push)).parameters
    assert beside_the_truth(found) == []
    assert found["rotor_effectiveness"].told
    assert found["linear_drag"].told == (push < 0.1)
    assert found["linear_drag"].low < TRUTH.drag < found["linear_drag"].high


@pytest.mark.parametrize("curve", [0.0, 0.8])
def test_a_curve_where_the_command_hardly_varies_is_not_told_or_held_by_its_interval(curve):
    truth = Truth(curve=curve)
    log = log_of(truth, Manoeuvre(25.0, thrust=0.05), without=("voltage",))
    found = identify([log], truth.mass, (LEVER, LEVER), judge=False).parameters
    top = truth.specific_thrust
    for name, value in (("specific_thrust", top), ("thrust_linear", (1 - curve) * top), ("thrust_square", curve * top)):
        assert found[name].low <= value <= found[name].high, name


@pytest.mark.parametrize(("force", "turns", "told"), [(0.52, 0.92, False), (0.52, 0.99, True), (0.9, 0.0, True)])
def test_noise_that_control_answers_tells_a_timing_by_an_axis_or_by_the_thrust_alone(force, turns, told):
    log = log_of()
    model, fit = Model(gridded(log)), identify([log], judge=False).fit
    noisy = fit._replace(explained=np.array([0.0, 0.0, force, 0.8, turns, 0.8]))
    found = judged(evidence(model, noisy, TRUTH.mass, (LEVER, LEVER)))
    assert found["rotor_time_constant"].told == told
    assert found["inertia_zz"].told or found["inertia_zz"].low < 0.2 * TRUTH.inertia[2]


def test_a_known_delay_is_kept():
    found = identify([log_of(TRUTH)], judge=False, delay=TRUTH.delay).parameters
    assert found["command_delay"].value == TRUTH.delay
    assert found["rotor_time_constant"].value == pytest.approx(TRUTH.lag, abs=0.001)


def test_a_weak_rotor_is_named_by_its_number_in_the_log():
    weak = Truth(effectiveness=(1.07, 1.07, 0.79, 1.07))
    found = identify([log_of(weak)], judge=False).parameters["rotor_effectiveness"]
    assert found.told
    assert "rotor 3 gives at least" in found.why
    assert "rotor 1" not in found.why


def test_mass_is_never_told_by_flight_alone():
    found = identify([log_of()], judge=False).parameters
    assert not found["mass"].told
    assert "weigh" in found["mass"].fly
    assert not found["inertia_xx"].told


def test_errors_are_measured_on_what_the_fit_has_not_seen_beside_hold_last_and_a_prior():
    result = identify([log_of()], prior={"thrust_linear": 20.0})
    errors = result.held_out["velocity at 0.5 s"]
    assert errors["identified"] < 0.5 * errors["hold last"]
    assert errors["identified"] < errors["prior"]
    assert json.loads(result.as_json())["held_out"]["body_rates at 0.1 s"].keys() == {
        "hold last",
        "identified",
        "prior",
    }


def test_an_axis_that_no_motor_explains_is_predicted_to_turn_on_as_it_does():
    log = log_of()
    rates = log.body_rates.values.copy()
    rates[:, 0] = np.sin(7.0 * log.body_rates.t)  # as where rotors of unlike strength are not in the log
    moved = log._replace(body_rates=log.body_rates._replace(values=rates))
    fit = identify([moved], judge=False).fit
    _, alpha = Model(gridded(moved)).force_and_acceleration(fit.p, 0)
    assert not alpha[:, 0].any()
    assert np.ptp(alpha[:, 1]) > 1.0


def test_no_motors_that_move_are_no_flight():
    log = log_of()
    still = log._replace(motors=log.motors._replace(values=np.full_like(log.motors.values, 0.5)))
    with pytest.raises(RecordError, match="motors: found one value all along"):
        identify([still])
