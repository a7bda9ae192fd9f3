"""The order of decision record 0001, ends of flights and the cache, on stand-in plug-ins."""

import importlib
import sys

import numpy as np
import pytest
import stand_in
from stand_in import Internals, Parameters

from quad_campaign import engine
from quad_campaign.flight import Flight, fly
from quad_campaign.loop import Schedule, Setup
from quad_campaign.stages import Modules
from quad_campaign.sweep import sweep
from quad_core.types import Actuation, AttitudeThrust, Disturbance, TrajectoryPoint, VehicleState, Wrench
from quad_core.vehicle import Vehicle

KINDS = (
    VehicleState,
    VehicleState,
    Disturbance,
    Actuation,
    TrajectoryPoint,
    AttitudeThrust,
    Internals,
    Wrench,
    Internals,
)
MODULES = Modules(
    stand_in.plant, stand_in.disturbance, stand_in.trajectory, stand_in.position, stand_in.attitude, stand_in.sensing
)


def small_flight(seed=0, duration=0.08, position=4.0, attitude=1.0, steps=(5, 10, 2), modules=MODULES):
    schedule = Schedule(2_000_000, *steps, 0.0)
    gains = (1.0, 1.0, duration, position, attitude, 1.0)
    setup = Setup(Vehicle(), schedule, *(Parameters(gain) for gain in gains))
    return Flight(modules, setup, seed, (Internals, Internals), {})


class Spy:
    """A plug-in that notes each call before passing it on."""

    def __init__(self, inner, calls):
        self._inner, self._calls = inner, calls

    def __getattr__(self, name):
        function = getattr(self._inner, name)

        def noted(*args):
            result = function(*args)
            self._calls.append((self._inner.__name__, name, args, result))
            return result

        return noted if callable(function) else function


def test_stages_run_in_the_order_of_the_record():
    calls = []
    spies = Modules(*(Spy(module, calls) for module in MODULES))
    result = fly(small_flight(modules=spies), logging=False)
    assert (result.outcome, result.steps, result.end_step) == ("ended", 50, 50)
    names = [
        (stage, name)
        for stage, name, *_ in calls
        if name in ("sample", "step") and stage not in ("disturbance", "sensing")
    ]
    expected = [("trajectory", "sample")]  # where t = 0 lies
    for k in range(50):
        expected += [("trajectory", "sample")] * (k % 5 == 0)
        expected += [("position", "step")] * (k % 10 == 0)
        expected += [("attitude", "step")] * (k % 2 == 0)
        expected += [("plant", "step")]
    assert names == expected


def test_what_each_stage_sees():
    calls = []
    result = fly(small_flight(seed=3, modules=Modules(*(Spy(module, calls) for module in MODULES))))
    position = [args for stage, name, args, _ in calls if (stage, name) == ("position", "step")]
    attitude = [args for stage, name, args, _ in calls if (stage, name) == ("attitude", "step")]
    plant = [(args, out) for stage, name, args, out in calls if (stage, name) == ("plant", "step")]
    assert [args[-1] for args in position] == [0.02] * 5
    assert [args[-1] for args in attitude] == [0.004] * 25
    assert {args[-1] for args, _ in plant} == {0.002}
    assert position[0][3].actuation.thrust == 0.0
    for i, args in enumerate(position[1:], start=1):
        assert args[3].actuation == plant[10 * i - 1][1][1]
        assert args[3].reference.trajectory_time == pytest.approx(0.02 * i - 0.02, abs=1e-15)
    for i, args in enumerate(attitude):
        assert args[3].state.p_w.z == result.topics["truth"]["p_w"][2 * i, 2]
        assert args[3].setpoint.thrust == result.topics["attitude_setpoint"]["thrust"][i // 5]
    for k, (args, _) in enumerate(plant):
        assert args[3].thrust == result.topics["wrench_setpoint"]["thrust"][k // 2]


def test_topics_carry_their_steps():
    result = fly(small_flight())
    periods = {
        "truth": 1,
        "state": 1,
        "disturbance": 1,
        "actuation": 1,
        "reference": 5,
        "attitude_setpoint": 10,
        "position_controller/internals": 10,
        "wrench_setpoint": 2,
        "attitude_controller/internals": 2,
    }
    assert set(result.topics) == set(periods)
    for name, period in periods.items():
        rows = result.topics[name]
        assert list(rows["step"]) == list(range(0, 50, period)), name
        assert list(rows["next_step"] - rows["step"]) == [period] * len(rows)
        assert list(rows["stamp_ns"]) == [2_000_000 * step for step in rows["step"]]
    # what is published with state[k] knows the wrench of step k - 1
    lumped = result.topics["disturbance"]["lumped_acceleration_w"][:, 2]
    assert lumped[0] == 0.0
    assert list(lumped[1:]) == list(result.topics["actuation"]["thrust"][:-1])


def test_errors_are_counted_from_t_0_at_steps_of_the_trajectory():
    result = fly(small_flight())
    rows = range(10, 50, 5)
    errors = [abs(1.0 - result.topics["truth"]["p_w"][k, 2]) for k in rows]
    assert result.score.samples == 8
    assert result.score.largest_error == max(errors)
    assert result.score.last_error == errors[-1]
    assert result.rmse == pytest.approx(np.sqrt(np.mean(np.square(errors))), rel=1e-14)
    assert result.trajectory_start == 0.02


@pytest.mark.parametrize("compiled", [False, True])
def test_a_state_out_of_bounds_ends_the_flight_as_diverged(compiled):
    result = fly(small_flight(duration=50.0, attitude=-1e4), compiled=compiled)
    assert result.outcome == "diverged"
    assert 0 < result.steps < result.end_step
    truth = result.topics["truth"]
    assert len(truth) == len(result.topics["actuation"]) == result.steps
    assert np.isfinite(truth["v_w"]).all()
    assert np.abs(truth["v_w"]).max() <= 1e3


def test_both_engines_stop_at_the_same_step_with_the_same_bits():
    for flight in (small_flight(duration=50.0, attitude=-1e4), small_flight(seed=7, duration=3.0)):
        plain, fast = fly(flight), fly(flight, compiled=True)
        assert plain._replace(topics={}) == fast._replace(topics={})
        for name, rows in plain.topics.items():
            assert rows.tobytes() == fast.topics[name].tobytes(), name


@pytest.mark.parametrize("compiled", [False, True])
def test_a_number_that_is_not_finite_is_not_published(compiled):
    result = fly(small_flight(position=-1.0, duration=1.0), compiled=compiled)
    assert (result.outcome, result.steps) == ("refused", 40)
    assert len(result.topics["attitude_setpoint"]) == 4
    assert len(result.topics["truth"]) == 41
    for rows in result.topics.values():
        for name in rows.dtype.names:
            assert np.isfinite(rows[name]).all()


def test_sweep_equals_single_flights():
    flight = small_flight(duration=2.0)
    results = sweep(flight, range(1, 6), threads=2)
    assert [r.seed for r in results] == [1, 2, 3, 4, 5]
    assert len({r.rmse for r in results}) == 5
    for r in results:
        alone = fly(flight._replace(seed=r.seed), logging=False)
        assert (alone.outcome, alone.steps, alone.rmse) == (r.outcome, r.steps, r.rmse)
    full = sweep(flight, [2], compiled=False, metrics=True)[0]
    assert full.metrics.position_rmse == pytest.approx(full.rmse, rel=1e-12)
    assert full.metrics.position_max == pytest.approx(full.largest_error, rel=1e-12)
    assert full.metrics.position_final == pytest.approx(full.last_error, rel=1e-12)


PLUGIN = """
from stand_in import *
class position(position):
    @staticmethod
    def step(parameters, vehicle, memory, inputs, dt):
        return answer(parameters, inputs), memory, Internals(dt, 0.0)
def answer(parameters, inputs):
    return AttitudeThrust(Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0),
                          Quat(0.0, 0.0, 0.0, 1.0), helped(parameters.gain), 0.0)
"""
HELPER = "def helped(gain):\n    return gain * {factor}\n"


def load_plugin(directory, factor):
    (directory / "foreign_helper.py").write_text(HELPER.format(factor=factor))
    (directory / "foreign_law.py").write_text("from foreign_helper import helped\n" + PLUGIN)
    for name in ("foreign_helper", "foreign_law"):
        sys.modules.pop(name, None)
    importlib.invalidate_caches()
    return MODULES._replace(position=importlib.import_module("foreign_law").position)


def test_cache_is_used_again_and_knows_every_source_that_it_holds(tmp_path, monkeypatch):
    monkeypatch.setenv("QUAD_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    monkeypatch.syspath_prepend(str(tmp_path))
    hits, logged, thrusts = [], [], []
    for factor in ("1.0", "1.0", "3.0"):
        modules = load_plugin(tmp_path, factor)
        result = fly(small_flight(modules=modules), compiled=True)
        thrusts.append(result.topics["wrench_setpoint"]["thrust"][0])
        fly(small_flight(modules=modules), compiled=True, logging=False)
        hits.append(sum(engine.compiled_engine(modules).fly.stats.cache_hits.values()))
        logged.append(sum(engine.compiled_logger(modules, KINDS).stats.cache_hits.values()))
    assert thrusts == [4.0, 4.0, 12.0]
    assert hits == [0, 1, 0]
    assert logged == [0, 1, 0]
    assert len(list((tmp_path / "cache").iterdir())) == 2


def test_a_plugin_that_cannot_be_compiled_is_named():
    class Difficult(stand_in.position):
        @staticmethod
        def step(parameters, vehicle, memory, inputs, dt):
            return {"no": "answer"}[dt], memory, Internals(dt, 0.0)

    with pytest.raises(engine.EngineError, match="Difficult"):
        fly(small_flight(modules=MODULES._replace(position=Difficult)), compiled=True)
