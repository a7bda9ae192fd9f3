"""What each node can be resolved: shared and own names, presets, plug-ins by name, and nodes that must agree."""

import pytest

from quad_core import plugins
from quad_core.cascade import ROLES
from quad_core.parameters import ParameterError, flatten
from quad_core.resolution import check_agreement, resolve
from quad_core.vehicle import Vehicle

pytestmark = pytest.mark.skipif(
    not plugins.names(plugins.PLANT), reason="plug-ins are not installed: run scripts/setup"
)


@pytest.mark.parametrize("role", ROLES)
def test_a_node_that_is_told_nothing_has_the_defaults(role):
    resolved = resolve(role, {})
    assert resolved.vehicle == Vehicle()
    assert resolved.node == ROLES[role].parameters()
    assert (resolved.flight.seed, resolved.flight.plant_period) == (1, 2_000_000)
    assert set(resolved.plugins) == set(ROLES[role].slots)
    for plugin in resolved.plugins.values():
        assert flatten(plugin.parameters) == flatten(plugin.module.Parameters)


def test_each_name_reaches_its_own_set():
    resolved = resolve(
        "position_controller", {"flight.seed": 7, "vehicle.mass": 0.8, "period_steps": 10, "aibs.y.position_gain": 3.5}
    )
    assert (resolved.flight.seed, resolved.vehicle.mass, resolved.node.period_steps) == (7, 0.8, 10)
    law = resolved.plugins["law"].parameters
    assert (law.x.position_gain, law.y.position_gain, law.z.position_gain) == (4.25, 3.5, 4.25)
    values = {field.name: field.default for field in resolved.all_fields()}
    assert values["flight.seed"] == 7
    assert values["vehicle.mass"] == 0.8
    assert values["period_steps"] == 10
    assert values["aibs.y.position_gain"] == 3.5


def test_single_values_win_over_the_preset():
    resolved = resolve("position_controller", {"preset": "printed", "aibs.limits.tilt": 0.5})
    law = resolved.plugins["law"].parameters
    assert law.limits.tilt == 0.5
    assert law.anti_windup is False
    assert law.x.initial_gain == 1.0


@pytest.mark.parametrize(("role", "overrides", "words"), [
    ("simulator", {"plnt": "paper"}, ["plnt", "simulator", "rigid_body.*"]),
    ("simulator", {"paper.substeps": 2}, ["paper.substeps", "simulator", "rigid_body.*"]),
    ("simulator", {"rigid_body.substep": 2}, ["rigid_body.substep", "unknown", "substeps"]),
    ("simulator", {"vehicle.mass": 0.0}, ["vehicle.mass", "0.0", "0.001"]),
    ("trajectory", {"flight.seed": -1}, ["flight.seed", "-1"]),
    ("trajectory", {"flight.mode": "fast"}, ["flight.mode", "fast", "lockstep, realtime"]),
    ("trajectory", {"law": "aibs"}, ["law", "trajectory"]),
    ("recorder", {"ack_steps": 0}, ["ack_steps", "0"]),
    ("position_controller", {"preset": "wild"}, ["preset", "wild", "aibs", "minimal"]),
    ("attitude_controller", {"abfnitsm.roll.power": float("nan")}, ["abfnitsm.roll.power", "nan"]),
])  # fmt: skip
def test_what_a_node_does_not_have_is_refused_by_name(role, overrides, words):
    with pytest.raises(ParameterError) as caught:
        resolve(role, overrides)
    assert all(word in str(caught.value) for word in words), caught.value


@pytest.mark.parametrize(
    ("key", "value", "expected"), [("flight.seed", 2, "1"), ("vehicle.mass", 0.7, "0.56"), ("flight.run_id", "b", "''")]
)
def test_nodes_of_one_flight_must_agree(key, value, expected):
    flight = {role: resolve(role, {}) for role in ROLES}
    check_agreement(flight)
    flight["recorder"] = resolve("recorder", {key: value})
    with pytest.raises(ParameterError) as caught:
        check_agreement(flight)
    assert all(word in str(caught.value) for word in ("recorder", key, repr(value), expected))
