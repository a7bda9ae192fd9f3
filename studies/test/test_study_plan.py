"""The plan of a study: what is read, what is refused, and that the shipped one holds together."""

import pytest
import study_plan
import yaml

from quad_core import plugins
from quad_core.parameters import ParameterError

pytestmark = pytest.mark.skipif(
    "se3" not in plugins.names(plugins.POSITION_LAW), reason="plug-ins are not installed: run scripts/setup"
)


def content():
    return {
        "name": "small",
        "tuning": {
            "trials": 4, "sampler_seed": 1, "seeds": [1, 2], "cases": ["case1"], "plants": ["rigid_body"],
            "objective": {"rmse_scale": 0.01, "variation_scale": 2.0, "failure": 100.0},
        },
        "study": {
            "held_out_first": 100, "cases": ["case1"], "plants": ["rigid_body"], "start": "approach",
            "resamples": 99, "bootstrap_seed": 1,
        },
        "controllers": {
            "mine": {
                "title": "Mine", "position": "pid", "attitude": "itsm",
                "fixed": {"attitude_controller": {"switching": "layer"}},
                "knobs": {
                    "p": {"node": "position_controller", "parameters": ["xy.position", "z.position"],
                          "low": 1.0, "high": 4.0},
                    "k": {"node": "attitude_controller", "parameters": ["roll.exponent"]},
                },
            }
        },
    }  # fmt: skip


def read(tmp_path, plan_content):
    path = tmp_path / "small.yaml"
    path.write_text(yaml.safe_dump(plan_content, sort_keys=False))
    return study_plan.read_plan(path)


def test_a_plan_is_read_with_bounds_from_the_parameters(tmp_path):
    plan = read(tmp_path, content())
    (mine,) = plan.controllers
    p, k = mine.knobs
    assert (p.low, p.high, p.log) == (1.0, 4.0, False)
    assert (k.low, k.high) == (0.1, 1.0)
    assert plan.study.seeds(3) == [100, 101, 102]
    plan_content = mine.overrides({"p": 2.5})
    assert plan_content["position_controller"] == {"law": "pid", "pid.xy.position": 2.5, "pid.z.position": 2.5}
    assert plan_content["attitude_controller"] == {"law": "itsm", "itsm.switching": "layer"}
    flight = study_plan.flight_of(plan_content, "case2", "paper")
    assert flight.setup.stages.position_controller.z.position == 2.5
    assert flight.setup.stages.attitude_controller.switching == 1


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda c: c.pop("study"), "small.yaml: top: .*expected the keys"),
        (lambda c: c["tuning"].update(trails=3), "tuning: found .*trails"),
        (lambda c: c["tuning"]["seeds"].append(100), "tuning.seeds: found 100"),
        (lambda c: c["controllers"]["mine"].update(position="kite"), "kite"),
        (lambda c: c["controllers"]["mine"].update(fixed={"recorder": {}}), "fixed.recorder"),
        (lambda c: c["controllers"]["mine"]["knobs"]["p"].update(high=1e9), r"knobs.p: found \[1.0, 1000000000.0\]"),
        (lambda c: c["controllers"]["mine"]["knobs"]["p"].update(low=5.0), r"found \[5.0, 4.0\]"),
        (lambda c: c["controllers"]["mine"]["knobs"]["p"].update(parameters=["xy.speed"]), "pid.xy.speed"),
        (
            lambda c: c["controllers"]["mine"]["knobs"]["p"].update(node="trajectory"),
            "knobs.p.node: found 'trajectory'",
        ),
        (lambda c: c["study"].update(cases=["case9"]), "case9"),
    ],
)
def test_what_does_not_fit_is_refused_by_name(tmp_path, change, message):
    plan_content = content()
    change(plan_content)
    with pytest.raises((ParameterError, plugins.PluginError), match=message):
        read(tmp_path, plan_content)


def test_a_plan_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(ParameterError, match="expected paper or the path"):
        study_plan.find_plan("nothing")
    plan = read(tmp_path, content())
    with pytest.raises(ParameterError, match="no tuned gains"):
        study_plan.tuned_overrides(plan, plan.controllers[0])


def test_the_shipped_plan_and_gains_fly_what_they_say():
    plan = study_plan.read_plan(study_plan.find_plan("paper"))
    assert plan.controllers[0].name == "proposed"
    assert len(plan.study.seeds(50)) == 50
    assert not set(plan.study.seeds(50)) & set(plan.tuning.seeds)
    limits = set()
    for controller in plan.controllers:
        gains = study_plan.tuned_overrides(plan, controller)
        flight = study_plan.flight_of(gains, "case1", "rigid_body")
        assert flight.resolved["position_controller"].node.law == controller.position
        assert flight.resolved["attitude_controller"].node.law == controller.attitude
        limits.add((flight.setup.stages.position_controller.limits, flight.setup.stages.position_controller.speed))
        values = {**gains["position_controller"], **gains["attitude_controller"]}
        for knob in controller.knobs:
            assert {knob.low <= values[name] <= knob.high for name in knob.parameters} == {True}
    assert len(limits) == 1


def test_conditions_act_in_every_flight_and_a_controller_wins(tmp_path):
    asked = content()
    asked["tuning"]["conditions"] = [
        {"simulator": {"sensor.delay": 0.02}, "vehicle": "x500", "/**": {"vehicle.rotor_time_constant": 0.03}},
        {"attitude_controller": {"itsm.torque.roll": 2.0, "itsm.switching": "sign"}},
    ]
    asked["controllers"]["mine"]["fixed"]["position_controller"] = {"prediction.enabled": True}
    asked["controllers"]["mine"]["knobs"]["s"] = {
        "node": "position_controller", "parameters": ["prediction.smoothing"], "low": 1.0, "high": 30.0,
    }  # fmt: skip
    plan = read(tmp_path, asked)
    (mine,) = plan.controllers
    flights = [
        study_plan.flight_of(mine.overrides({"s": 7.0}), "case1", "rigid_body", condition=condition)
        for condition in plan.tuning.conditions
    ]
    assert flights[0].setup.sensing.delay == 0.02
    assert flights[0].setup.vehicle.mass == 2.064
    assert flights[0].setup.vehicle.rotor_time_constant == 0.03
    assert flights[0].setup.stages.position_controller.prediction.smoothing == 7.0
    assert flights[1].setup.vehicle.mass == 0.56
    assert flights[1].setup.stages.attitude_controller.torque.roll == 2.0
    assert flights[1].setup.stages.attitude_controller.switching == 1


@pytest.mark.parametrize("wrong", [[3], [{"simulator": 4}], [{"vehicle": "none such"}], [{"nobody": {"a": 1}}]])
def test_wrong_conditions_are_refused(tmp_path, wrong):
    asked = content()
    asked["tuning"]["conditions"] = wrong
    with pytest.raises(ParameterError, match="small"):
        read(tmp_path, asked)
