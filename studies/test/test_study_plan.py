"""The plan of a study: what is read, what is refused, and that the shipped one holds together."""

from pathlib import Path

import pytest
import study_plan
import yaml

from quad_core import plugins
from quad_core.parameters import ParameterError
from quad_flight import set_up

pytestmark = pytest.mark.skipif(
    "se3" not in plugins.names(plugins.POSITION_LAW), reason="plug-ins are not installed: run scripts/setup"
)


def content():
    return {
        "name": "small",
        "tuning": {
            "trials": 4, "tunings": 1, "seeds": [1, 2], "cases": ["case1"], "plants": ["rigid_body"],
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
        (lambda c: c["controllers"]["mine"].update(position="kite"), r"small.yaml: law: .*'kite'"),
        (lambda c: c["controllers"]["mine"].update(fixed={"recorder": {}}), "fixed.recorder"),
        (lambda c: c["controllers"]["mine"]["knobs"]["p"].update(high=1e9), r"knobs.p: found \[1.0, 1000000000.0\]"),
        (lambda c: c["controllers"]["mine"]["knobs"]["p"].update(low=5.0), r"found \[5.0, 4.0\]"),
        (
            lambda c: c["controllers"]["mine"]["knobs"]["p"].update(parameters=["xy.speed"]),
            "knobs.p: found pid.xy.speed",
        ),
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


@pytest.mark.parametrize(("place", "value", "expected"), [
    ("name", 3, "expected text"),
    ("tuning.trials", "many", r"found 'many' \(str\), expected an integer in \[1, 1000000000\]"),
    ("tuning.trials", -5, r"found -5, expected an integer in \[1, "),
    ("tuning.trials", 12.7, r"found 12.7 \(float\), expected an integer"),
    ("tuning.trials", True, r"found True \(bool\), expected an integer"),
    ("tuning.tunings", 0, r"found 0, expected an integer in \[1, "),
    ("tuning.seeds", 4, "found 4, expected a list of one value or more"),
    ("tuning.seeds", [], r"found \[\], expected a list of one value or more"),
    ("tuning.seeds", [1, "2"], r"found '2' \(str\), expected an integer"),
    ("tuning.cases", "case1", "found 'case1', expected a list of one value or more"),
    ("tuning.plants", [1], "found 1, expected text"),
    ("tuning.objective.rmse_scale", -1.0, r"found -1.0, expected a number in \[1e-12, "),
    ("tuning.objective.variation_scale", float("nan"), "found nan, expected a number"),
    ("tuning.objective.failure", "big", r"found 'big' \(str\), expected a number"),
    ("study.held_out_first", "1001", r"found '1001' \(str\), expected an integer"),
    ("study.start", 3, "found 3, expected text"),
    ("study.cases", "case2", "expected a list of one value or more"),
    ("study.resamples", 0, r"found 0, expected an integer in \[1, "),
    ("study.bootstrap_seed", -1, "found -1, expected an integer"),
    ("controllers.mine.title", 7, "expected text"),
    ("controllers.mine.position", 7, "expected text"),
    ("controllers.mine.parts", "help", "expected a list of one value or more"),
    ("controllers.mine.fixed", ["a"], r"found \['a'\], expected keys with values"),
    ("controllers.mine.fixed.attitude_controller", 3, "found 3, expected keys with values"),
    ("controllers.mine.knobs", 3, "found 3, expected keys with values"),
    ("controllers.mine.knobs.p.node", 3, "expected text"),
    ("controllers.mine.knobs.p.parameters", "xy.position", "expected a list of one value or more"),
    ("controllers.mine.knobs.p.low", "one", r"found 'one' \(str\), expected a number"),
    ("controllers.mine.knobs.p.log", "yes", "found 'yes', expected true or false"),
    ("parts", ["help"], r"found \['help'\], expected keys with values"),
])  # fmt: skip
def test_a_value_of_another_type_or_out_of_range_is_refused_with_its_key(tmp_path, place, value, expected):
    plan_content = body = content()
    *above, key = place.split(".")
    for name in above:
        body = body[name]
    body[key] = value
    with pytest.raises(ParameterError, match=rf"small.yaml: {place}[^ ]*: .*{expected}"):
        read(tmp_path, plan_content)


@pytest.mark.parametrize(
    ("node", "key", "message"),
    [
        (
            "position_controller",
            "feed_forwrd",
            r"parts.help.fixed.position_controller.feed_forwrd: found pid.feed_forwrd",
        ),
        ("attitude_controller", "prediction.enable", r"found prediction.enable, .*did you mean prediction.enabled"),
    ],
)
def test_a_wrong_parameter_is_named_with_its_part(tmp_path, node, key, message):
    plan_content = content()
    plan_content["parts"] = {"help": {"fixed": {node: {key: True}}}}
    plan_content["controllers"]["mine"]["parts"] = ["help"]
    with pytest.raises(ParameterError, match=message):
        read(tmp_path, plan_content)


def test_a_plan_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(ParameterError, match="expected paper or the path"):
        study_plan.find_plan("nothing")
    plan = read(tmp_path, content())
    with pytest.raises(ParameterError, match="no tuned gains"):
        study_plan.tuned_overrides(plan, plan.controllers[0], 1)


def test_gains_of_another_plan_are_refused(tmp_path):
    plan = read(tmp_path, content())
    (mine,) = plan.controllers
    path = study_plan.gains_file(plan, "mine", 1)
    path.parent.mkdir(parents=True)
    gains = "position_controller:\n  ros__parameters: {law: pid}\n"
    path.write_text(f"# tuning: {study_plan.tuning_mark(plan, mine)}\n{gains}")
    assert study_plan.tuned_overrides(plan, mine, 1) == {"position_controller": {"law": "pid"}}
    wider = content()
    wider["tuning"]["trials"] = 5
    other = read(tmp_path, wider)
    with pytest.raises(ParameterError, match=r"found gains of tuning .*, expected .*; tune again"):
        study_plan.tuned_overrides(other, other.controllers[0], 1)
    path.write_text(gains)
    with pytest.raises(ParameterError, match="found gains of tuning None"):
        study_plan.tuned_overrides(plan, mine, 1)


def test_the_shipped_plan_and_gains_fly_what_they_say():
    plan = study_plan.read_plan(study_plan.find_plan("paper"))
    assert plan.controllers[0].name == "proposed"
    assert len(plan.study.seeds(50)) == 50
    assert not set(plan.study.seeds(50)) & set(plan.tuning.seeds)
    limits = set()
    for controller in plan.controllers:
        gains = study_plan.tuned_overrides(plan, controller, 1)
        flight = study_plan.flight_of(gains, "case1", "rigid_body")
        assert flight.resolved["position_controller"].node.law == controller.position
        assert flight.resolved["attitude_controller"].node.law == controller.attitude
        limits.add((flight.setup.stages.position_controller.limits, flight.setup.stages.position_controller.speed))
        values = {**gains["position_controller"], **gains["attitude_controller"]}
        for knob in controller.knobs:
            assert {knob.low <= values[name] <= knob.high for name in knob.parameters} == {True}
    assert len(limits) == 1


@pytest.mark.parametrize(
    "name", ["ideal_plant", "laws_x500", "published", "real_x500", "real_paper", "real_crazyflie21"]
)
def test_shipped_plans_are_read(name):
    plan = study_plan.read_plan(Path(study_plan.__file__).with_name(f"{name}.yaml"))
    assert all(condition in plan.study.conditions for condition in plan.tuning.conditions)
    for controller in plan.controllers if plan.gains.is_dir() else ():
        for tuning in range(1, plan.tuning.tunings + 1):
            study_plan.tuned_overrides(plan, controller, tuning)


def test_parts_are_shared_and_a_controller_wins(tmp_path):
    asked = content()
    mine = asked["controllers"]["mine"]
    shared = {"fixed": {"attitude_controller": {"switching": "sign", "torque.roll": 2.0}}, "knobs": mine["knobs"]}
    asked["parts"] = {"shared": shared}
    mine |= {"parts": ["shared"], "knobs": {"p": {**mine["knobs"]["p"], "high": 3.0}}}
    (found,) = read(tmp_path, asked).controllers
    assert [(knob.name, knob.high) for knob in found.knobs] == [("p", 3.0), ("k", 1.0)]
    assert found.fixed["attitude_controller"] == {"itsm.switching": "layer", "itsm.torque.roll": 2.0}
    mine["parts"] = ["kite"]
    with pytest.raises(ParameterError, match=r"mine.parts: found 'kite', expected one of shared"):
        read(tmp_path, asked)


def test_conditions_act_in_every_flight_and_a_controller_wins(tmp_path):
    asked, mine = content(), tmp_path / "mine.yaml"
    x500 = set_up.shipped_file(set_up.VEHICLES, "x500").read_text()
    mine.write_text(x500 + "/**/px4_bridge:\n  ros__parameters: {airframe: {thrust_curve: 0.9}}\n")  # as identified
    asked["tuning"]["conditions"] = {
        "late": {"levels": ["delay", "lag"], "vehicle": str(mine), "simulator": {"rigid_body.mass_error": 0.1}},
        "rough": {"attitude_controller": {"itsm.torque.roll": 2.0, "itsm.switching": "sign"}, "levels": ["step"]},
    }
    asked["controllers"]["mine"]["fixed"]["position_controller"] = {"prediction.enabled": True}
    asked["controllers"]["mine"]["knobs"]["s"] = {
        "node": "position_controller", "parameters": ["prediction.smoothing"], "low": 1.0, "high": 30.0,
    }  # fmt: skip
    plan = read(tmp_path, asked)
    (mine,) = plan.controllers
    late, rough = (
        study_plan.flight_of(mine.overrides({"s": 7.0}), "case1", "rigid_body", condition=condition.overrides).setup
        for condition in plan.tuning.conditions
    )
    assert (late.sensing.delay, late.plant.mass_error) == (0.02, 0.1)
    assert (late.vehicle.mass, late.vehicle.rotor_time_constant) == (2.064, 0.03)
    assert late.stages.position_controller.prediction.smoothing == 7.0
    assert rough.vehicle.mass == 0.56
    assert rough.disturbance.events == "push start=20 force=2,0,0"
    assert rough.stages.attitude_controller.torque.roll == 2.0
    assert rough.stages.attitude_controller.switching == 1


@pytest.mark.parametrize(
    "wrong",
    [
        [], {}, {"a b": {}}, {"a": {"simulator": 4}}, {"a": {"vehicle": "none such"}}, {"a": {"nobody": {"a": 1}}},
        {"a": {"levels": ["flood"]}}, {"a": {"levels": ["step", "payload"]}},
    ],
)  # fmt: skip
@pytest.mark.parametrize("part", ["tuning", "study"])
def test_wrong_conditions_are_refused(tmp_path, part, wrong):
    asked = content()
    asked[part]["conditions"] = wrong
    with pytest.raises(ParameterError, match="small"):
        read(tmp_path, asked)


def test_every_level_flies(tmp_path):
    levels = yaml.safe_load(Path(study_plan.__file__).with_name("levels.yaml").read_text())
    asked = content()
    asked["study"]["conditions"] = {name: {"levels": [name], "vehicle": "x500"} for name in levels}
    plan = read(tmp_path, asked)
    flights = {
        name: study_plan.flight_of(plan.controllers[0].overrides({}), "hover", "rigid_body", condition=overrides)
        for name, overrides in plan.study.conditions
    }
    assert len({str((flight.setup, flight.modules)) for flight in flights.values()}) == len(levels)
