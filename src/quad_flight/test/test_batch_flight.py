"""Flights of the real plug-ins: described like to the nodes, same bits in both engines, t = 0 met exactly."""

import numpy as np
import pytest

from quad_core import plugins
from quad_core.parameters import ParameterError
from quad_core.records import columns, from_rows, to_rows
from quad_core.types import Actuation, Rotors, Vec3, VehicleState
from quad_flight.flight import flight_from_files, flight_from_parameters, fly

needs_plugins = pytest.mark.skipif(
    not plugins.names(plugins.PLANT), reason="plug-ins are not installed: run scripts/setup"
)

pytestmark = needs_plugins


def case(name="case1", duration=1.0, **roles):
    overrides = {"trajectory": {"trajectory": name, f"{name}.duration": duration}}
    for role, values in roles.items():
        overrides.setdefault(role, {}).update(values)
    return flight_from_parameters(overrides)


@pytest.mark.parametrize("plant", ["rigid_body", "paper"])
@pytest.mark.parametrize("trajectory", ["case1", "case2"])
def test_flight_ends_finite_with_t_0_on_the_reference(plant, trajectory):
    result = fly(case(trajectory, 2.0, simulator={"plant": plant}))
    assert result.outcome == "ended"
    assert result.steps == result.end_step == round((result.trajectory_start + 2.0) * 500)
    times = result.topics["reference"]["trajectory_time"]
    assert 0.0 in times
    assert (times >= 0.0).sum() == 200
    for rows in result.topics.values():
        for name in rows.dtype.names:
            assert np.isfinite(rows[name]).all()
    assert result.rmse < 0.3


@pytest.mark.parametrize("plant", ["rigid_body", pytest.param("paper", marks=pytest.mark.long)])
def test_compiled_flight_has_the_same_bits(plant):
    flight = case("case2", 3.0, simulator={"plant": plant})
    plain, fast = fly(flight), fly(flight, compiled=True)
    assert plain._replace(topics={}) == fast._replace(topics={})
    assert set(plain.topics) == set(fast.topics)
    for name, rows in plain.topics.items():
        assert rows.dtype == fast.topics[name].dtype
        assert rows.tobytes() == fast.topics[name].tobytes(), name
    quiet = fly(flight, compiled=True, logging=False)
    assert quiet.score == plain.score
    assert quiet.topics == {}
    torque = np.abs(np.diff(plain.topics["wrench_setpoint"]["torque_b"], axis=0)).sum(axis=1)
    first = round(plain.trajectory_start * 500)
    # from the wrench before t = 0 on
    assert plain.score.torque_variation == pytest.approx(torque[first - 1 :].sum(), rel=1e-12)


def test_seed_decides_the_disturbance_and_nothing_else():
    one, two = (fly(case(duration=0.5)._replace(seed=seed)) for seed in (1, 2))
    again = fly(case(duration=0.5)._replace(seed=1))
    assert one.topics["truth"].tobytes() == again.topics["truth"].tobytes()
    assert one.topics["disturbance"].tobytes() != two.topics["disturbance"].tobytes()
    assert one.topics["reference"].tobytes() == two.topics["reference"].tobytes()


def test_shared_keys_reach_every_node():
    flight = flight_from_parameters({"/**": {"flight.seed": 9, "vehicle.mass": 0.7, "flight.plant_period": 1_000_000}})
    assert flight.seed == 9
    assert flight.setup.vehicle.mass == 0.7
    assert flight.setup.schedule.plant_period == 1_000_000


def test_parameter_files_are_those_of_the_nodes(tmp_path):
    first, second = tmp_path / "a.yaml", tmp_path / "b.yaml"
    first.write_text(
        "/**:\n  ros__parameters:\n    flight.seed: 3\n"
        "trajectory:\n  ros__parameters:\n    trajectory: hover\n    hover:\n      duration: 1.0\n"
    )
    second.write_text("/**:\n  ros__parameters:\n    flight.seed: 4\n")
    flight = flight_from_files([first, second], {"trajectory": {"hover.position.z": 1.0}})
    assert flight.seed == 4
    assert flight.setup.trajectory.duration == 1.0
    assert flight.setup.trajectory.position.z == 1.0


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        ({"pilot": {}}, "pilot: no such node"),
        ({"trajectory": {"trajectry": "hover"}}, "trajectry"),
        ({"trajectory": {"trajectory": "case1", "case1.duration": float("nan")}}, "case1.duration"),
        ({"simulator": {"flight.seed": 2}}, "flight.seed"),
        ({"position_controller": {"vehicle.mass": 1.0}}, "vehicle.mass"),
        ({"attitude_controller": {"law": "no_such_law"}}, "no_such_law"),
    ],
)
def test_what_the_nodes_refuse_is_refused(overrides, message):
    with pytest.raises((ParameterError, plugins.PluginError), match=message):
        flight_from_parameters(overrides)


def test_records_keep_every_number():
    rotors = Rotors(1.0, 2.0, 3.0, 4.0)
    items = [Actuation(rotors, rotors, 5.0, Vec3(6.0, 7.0, 8.0), False, True, False, True, False)] * 2
    rows = from_rows(Actuation, to_rows(Actuation, items))
    assert rows.shape == (2,)
    assert rows["rotor_speed"].tolist() == [[1.0, 2.0, 3.0, 4.0]] * 2
    assert rows["torque_b"].tolist() == [[6.0, 7.0, 8.0]] * 2
    assert rows["thrust_low"].tolist() == [True, True]
    assert rows["thrust_high"].tolist() == [False, False]
    assert [c.name for c in columns(VehicleState)] == list(VehicleState._fields)
    assert from_rows(VehicleState, to_rows(VehicleState, [])).shape == (0,)


def test_a_change_for_all_nodes_wins_over_the_files(tmp_path):
    path = tmp_path / "vehicle.yaml"
    path.write_text("/**:\n  ros__parameters: {vehicle: {mass: 0.6}}\n", encoding="utf-8")
    assert flight_from_files([path]).setup.vehicle.mass == 0.6
    flight = flight_from_files([path], {"/**": {"vehicle.mass": 0.7}})
    assert {node.vehicle.mass for node in flight.resolved.values()} == {0.7}
