"""The order of decision record 0001, ends of flights and the cache, on stand-in plug-ins."""

import numpy as np
import pytest
import stand_in
from stand_in import MODULES, Internals, Memory, small_flight, with_stages

from quad_analysis.metrics import flight_metrics
from quad_core.types import LinkFault, Vec3, Wrench
from quad_flight.engine import Modules
from quad_flight.flight import fly
from quad_flight.many import sweep
from quad_flight.stages import PerStage


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

        return noted if callable(function) and not isinstance(function, type) else function


def spied(calls):
    spies = [Spy(module, calls) for module in MODULES[:-1]]
    return Modules(*spies, PerStage(*(Spy(module, calls) for module in MODULES.stages)))


def test_stages_run_in_the_order_of_the_record():
    calls = []
    result = fly(small_flight(modules=spied(calls)), logging=False)
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
    result = fly(small_flight(seed=3, modules=spied(calls)))
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
    # what is published with state[k] is of step k - 1 -> k, and knows its wrench and the state after it
    published = result.topics["disturbance"]
    lumped = published["lumped_acceleration_w"][:, 2]
    assert lumped[0] == 0.0
    assert list(lumped[1:]) == list(result.topics["actuation"]["thrust"][:-1])
    assert (published["lumped_angular_acceleration_b"][:, 2] == result.topics["truth"]["p_w"][:, 2]).all()


def test_errors_are_counted_from_t_0_at_steps_of_the_trajectory():
    result = fly(small_flight())
    rows = range(10, 50, 5)
    errors = [abs(1.0 - result.topics["truth"]["p_w"][k, 2]) for k in rows]
    assert result.score.samples == 8
    assert result.score.largest_error == max(errors)
    assert result.score.last_error == errors[-1]
    assert result.rmse == pytest.approx(np.sqrt(np.mean(np.square(errors))), rel=1e-14)
    assert result.trajectory_start == 0.02


DIVERGING = {"duration": 50.0, "attitude": -1e4}
NOT_FINITE = {"duration": 1.0, "position": -1.0}
NOT_REMEMBERED = {"duration": 1.0, "attitude": 0.0}


def test_a_state_out_of_bounds_ends_the_flight_as_diverged():
    result = fly(small_flight(**DIVERGING))
    assert result.outcome == "diverged"
    assert 0 < result.steps < result.end_step
    truth = result.topics["truth"]
    assert len(truth) == len(result.topics["actuation"]) == result.steps
    assert np.isfinite(truth["v_w"]).all()
    assert np.abs(truth["v_w"]).max() <= 1e3


@pytest.mark.parametrize(
    ("words", "outcome"),
    [
        (DIVERGING, "diverged"),
        (NOT_FINITE, "refused"),
        (NOT_REMEMBERED, "refused"),
        ({"duration": 3.0, "seed": 7}, "ended"),
    ],
)
def test_both_engines_stop_at_the_same_step_with_the_same_bits(words, outcome):
    """What they log is compared in test_same_bits: compiling that, too, takes half a minute."""
    plain, fast = (fly(small_flight(**words), compiled=compiled, logging=False) for compiled in (False, True))
    assert plain == fast
    assert plain.outcome == outcome


def test_a_number_that_is_not_finite_is_not_published():
    result = fly(small_flight(**NOT_FINITE))
    assert (result.outcome, result.steps) == ("refused", 40)
    assert len(result.topics["attitude_setpoint"]) == 4
    assert len(result.topics["truth"]) == 41
    for rows in result.topics.values():
        for name in rows.dtype.names:
            assert np.isfinite(rows[name]).all()


class twister(stand_in.attitude):  # noqa: N801
    """Turns its yaw torque up by 1 N m at every answer."""

    @staticmethod
    def step(parameters, vehicle, memory, inputs, dt):
        torque = Vec3(0.0, 0.0, memory.count)
        return Wrench(inputs.setpoint.thrust, torque), Memory(memory.count + 1.0), Internals(dt, 0.0)


class silencer(stand_in.disturbance):  # noqa: N801
    """Loses every command from 0.04 s on."""

    @staticmethod
    def sample(parameters, table, time):
        calm = stand_in.disturbance.sample(parameters, table, time)
        return calm._replace(link=LinkFault(0.0, time >= 0.04))


def test_a_lost_command_leaves_the_last_one_in_force_and_counts_all_the_same():
    modules = with_stages(attitude_controller=twister)._replace(disturbance=silencer)
    result = fly(small_flight(modules=modules))
    # the answer of step 18 was the tenth: 9 N m
    assert result.topics["actuation"]["torque_b"][18:, 2].tolist() == [9.0] * 32
    assert result.topics["wrench_setpoint"]["torque_b"][-1, 2] == 24.0
    assert result.score.torque_variation == 20.0


class liar(stand_in.sensing):  # noqa: N801
    """Says that the vehicle is 3 m higher than it is."""

    @staticmethod
    def step(parameters, table, line, memory, truth, fault, k):
        return truth._replace(p_w=Vec3(truth.p_w.x, truth.p_w.y, truth.p_w.z + 3.0)), memory


def test_laws_see_the_state_and_the_score_sees_the_truth():
    result = fly(small_flight(modules=MODULES._replace(sensing=liar)))
    truth, state = result.topics["truth"]["p_w"][:, 2], result.topics["state"]["p_w"][:, 2]
    assert (state == truth + 3.0).all()
    assert result.score.last_error == abs(1.0 - truth[45])
    assert result.topics["attitude_setpoint"]["thrust"][0] == 4.0 * (1.0 - 3.0)


def test_a_law_whose_memory_is_not_finite_is_refused_as_the_node_does():
    result = fly(small_flight(**NOT_REMEMBERED))
    # the seventh answer of every second step
    assert (result.outcome, result.steps, result.refused) == ("refused", 12, "attitude_controller")
    assert len(result.topics["wrench_setpoint"]) == 6
    assert len(result.topics["attitude_setpoint"]) == 2
    assert len(result.topics["actuation"]) == 12
    assert len(result.topics["truth"]) == 13


def test_sweep_equals_single_flights():
    flight = small_flight(duration=2.0)
    results = sweep(flight, range(1, 6), threads=2)
    assert len({r.rmse for r in results}) == 5
    assert results == [fly(flight._replace(seed=seed), logging=False) for seed in range(1, 6)]
    full = fly(flight)
    metrics = flight_metrics(full.topics)
    assert metrics.position_rmse == pytest.approx(full.rmse, rel=1e-12)
    assert metrics.position_max == pytest.approx(full.score.largest_error, rel=1e-12)
    assert metrics.position_final == pytest.approx(full.score.last_error, rel=1e-12)
