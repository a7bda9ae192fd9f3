"""Flights that must not pass as good, each written into a bag with one thing wrong: the judge names it."""

import math

import numpy as np
import pytest
import yaml
from flight_samples import message, over, stamp, wrench_of, write_bag

from quad_analysis.flight_checks import failed_checks, judgement
from quad_analysis.metrics import FlightMetrics
from quad_analysis.tables import measured, truth_note
from quad_flight_log.notes import STOPPED
from quad_flight_log.reader import open_flight

pytestmark = pytest.mark.unit

STEPS = 500
UPRIGHT = (0.0, 0.0, 0.0, 1.0)
LEANING = (math.sin(math.radians(35.0)), 0.0, 0.0, math.cos(math.radians(35.0)))  # 70 deg about x


def pose(kind_stamp, height=1.0, q=UPRIGHT, y=0.0):
    return message(
        "quad_msgs/msg/VehicleState", stamp=kind_stamp, p_w=np.array([0.0, y, height]), q_wb=np.array(q, dtype=float)
    )


def wrench(step, thrust):
    return wrench_of(stamp(step), thrust)


def status(run_id):
    return message("quad_msgs/msg/NodeStatus", node="/n", role="trajectory", run_id=run_id)


def hover(place=pose, thrust=lambda _: 10.0, end=2):
    """Return a second of hover at 1 m as messages; ``place`` and ``thrust`` may differ from step to step.

    ``end``: the last state of the flight, 1: it flies on.
    """
    found = [("/flight/nodes", status("test")), over(STEPS - 1, end)]
    for k in range(STEPS):
        found.append(("/truth", place(stamp(k)) if place is pose else place(k)))
        found.append(("/wrench_setpoint", wrench(k, 10.0)))
        found.append(("/actuation", message("quad_msgs/msg/Actuation", stamp=stamp(k), thrust=thrust(k))))
        if k % 5 == 0:
            point = message("quad_msgs/msg/TrajectoryPoint", stamp=stamp(k), p_w=np.array([0.0, 0.0, 1.0]))
            found.append(("/reference", point))
    return found


def without(messages, topic, wanted):
    """Return ``messages`` without those of ``topic`` whose number among them is in ``wanted``."""
    count, found = -1, []
    for name, sample in messages:
        count += name == topic
        if not (name == topic and count in wanted):
            found.append((name, sample))
    return found


def flight_of(tmp_path, messages, guard=None, **notes):
    values = {"/simulator": {"ros__parameters": {f"guard.{name}": value for name, value in (guard or {}).items()}}}
    said = {"role": "simulator", "node": "/simulator", "parameters": yaml.safe_dump(values)}
    flown = [("/flight/parameters", message("quad_msgs/msg/NodeParameters", **said)), *messages] if guard else messages
    return open_flight(write_bag(tmp_path / "bag", flown, notes={"mode": "realtime", **notes}))


@pytest.mark.parametrize("mode", ["lockstep", "realtime"])
def test_a_good_flight_passes(tmp_path, mode):
    flight = flight_of(tmp_path, hover(), mode=mode)
    assert failed_checks(flight) == []
    assert judgement(flight, measured(flight), {}).verdict == "good"


def test_nodes_of_two_runs_are_refused_and_an_empty_id_is_none(tmp_path):
    ours, topic = hover(), "/flight/nodes"
    assert failed_checks(flight_of(tmp_path / "empty", [*ours, (topic, status(""))])) == []
    found = failed_checks(flight_of(tmp_path / "other", [*ours, (topic, status("other"))]))
    assert found == ["messages of 2 runs: 'other', 'test'"]


def test_two_different_messages_with_one_stamp_are_refused_and_a_repeat_is_not(tmp_path):
    ours = hover()
    assert failed_checks(flight_of(tmp_path / "repeat", [*ours, ("/wrench_setpoint", wrench(7, 10.0))])) == []
    strange = [("/wrench_setpoint", wrench(k, 0.0)) for k in (7, 9)]
    found = failed_checks(flight_of(tmp_path / "strange", [*ours, *strange]))
    assert found == ["different messages with equal stamps (wrench_setpoint: 2): more than one sender"]


@pytest.mark.parametrize(
    ("mode", "topic", "lost", "fault"),
    [
        ("lockstep", "/actuation", [250], "missing messages (actuation: 1)"),
        ("realtime", "/actuation", range(100, 250), ""),  # a late plant skips steps that nobody could record
        ("realtime", "/truth", range(100, 340), ""),
        ("realtime", "/truth", range(100, 360), "nothing of the vehicle for 0.52 s from 0.20 s on"),
    ],
)
def test_missing_steps_are_refused_in_lockstep_and_a_long_gap_in_real_time(tmp_path, mode, topic, lost, fault):
    found = failed_checks(flight_of(tmp_path, without(hover(), topic, lost), mode=mode))
    assert found == ([fault] if fault else [])


@pytest.mark.parametrize(
    ("place", "word"),
    [
        (lambda k: pose(stamp(k), q=LEANING if k >= 100 else UPRIGHT), "tilt above 60 deg for 0.80 s from 0.20 s on"),
        (lambda k: pose(stamp(k), y=0.01 * k), "4.99 m outside of all that was commanded"),
        (lambda k: pose(stamp(k), height=1.0 - 0.02 * k), "9.98 m outside of all that was commanded, from 0.25 s on"),
    ],
)
def test_a_vehicle_out_of_its_envelope_is_refused(tmp_path, place, word):
    # 70 deg for 0.8 s; 4.99 m beside the reference; 9.98 m below where it began, at 0.25 s more than 2.5 m
    (found,) = failed_checks(flight_of(tmp_path, hover(place)))
    assert word in found


def test_a_short_lean_or_a_raised_limit_passes(tmp_path):
    def lean(first):
        return hover(lambda k: pose(stamp(k), q=LEANING if first <= k < first + 140 else UPRIGHT))

    assert failed_checks(flight_of(tmp_path / "short", lean(100))) == []
    long = hover(lambda k: pose(stamp(k), q=LEANING if k >= 100 else UPRIGHT))
    assert failed_checks(flight_of(tmp_path / "raised", long, {"tilt.large": 1.4})) == []


@pytest.mark.parametrize(("height", "refused"), [(1.0, True), (0.31, True), (0.29, False)])
def test_motors_that_stop_in_the_air_are_refused(tmp_path, height, refused):
    flown = hover(lambda k: pose(stamp(k), height=height), thrust=lambda k: 0.0 if 300 <= k < 400 else 10.0)
    found = failed_checks(flight_of(tmp_path, flown))
    assert found == (["motors stopped 0.60 s after the start, above 0.3 m, for 0.20 s"] if refused else [])


def test_height_counts_from_the_ground(tmp_path):
    flown = hover(thrust=lambda k: 0.0 if k >= 300 else 10.0)
    assert failed_checks(flight_of(tmp_path, flown, {"ground_height": 0.8})) == []


def test_a_reference_that_the_vehicle_cannot_follow_is_named(tmp_path):
    text = "1.20 m from the reference and no nearer for 2.0 s, at the tilt limit of aibs"
    said = {"stamp": stamp(400), "node": "/position_controller", "kind": "infeasible_reference", "text": text}
    other = {**said, "kind": "late", "text": "something else"}
    events = [("/flight/events", message("quad_msgs/msg/FlightEvent", **one)) for one in (other, said)]
    assert failed_checks(flight_of(tmp_path / "other", [*hover(), events[0]])) == []
    (found,) = failed_checks(flight_of(tmp_path / "named", hover() + events))
    assert found == f"the reference asked for more than the vehicle has: {text}, at 0.80 s"


def test_a_failed_flight_that_ends_in_the_air_is_named(tmp_path):
    flight = flight_of(tmp_path, hover(), outcome="failed", reason="attitude_controller does not answer")
    assert failed_checks(flight) == [
        "the flight ended with the vehicle 1.00 m above the ground: motors stopped in the air"
    ]
    low = hover(lambda k: pose(stamp(k), height=0.2))
    assert failed_checks(flight_of(tmp_path / "low", low, outcome="failed")) == []


@pytest.mark.parametrize("how", ["killed", "stopped"])
def test_where_a_bag_ends_before_its_flight_no_motor_has_stopped(tmp_path, how):
    """The recorder was killed, or stopped, at 1 m; the flight went on and landed."""
    notes = {} if how == "killed" else {"outcome": "failed", "reason": STOPPED}
    flight = open_flight(
        write_bag(tmp_path / "bag", hover(end=1), close=how == "stopped", notes={"mode": "realtime", **notes})
    )
    assert flight.truncated == (how == "killed")
    *cut, found = failed_checks(flight)
    assert [fault.startswith("the bag is cut") for fault in cut] == [True] * flight.truncated
    assert found == "the bag ends at 1.00 s, before the flight: what came after is not recorded"
    judged = judgement(flight, measured(flight), {})
    assert judged.verdict == ("unknown" if how == "killed" else "failed")
    assert "motors" not in judged.text
    notes = {"mode": "realtime", "outcome": "failed", "reason": STOPPED}
    assert failed_checks(open_flight(write_bag(tmp_path / "over", hover(), notes=notes))) == []


def test_where_a_commander_flew_the_end_is_on_the_ground(tmp_path):
    modes = [("/flight/mode", message("quad_msgs/msg/FlightMode", stamp=stamp(k), mode=3)) for k in range(STEPS)]
    (found,) = failed_checks(flight_of(tmp_path, [*hover(), *modes]))
    assert "1.00 m above the ground" in found


def test_flights_without_a_guard_show_what_the_law_does(tmp_path):
    crash = hover(lambda k: pose(stamp(k), height=1.0 - 0.02 * k, q=LEANING), thrust=lambda _: 0.0)
    assert failed_checks(flight_of(tmp_path, crash, {"enabled": False})) == []


def on_estimate(off, node="/joined_plant"):
    """Return a hover whose truth is ``off`` m above what an autopilot's estimate says."""
    place = [("/state", pose(stamp(k))) for k in range(STEPS)]
    owner = message("quad_msgs/msg/NodeParameters", role="simulator", node=node, parameters="")
    return [*hover(lambda k: pose(stamp(k), height=1.0 + off)), *place, ("/flight/parameters", owner)]


def test_laws_that_fly_on_an_autopilots_estimate_are_judged_by_it_and_its_error_is_said(tmp_path):
    flight = flight_of(tmp_path, on_estimate(3.0))
    assert measured(flight).position_max == 0.0
    assert failed_checks(flight) == []
    note = truth_note(flight)
    assert "it was 3.000 m (RMSE), at most 3.000 m, from truth" in note
    assert "truth was 3.000 m (RMSE) from the reference" in note
    simulated = flight_of(tmp_path / "simulated", on_estimate(3.0, "/simulator"))
    assert measured(simulated).position_max == pytest.approx(3.0)
    assert truth_note(simulated) == ""


def test_the_ground_is_where_it_is_and_not_where_an_estimate_has_it(tmp_path):
    low = flight_of(tmp_path, on_estimate(-0.9), outcome="failed")
    assert failed_checks(low) == []


@pytest.mark.parametrize("owner", ["px4_bridge", "mavlink_bridge", "joined_plant", "simulator"])
def test_who_hands_over_to_an_autopilot_need_not_be_down_at_the_end_of_the_bag(tmp_path, owner):
    high = flight_of(tmp_path, on_estimate(0.5, f"/quad1/{owner}"), outcome="failed")
    assert bool(failed_checks(high)) == (owner == "simulator")
    assert ("1.50 m above the ground" in str(failed_checks(high))) == (owner == "simulator")


def test_wrenches_that_are_not_finite_are_left_out_and_said(tmp_path):
    strange = [("/wrench_setpoint", wrench(STEPS + k, thrust)) for k, thrust in enumerate((math.nan, math.inf, 1e12))]
    flight = flight_of(tmp_path, [*hover(), *strange])
    clean = flight_of(tmp_path / "clean", hover())
    assert measured(flight).thrust_effort == measured(clean).thrust_effort
    assert truth_note(flight).startswith("wrench_setpoint: 3 messages with a number that is not finite")
    assert failed_checks(flight) == []


def test_a_flown_path_with_numbers_that_are_none_is_read_and_refused(tmp_path):
    strange = [("/truth", pose(stamp(STEPS + k), height)) for k, height in enumerate((math.nan, math.inf, 1e12))]
    flight = flight_of(tmp_path, [*hover(), *strange])
    clean = flight_of(tmp_path / "clean", hover())
    assert measured(flight).position_max == measured(clean).position_max
    assert truth_note(flight).startswith("truth: 3 messages with a number that is not finite")
    assert failed_checks(flight) == ["truth: 3 messages with a number that is not finite or absurd"]


@pytest.mark.parametrize(("mode", "name"), [(1, "descend"), (200, "mode 200")])
def test_a_flight_that_the_guard_took_over_is_not_good(tmp_path, mode, name):
    what = {"stamp": stamp(300), "mode": mode, "since": 300, "reason_text": "no good wrench"}
    flight = flight_of(tmp_path, [*hover(), ("/flight/guard", message("quad_msgs/msg/GuardStatus", **what))])
    text = f"the guard took over at step 300 ({name}): no good wrench"
    assert judgement(flight, FlightMetrics(), {}).text == f"Failed: {text}"
