"""What a flight is asked to be, by names, and the files that ship."""

import re

import numpy as np
import pytest
import yaml

from quad_core import plugins
from quad_core.parameters import ParameterError, flatten
from quad_flight import flight, set_up

pytestmark = pytest.mark.skipif(
    not plugins.names(plugins.POSITION_LAW), reason="plug-ins are not installed: run scripts/setup"
)
LAWS = {
    "position_controller": (plugins.POSITION_LAW, "aibs"),
    "attitude_controller": (plugins.ATTITUDE_LAW, "abfnitsm"),
}


def uncommented(path):
    """Return the file with its commented gains in force."""
    return yaml.safe_load(path.read_text(encoding="utf-8").replace("\n    # ", "\n    "))


@pytest.mark.parametrize("role", LAWS)
def test_tuned_shows_the_defaults_of_the_papers_laws(role):
    group, law = LAWS[role]
    shown = uncommented(set_up.shipped_file(set_up.CONTROLLERS, "tuned"))[f"/**/{role}"]["ros__parameters"]
    assert shown.pop("preset") == "tuned"
    assert shown == {f"{law}.{name}": value for name, value in flatten(plugins.load(group, law).Parameters()).items()}


def test_a_flight_by_names():
    asked = flight.from_names("case2", preset="minimal", seed=7, duration=3.0, settings=["vehicle.mass=0.6"])
    assert asked.seed == 7
    assert asked.setup.vehicle.mass == 0.6
    assert asked.setup.trajectory.duration == 3.0
    assert asked.resolved["position_controller"].node.preset == "minimal"


def test_a_flight_says_which_vehicle_flies(tmp_path):
    def said(**choices):
        request = set_up.Request("hover", **choices)
        return set_up.vehicle_text(request, set_up.resolve_flight(request, {})["simulator"].vehicle)

    assert said(vehicle="x500") == "x500"
    assert said(settings=["vehicle.mass=0.6"]) == "paper (mass=0.6)"
    other = tmp_path / "other.yaml"
    other.write_text(set_up.shipped_file(set_up.VEHICLES, "x500").read_text(encoding="utf-8"), encoding="utf-8")
    assert re.fullmatch(r"paper \(1\d of its numbers are set elsewhere\)", said(scenario=str(other)))


def test_numbers_of_numpy_and_paths_are_numbers_and_texts(tmp_path):
    file = tmp_path / "vehicle.yaml"
    file.write_text("/**:\n  ros__parameters:\n    use_sim_time: true\n    vehicle:\n      mass: 0.7\n")
    asked = flight.from_names(
        "hover", vehicle=file, duration=np.float64(0.2), seed=np.int64(3), start=np.str_("printed")
    )
    assert (asked.seed, asked.setup.trajectory.duration, asked.setup.vehicle.mass) == (3, 0.2, 0.7)
    assert (
        flight.from_names("hover", duration=np.float32(0.5), realtime=np.bool_(False)).setup.trajectory.duration == 0.5
    )
    with pytest.raises(ParameterError, match=r"found array\(\[0.2, 0.3\]\)"):
        flight.from_names("hover", duration=np.array([0.2, 0.3]))


def test_what_ros2_param_dump_wrote_of_another_flight_is_taken_as_a_preset(tmp_path):
    """As ros2param writes it: every parameter of the node, rclpy's own among them, as nested keys."""
    before = set_up.resolve_flight(
        set_up.Request("case2", preset="minimal", mission="takeoff,land", realtime=True, seed=9),
        {"/**": {"flight.run_id": "a"}},
    )
    values = {field.name: field.default for field in before["attitude_controller"].all_fields()}
    values.update({"use_sim_time": False, "start_type_description_service": True})
    values["qos_overrides./clock.subscription.depth"] = 1
    dump = tmp_path / "dump.yaml"
    dump.write_text(yaml.safe_dump({"/attitude_controller": {"ros__parameters": values}}))
    found = set_up.resolve_flight(set_up.Request("case2", preset=dump), {})
    assert found["attitude_controller"].plugins == before["attitude_controller"].plugins
    assert found["attitude_controller"].flight == found["simulator"].flight
    setting = ["position_controller.use_sim_time=true"]
    assert (
        set_up.resolve_flight(set_up.Request("hover", settings=setting), {})["position_controller"].node.law == "aibs"
    )


@pytest.mark.parametrize("plant", ["rigid_body", "paper"])
@pytest.mark.parametrize("kind", ["wind velocity=4,0,0", "gust end=2 velocity=4,0,0", "freeze start=1 end=2", ""])
def test_a_wind_that_the_vehicle_does_not_feel_is_said(plant, kind):
    """By Eq. 1 wind of 10 m/s pushes by 10 * 0.00056 / 0.56 = 0.01 m/s^2, the x500 by 10 * 0.3 / 2.064 = 1.5 m/s^2."""
    settings = ["simulator.disturbance=timeline", f"simulator.timeline.events={kind}"]
    for vehicle, felt in (("paper", False), ("x500", True)):
        asked = set_up.Request("hover", vehicle=vehicle, plant=plant, settings=settings)
        said = set_up.unfelt_wind(set_up.resolve_flight(asked, {}))
        assert bool(said) == (not felt and kind.startswith(("wind", "gust")))


@pytest.mark.parametrize(("asked", "named"), [
    ({"case": "case1", "scenario": "flight", "mission": "takeoff,case1", "trajectory": "case1"}, "trajectory.case2.d"),
    ({"case": "case2", "scenario": "flight", "settings": ["simulator.disturbance=none"]}, "simulator.timeline.events"),
    ({"case": "case2", "scenario": "flight"}, ""),
])  # fmt: skip
def test_what_a_scenario_says_of_what_is_not_flown_is_left_out_and_said_and_the_rest_acts(asked, named):
    request = set_up.Request(**asked)
    said, nodes = set_up.left_out(request), set_up.resolve_flight(request, {})
    assert (named in said) == (bool(said) or not named)
    assert nodes["simulator"].plugins["sensing"].parameters.position_noise == 0.01
    assert nodes["trajectory"].plugins["trajectory"].name == asked["case"]


def test_gains_of_a_law_that_is_not_flown_are_refused_and_a_choice_that_is_missing_too(tmp_path):
    with pytest.raises(ParameterError, match=r"x500.yaml: aibs.*: its law is pid, not aibs"):
        set_up.resolve_flight(set_up.Request("hover", preset="x500", position="pid"), {})
    scenario = tmp_path / "windy.yaml"
    scenario.write_text("/**/simulator:\n  ros__parameters:\n    timeline.events: wind velocity=4,0,0\n")
    with pytest.raises(
        ParameterError, match=r"windy.yaml: timeline.events: .* disturbance is held_gaussian, not timeline"
    ):
        set_up.resolve_flight(set_up.Request("hover", scenario=scenario), {})


def test_a_choice_that_there_is_not_is_refused_with_those_that_there_are():
    with pytest.raises(ParameterError, match="from_names: found 'changes', expected one of preset, vehicle, plant"):
        flight.from_names("hover", changes={})


def test_the_shipped_files_are_found_without_ament():
    shipped = ["crazyflie21_real", "minimal", "paper_real", "printed", "tuned", "x500", "x500_real"]
    assert set_up.shipped_names(set_up.CONTROLLERS) == shipped
    with pytest.raises(ParameterError, match="expected crazyflie21_real, minimal, paper_real, printed, tuned, x500"):
        set_up.shipped_file(set_up.CONTROLLERS, "brave")


def test_an_owner_of_another_vehicle_gets_what_all_nodes_share_and_nothing_of_the_simulator():
    asked = flight.from_names("hover", vehicle="x500", settings=["flight.plant_period=4000000"])
    file = yaml.safe_load(set_up.parameter_file(asked.resolved, "red", ("px4_bridge",)))
    shared = file["/red/px4_bridge"]["ros__parameters"]
    assert (shared["flight.plant_period"], shared["vehicle.mass"]) == (4_000_000, 2.064)
    assert {name.partition(".")[0] for name in shared} == {"flight", "vehicle"}
    assert "/red/px4_bridge" not in yaml.safe_load(set_up.parameter_file(asked.resolved, "red"))


@pytest.mark.parametrize(("settings", "enabled"), [([], False), (["simulator.sensor.rate_delay=0.01"], True)])
def test_prediction_is_on_where_the_state_says_that_it_is_old(settings, enabled):
    nodes = set_up.resolve_flight(set_up.Request("case2", settings=settings), {})
    assert nodes["position_controller"].node.prediction.enabled == enabled
    assert nodes["attitude_controller"].node.prediction.enabled == enabled
    off = "attitude_controller.prediction.enabled=false"
    assert not set_up.resolve_flight(set_up.Request("case2", settings=[*settings, off]), {})[
        "attitude_controller"
    ].node.prediction.enabled


def test_case_2_with_ten_milliseconds_of_delay_and_nothing_set_keeps_12_mm():
    delayed = flight.from_names("case2", duration=6.0, settings=["simulator.sensor.delay=0.01"])
    assert flight.fly(delayed).rmse < 0.012
