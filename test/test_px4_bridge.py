"""The bridge to PX4 over the real wire against an autopilot that refuses: it arms, flies, lets go and lands."""

import subprocess
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from px4_flights import (
    BRIDGE,
    PERIODS,
    WHOLE,
    CrazyflieFlight,
    MavlinkFlight,
    cause,
    environment,
    flown,
    happened,
    in_hold,
    killed,
    when,
)
from vehicle_packages import vehicle_packages

from quad_analysis.tables import takeovers
from quad_flight_log.reader import open_flight

# an autopilot has a processor of its own
pytestmark = [pytest.mark.flight, pytest.mark.wall_clock]

ROUGH = {"drop": 0.03, "reorder": 0.02, "nan_every": 50, "reset_after": 3.0, "reset_by": 0.1}
LONG = "takeoff:2,hold:60,land"
REFUSED = {
    "bad preflight": (
        {"bad_preflight": True},
        (),
        ["did not arm", "temporarily rejected", "pre-flight checks fail", "attitude_invalid"],
    ),
    "mode denied": ({"refused": {"176": 2}}, (), ["did not change to offboard", "DO_SET_MODE denied"]),
    "wrong target": ({}, ("-p", "target_system:=7"), ["never acknowledged", "target_system"]),
}


def test_what_px4_refuses_ends_with_the_reason_and_nothing_armed(tmp_path):
    def fly(name):
        options, words, _ = REFUSED[name]
        folder = tmp_path / name.replace(" ", "_")
        return flown(folder, "px4", options, WHOLE, "-p", "arming.step_timeout:=3.0", *words)

    with ThreadPoolExecutor(2) as pool:
        for (name, (_, _, words)), ended in zip(REFUSED.items(), pool.map(fly, REFUSED), strict=True):
            assert ended.code == 1, ended.output
            assert all(word in cause(ended) for word in words), (name, ended.output)
            assert not [what for what in happened(ended) if "arming_state 2" in what]
            reported = "autopilot_reasons: PX4 in AUTO_LOITER reports against a flight: attitude_invalid"
            assert (reported in ended.output) == (name == "bad preflight")


def test_position_and_attitude_controller_fly_unchanged_and_each_number_arrives(tmp_path):
    ended = flown(tmp_path / "flight", "px4", {}, WHOLE, recorded=True)
    assert ended.code == 0, ended.output
    assert "[ERROR]" not in ended.output
    assert "given_up" not in ended.output
    assert "prediction of the bridge's mixer model" in ended.output
    assert ended.report["idle_broken"] == 0
    poses, landing = np.array(ended.report["poses"]), when(ended, "command 21")
    hover = poses[(poses[:, 0] * 1e-6 > landing - 1.0) & (poses[:, 0] * 1e-6 < landing)]
    assert np.abs(hover[:, 1:] - [0.0, 0.0, -2.0]).max() < 0.15
    assert happened(ended)[-1] == "disarmed"
    assert max(ended.report["heartbeats"]) < landing + 0.2
    bag = open_flight(tmp_path / "flight/bag")
    assert takeovers(bag) == []  # nor while PX4 lands
    assert not [name for name in bag.metadata if name.startswith("missing.")]  # states are 8 to 16 ms apart
    state = bag.array("state")
    assert {round(step) for step in np.diff(state["step"])} <= {2, 3, 4, 5, 6}
    rising = state[np.argmax(state["p_w"][:, 2] > 1.0)]
    origin = poses[np.argmin(np.abs(poses[:, 3] + rising["p_w"][2])), 0] - rising["stamp_ns"] // 1000
    asked = bag.array("wrench_setpoint")
    by_stamp = {round(row[0] - origin): row[1:] for row in ended.report["wrenches"] if row[1] > 0.0}
    both = [(row, by_stamp[row["stamp_ns"] // 1000]) for row in asked if row["stamp_ns"] // 1000 in by_stamp]
    assert len(both) > 0.8 * len(by_stamp) > 200
    for row, wire in both:
        force, torque = row["wrench"]["force"], row["wrench"]["torque"]
        assert wire[0] == pytest.approx(max(force["z"], 0.0), abs=1e-3)
        assert wire[1:] == pytest.approx([torque["x"], -torque["y"], -torque["z"]], abs=1e-4)


def test_a_dead_controller_stops_the_heartbeat_within_100_ms_and_px4_lands(tmp_path):
    ended = flown(tmp_path / "flight", "px4", {}, LONG, then=killed("attitude_controller"))
    assert ended.code == 1
    assert "attitude_controller" in ended.output
    land = when(ended, "command 21")
    last = max(at for at, _ in ended.report["setpoints"] if at < land - 0.02)
    assert max(ended.report["heartbeats"]) <= last + 0.1
    assert "offboard lost" not in happened(ended)  # PX4 was asked to land before it had to by itself
    assert happened(ended)[-1] == "disarmed"


def test_px4_lands_by_itself_when_the_bridge_is_killed(tmp_path):
    def act(flight):
        flight.processes["bridge"].kill()
        time.sleep(8.0)

    ended = flown(tmp_path / "flight", "px4", {}, LONG, "-p", "mode:=motors", then=in_hold(act))
    assert max(-pose[3] for pose in ended.report["poses"]) > 1.8
    assert "not NaN" not in str(happened(ended))
    assert 0.08 < when(ended, "offboard lost") - max(ended.report["heartbeats"]) < 0.4  # COM_OF_LOSS_T of the fake: 0.1
    assert happened(ended)[-1] == "disarmed"


OURS = ["-p", "mode:=attitude", "-p", "external_mode:=Case flight"]


def test_our_flight_is_a_mode_that_px4_lists_checks_and_flies_whatever_its_odometry_does(tmp_path):
    ended = flown(tmp_path / "flight", "px4", {"external": "accepted", **ROUGH}, WHOLE, *OURS)
    assert ended.code == 0, ended.output
    events = happened(ended)
    assert ended.report["names"][0] == "Case flight"
    assert "Case flight is EXTERNAL1 of PX4" in ended.output
    assert events.index("nav_state 23, arming_state 2") < events.index("nav_state 18, arming_state 2")
    assert "command 176" not in events  # offboard is not asked for
    assert ended.report["heartbeats"] == []
    assert events[-1] in ("disarmed", "unregistered")
    assert abs(min(pose[3] for pose in ended.report["poses"]) + 2.0) < 0.2
    assert "not NaN" not in str(events)
    assert "estimator_reset" in ended.output
    checks = np.array(ended.report["checks"])
    assert np.diff(checks[:, 0]).max() < 0.7  # each answered while it flew, but for one that was late


def test_a_pilot_selects_our_mode_and_leaves_it(tmp_path):
    options = {"external": "accepted", "selected_after": 6.0, "pilot_after": 5.0}
    ended = flown(tmp_path / "flight", "px4", options, LONG, *OURS, "-p", "chosen_by:=pilot", late=60.0)
    events = happened(ended)
    assert "command 100001" not in events  # the bridge does not choose
    assert events.index("selected") < events.index("nav_state 23, arming_state 2") < events.index("pilot")
    assert ended.code == 1
    assert "a pilot or PX4 took the vehicle in flight: mode POSCTL" in cause(ended)


def test_a_px4_that_lists_no_mode_for_a_pilot_to_choose_is_not_armed(tmp_path):
    ended = flown(tmp_path / "flight", "px4", {"external": ""}, WHOLE, *OURS, "-p", "chosen_by:=pilot")
    assert ended.code == 1
    assert "arming refused: external_mode Case flight: no register_ext_component_reply" in cause(ended)
    assert not [what for what in happened(ended) if what.startswith(("command", "nav_state"))]


@pytest.mark.parametrize(("external", "words"), [("", "no register_ext_component_reply"), ("refused", "refused")])
def test_a_px4_without_external_modes_is_flown_in_offboard_and_that_is_said(tmp_path, external, words):
    ended = flown(tmp_path / "flight", "px4", {"external": external}, "takeoff:1,land", *OURS)
    assert words in ended.output
    assert "flown in offboard instead" in ended.output
    assert "nav_state 14, arming_state 2" in happened(ended)


def test_what_cannot_fly_ends_with_one_line_and_2():
    given, roles = environment(), ["-p", "flight.roles:=simulator,commander"]
    mavlink, crazyflie = MavlinkFlight.owner, CrazyflieFlight.owner
    own = [path for path in given["PYTHONPATH"].split(":") if "px4_msgs" not in path]
    without = {**given, "PYTHONPATH": ":".join(own)}
    whole = {**without, "PYTHONPATH": ":".join([*own, str(vehicle_packages())])}
    known, thrust = ([*roles, *PERIODS, "-p", f"{key}max_rotor_thrust:=5.0"] for key in ("airframe.", ""))
    for bridge, found, words, named in (
        (BRIDGE, without, known, "px4_msgs: not found"),
        (BRIDGE, given, [*known, "-p", "flight.mode:=lockstep"], "flight.mode: found lockstep"),
        (BRIDGE, given, [*roles, *PERIODS], "airframe.max_rotor_thrust: found 0.0"),
        (BRIDGE, given, [*known, "-p", "external_mode:=Mine", "-p", "loss_limit:=0.0"], "expected mode attitude"),
        (BRIDGE, given, PERIODS, "found no commander, expected one: scripts/fly --mission takeoff:2,case2,hold:5,land"),
        (mavlink, without, thrust, "pymavlink: not found"),
        (mavlink, whole, [*roles, *PERIODS], "max_rotor_thrust: found 0.0"),
        (mavlink, whole, [*thrust, "-p", "listen:=here"], "listen: found 'here', expected host:port"),
        (crazyflie, without, thrust, "cflib: not found"),
    ):
        done = subprocess.run(
            [bridge, "--ros-args", *words], env=found, capture_output=True, text=True, timeout=60, check=False
        )
        assert done.returncode == 2, done.stderr
        assert len(done.stderr.splitlines()) == 1, done.stderr
        assert named in done.stderr
    shown = subprocess.run([BRIDGE, "--help"], env=given, capture_output=True, text=True, timeout=60, check=False)
    assert shown.returncode == 0
    assert "px4_bridge.md" in shown.stdout
