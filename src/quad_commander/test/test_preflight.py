"""Arming: a good vehicle is armed, and each thing that is wrong is refused by name."""

import math

import pytest
from builtin_interfaces.msg import Time

from quad_commander import preflight
from quad_commander.parameters import CommanderParameters, Fence
from quad_core.flight_parameters import FlightParameters
from quad_core.geometry import quaternion_from_euler
from quad_core.types import Vec3, VehicleState
from quad_msgs.msg import AutopilotStatus, FlightPlan, NodeStatus
from quad_node.responder import Sample

GOOD = VehicleState()
BOX = {"low": [-1.0, -1.0, 0.0], "high": [1.0, 1.0, 3.0]}
PLAN = BOX | {"speed": 2.0, "acceleration": 1.5, "tilt": 0.2, "end": Time(sec=60)}

LOOKED_AT = ("states", "unmatched", "battery", "autopilot", "is_first_look")


@pytest.fixture
def refusals():
    """Return a function that gives the reasons after a second on the ground, with what is told being wrong."""

    def look(state=GOOD, run_id="a1", nodes=(), plans=(PLAN,), drift=0.0, **changed):
        seen = {"setpoints": 100, "wrenches": 500, "states": 500, "unmatched": (), "battery": 0.9, "autopilot": None}
        seen |= {"is_first_look": False} | changed
        looked = preflight.Preflight(FlightParameters(run_id=run_id), CommanderParameters())
        sample = Sample(500, 1_000_000_000, state, 0.01)
        looked.begin(sample._replace(step=0), 0)
        for status in ({"role": "position_controller", "period_steps": 5}, {"role": "attitude_controller"}, *nodes):
            known = {"node": f"/{status['role']}", "run_id": "a1", "period_steps": 1}
            looked.on_node(NodeStatus(**{**known, **status}))
        for plan in plans:
            looked.on_plan(FlightPlan(**plan), flying=False)
        for topic, count in (("attitude_setpoint", seen["setpoints"]), ("wrench_setpoint", seen["wrenches"])):
            for _ in range(count):
                looked.count(topic)
        for step in range(0, 501, 5):
            moved = state._replace(p_w=Vec3(drift * step * 0.002, 0.0, 0.0))
            looked.note(sample._replace(step=step, state=moved))
        return looked.refusals(sample, *(seen[name] for name in LOOKED_AT))

    return look


def test_a_good_vehicle_is_armed(refusals):
    assert refusals() == []
    assert refusals(battery=None) == []
    assert refusals(plans=(PLAN, PLAN)) == [], "the same plan again is no second one"


def test_a_vehicle_flown_by_attitude_needs_no_torque():
    flight = FlightParameters(run_id="a1", roles="simulator,trajectory,position_controller,commander")
    looked = preflight.Preflight(flight, CommanderParameters())
    sample = Sample(500, 1_000_000_000, GOOD, 0.01)
    looked.begin(sample._replace(step=0), 0)
    found = looked.refusals(sample, 500, (), None)
    assert not [text for text in found if "wrench" in text]
    assert [text for text in found if "attitude_setpoint" in text] == []


def tilted(degrees):
    return GOOD._replace(q_wb=quaternion_from_euler(Vec3(math.radians(degrees), 0.0, 0.0)))


def plan(**changes):
    return {"plans": ({**PLAN, **changes},)}


@pytest.mark.parametrize(("changes", "reason"), [
    ({"run_id": "", "nodes": ()}, "flight.run_id is empty"),
    ({"nodes": [{"role": "x", "run_id": "b2"}]}, "run ids: found 'b2' too, expected 'a1' alone"),
    ({"setpoints": 79}, "attitude_setpoint: found 79.0 Hz, expected 80.0 to 120.0 Hz"),
    ({"wrenches": 601}, "wrench_setpoint: found 601.0 Hz, expected 400.0 to 600.0 Hz"),
    ({"states": 105}, "state: found samples 9.52 ms apart, expected 1.00 to 4.00 ms"),
    ({"states": 1100}, "state: found samples 0.91 ms apart"),
    ({"state": tilted(15.1)}, "tilt: found 15.1 deg, expected less than 15.0 deg"),
    ({"drift": 0.11}, "state: the estimate moves while the vehicle stands: found its position at 0.11 m/s"),
    ({"drift": math.nan}, "state: the estimate moves while the vehicle stands: found its position at nan m/s"),
    ({"state": GOOD._replace(v_w=Vec3(0.11, 0.0, 0.0))}, "state: the estimate moves while the vehicle stands"),
    ({"state": GOOD._replace(omega_b=Vec3(0.11, 0.0, 0.0))}, "body rate: found 0.11 rad/s"),
    ({"state": GOOD._replace(ground_z=3.0)}, "plan: found it outside the fence at (-1.0, -1.0, 0.0) m"),
    ({"battery": 0.29}, "battery: found 29 %, expected at least 30 %"),
    ({"plans": ()}, "plan: found none"),
    ({"plans": (PLAN, {**PLAN, "speed": 1.0})}, "plan: found 2 different ones"),
    (plan(high=[0.0, 0.0, 121.0]), "plan: found it outside the fence at (0.0, 0.0, 121.0) m"),
    (plan(speed=10.1), "plan: found a speed of 10.10 m/s, expected at most 10.00 m/s"),
    (plan(acceleration=math.inf), "plan: found an acceleration of inf m/s^2"),
    (plan(tilt=0.9), "plan: found a tilt of 0.90 rad"),
    (plan(end=Time(sec=1_000_000_000)), "plan: found a duration of 1000000000.00 s"),
    (plan(end=Time(sec=-1)), "plan: found a duration of -1.00 s"),
    ({"autopilot": AutopilotStatus(mode="STABILIZED", reasons="no GPS")}, "autopilot: found it disarmed in STABILIZED"),
])  # fmt: skip
def test_each_fault_is_refused_by_name(refusals, changes, reason):
    found = [text for text in refusals(**changes) if changes.get("run_id") != "" or not text.startswith("run ids")]
    assert len(found) == 1
    assert found[0].startswith(reason)


def test_no_state_since_the_checks_began_is_a_reason_of_its_own(refusals):
    looked = preflight.Preflight(FlightParameters(run_id="a1"), CommanderParameters())
    looked.on_plan(FlightPlan(**PLAN), flying=False)
    sample = Sample(500, 1_000_000_000, GOOD, 0.01)
    looked.note(sample)
    looked.begin(sample, 7)
    assert looked.refusals(sample, 7, (), None)[0] == "state: found none since the checks began, expected some"


def test_all_reasons_are_named_at_once(refusals):
    assert len(refusals(state=tilted(40.0), battery=0.0, plans=(), unmatched=("one publisher",))) == 4


def test_who_names_no_run_is_nobody(refusals):
    assert refusals(nodes=[{"role": "recorder", "run_id": ""}]) == []


def test_a_node_of_another_run_counts_until_it_leaves_whatever_its_name(refusals):
    other = {"role": "position_controller", "run_id": "b2", "period_steps": 7}
    refused = ["run ids: found 'b2' too, expected 'a1' alone"]
    assert refusals(nodes=[other]) == refused, "and its period is not taken for ours"
    assert refusals(nodes=[other, {**other, "run_id": "a1", "period_steps": 5}]) == refused
    assert refusals(nodes=[other, {**other, "state": NodeStatus.DONE}]) == []


def test_a_node_without_a_period_has_no_rate(refusals):
    (found,) = refusals(nodes=[{"role": "position_controller", "period_steps": 0}])
    assert found == "attitude_setpoint: found 100.0 Hz, expected 0.0 to 0.0 Hz"


def test_whether_the_estimate_rests_is_looked_at_before_an_autopilot_is_armed_and_not_after(refusals):
    (moves,) = refusals(autopilot=AutopilotStatus(), drift=0.2, is_first_look=True)
    assert "the estimate moves" in moves
    assert refusals(autopilot=AutopilotStatus(), is_first_look=True) == []
    assert refusals(autopilot=AutopilotStatus(armed=True), drift=0.2) == []


def test_an_autopilot_sends_states_at_its_own_rate(refusals):
    armed = AutopilotStatus(armed=True)
    assert refusals(autopilot=armed, states=100, wrenches=100) == []
    assert len(refusals(autopilot=armed, states=100, wrenches=300)) == 1


@pytest.mark.parametrize(("position", "ground", "is_outside"), [
    (Vec3(0.0, 0.0, 0.0), 0.0, False),
    (Vec3(100.0, -100.0, 50.0), 0.0, False),
    (Vec3(100.1, 0.0, 0.0), 0.0, True),
    (Vec3(0.0, 0.0, -1.1), 0.0, True),
    (Vec3(0.0, math.nan, 0.0), 0.0, True),
    (Vec3(0.0, 0.0, -13.0), -13.2, False),
    (Vec3(0.0, 0.0, 107.0), -13.2, True),
])  # fmt: skip
def test_the_fence_is_a_box_above_the_ground_and_what_is_not_a_number_is_outside(position, ground, is_outside):
    assert Fence().excludes(position, ground) == is_outside
