"""Flights of the real plug-ins: described like to the nodes, t = 0 met exactly."""

import numpy as np
import pytest

from quad_core import plugins
from quad_core.parameters import ParameterError
from quad_flight.flight import flight_from_parameters, fly

pytestmark = pytest.mark.skipif(
    not plugins.names(plugins.PLANT), reason="plug-ins are not installed: run scripts/setup"
)


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
    torque = np.abs(np.diff(result.topics["wrench_setpoint"]["torque_b"], axis=0)).sum(axis=1)
    # from the wrench before t = 0 on
    first = round(result.trajectory_start * 500) - 1
    assert result.score.torque_variation == pytest.approx(torque[first:].sum(), rel=1e-12)


def test_seed_decides_the_disturbance_and_nothing_else():
    one, two = (fly(case(duration=0.5)._replace(seed=seed)) for seed in (1, 2))
    again = fly(case(duration=0.5)._replace(seed=1))
    assert one.topics["truth"].tobytes() == again.topics["truth"].tobytes()
    assert one.topics["disturbance"].tobytes() != two.topics["disturbance"].tobytes()
    assert one.topics["reference"].tobytes() == two.topics["reference"].tobytes()


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
