"""The bridge over the real wire against an autopilot that refuses: it arms, flies, lets go and lands as it must."""

import signal
import subprocess
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from ament_index_python.packages import get_package_prefix
from flying import LONGEST
from px4_flights import BRIDGE, PERIODS, VEHICLE, CrazyflieFlight, Flight, MavlinkFlight, environment
from vehicle_packages import vehicle_packages

from quad_flight_log.analysis.takeovers import takeovers
from quad_flight_log.bag.reader import open_flight

# an autopilot has a processor of its own
pytestmark = [pytest.mark.flight, pytest.mark.wall_clock]

ALONE = ["-p", "flight.roles:=simulator", "-p", "arming.step_timeout:=6.0"]
WAITING = [*ALONE, "-p", "arming.first_command:=10.0"]  # armed on the ground, without controllers
ROUGH = {"drop": 0.03, "reorder": 0.02, "nan_every": 50, "reset_after": 3.0, "reset_by": 0.1}
ON_GROUND = {
    "bad preflight": ({"bad_preflight": True}, ALONE),
    "mode denied": ({"refused": {"176": 2}}, ALONE),
    "wrong target": ({}, [*ALONE, "-p", "target_system:=7"]),
    "spacing": ({}, [*ALONE, "-p", "flight.plant_period:=10000000"]),
    "large reset": ({"reset_after": 1.5, "reset_by": 1.0}, WAITING),
}
NODES = {"trajectory": ["-p", "trajectory:=hover", "-p", "hover.duration:=2.0"], "position_controller": []}
BOTH = {**NODES, "attitude_controller": []}


@pytest.fixture(scope="module")
def given():
    return environment()


def airborne(folder, given, options, mode, nodes, *bridge):
    """Return a flight whose nodes all run."""
    roles = ["-p", "flight.roles:=" + ",".join(["simulator", *nodes])]
    flight = Flight(folder, given, options, *roles, "-p", f"mode:={mode}", *bridge)
    for role, words in nodes.items():
        period = ["-p", "period_steps:=2"] if role != "recorder" else ["-p", f"directory:={folder / 'bag'}"]
        flight.node(role, *roles, *period, *words)
    return flight


def flown(*arguments):
    """Return how a flight of ``airborne`` ended."""
    with airborne(*arguments) as flight:
        return flight.end()


@pytest.fixture(scope="module")
def on_ground(given, tmp_path_factory):
    """Return how each flight of ``ON_GROUND`` ended; three at a time."""
    folder = tmp_path_factory.mktemp("ground")

    def fly(item):
        name, (options, words) = item
        with Flight(folder / name.replace(" ", "_"), given, options, *words) as flight:
            return name, flight.end()

    with ThreadPoolExecutor(3) as pool:
        return dict(pool.map(fly, ON_GROUND.items()))


def cause(ended):
    """Return why the flight failed, as the bridge said it."""
    return next(line for line in ended.output.splitlines() if "flight_failed" in line)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("bad preflight", ["did not arm", "temporarily rejected", "pre-flight checks fail", "local_position_invalid"]),
        ("mode denied", ["did not change to offboard", "DO_SET_MODE denied"]),
        ("wrong target", ["never acknowledged", "target_system"]),
        ("spacing", ["arming refused", "8 ms", "10 ms"]),
    ],
)
def test_what_px4_refuses_ends_with_the_reason_and_nothing_armed(on_ground, name, words):
    ended = on_ground[name]
    assert ended.code == 1, ended.output
    assert all(word in cause(ended) for word in words), ended.output
    if name == "bad preflight":
        assert "autopilot_reasons: PX4 in AUTO_LOITER reports against a flight: local_position_invalid" in ended.output
    assert not [what for _, what in ended.report["events"] if "arming_state 2" in what]


def test_an_estimate_that_jumps_far_ends_in_a_landing(on_ground):
    ended = on_ground["large reset"]
    assert ended.code == 1
    assert "jumped by 1.00 m" in cause(ended)
    assert [what for _, what in ended.report["events"] if what == "command 21"]
    assert ended.report["events"][-1][1] == "disarmed"


def test_position_and_attitude_controller_hover_unchanged_and_px4_lands(given, tmp_path):
    ended = flown(tmp_path / "flight", given, {}, "wrench", {**BOTH, "recorder": []})
    assert ended.code == 0, ended.output
    assert "[ERROR]" not in ended.output
    assert "given_up" not in ended.output
    assert "prediction of the bridge's mixer model" in ended.output
    assert ended.report["idle_broken"] == 0
    poses = np.array(ended.report["poses"])
    landing = next(at for at, what in ended.report["events"] if what == "command 21")
    hover = poses[(poses[:, 0] * 1e-6 > landing - 1.0) & (poses[:, 0] * 1e-6 < landing)]
    assert np.abs(hover[:, 1:] - [0.0, 0.0, -2.0]).max() < 0.15
    assert ended.report["events"][-1][1] == "disarmed"
    assert max(ended.report["heartbeats"]) < landing + 0.2
    bag = open_flight(tmp_path / "flight/bag")
    assert takeovers(bag) == []  # nor while PX4 lands
    assert not [name for name in bag.metadata if name.startswith("missing.")]  # states are 8 to 16 ms apart
    assert {round(step) for step in np.diff(bag.array("state")["step"])} <= {2, 3, 4, 5, 6}
    asked, made = bag.array("wrench_setpoint"), np.array(ended.report["wrenches"])
    made = made[made[:, 1] > 0.0]  # idle before the flight
    origin = made[0, 0] - asked["stamp_ns"][0] // 1000
    by_stamp = {round(row[0] - origin): row[1:] for row in made}
    both = [(row, by_stamp[row["stamp_ns"] // 1000]) for row in asked if row["stamp_ns"] // 1000 in by_stamp]
    assert len(both) > 0.8 * len(asked) > 200
    for row, wire in both:
        force, torque = row["wrench"]["force"], row["wrench"]["torque"]
        assert wire[0] == pytest.approx(max(force["z"], 0.0), abs=1e-3)
        assert wire[1:] == pytest.approx([torque["x"], -torque["y"], -torque["z"]], abs=1e-4)


@pytest.mark.long
def test_the_other_modes_hover_through_drops_reorder_nan_and_a_small_reset(given, tmp_path):
    kinds = {"motors": ({}, BOTH), "attitude": (ROUGH, NODES)}
    with ThreadPoolExecutor(2) as pool:
        runs = {
            mode: pool.submit(flown, tmp_path / mode, given, kind[0], mode, kind[1]) for mode, kind in kinds.items()
        }
    for mode, run_ in runs.items():
        found = run_.result()
        assert found.code == 0, (mode, found.output)
        assert "not NaN" not in str(found.report["events"])
        assert abs(min(pose[3] for pose in found.report["poses"]) + 2.0) < 0.2, mode
        assert ("estimator_reset" in found.output) == (mode != "motors")


def test_a_dead_controller_stops_the_heartbeat_within_100_ms_and_px4_lands(given, tmp_path):
    with airborne(tmp_path / "flight", given, {}, "wrench", BOTH) as flight:
        flight.wait_for("actuation_predicted")
        time.sleep(2.0)
        flight.processes[-1].send_signal(signal.SIGKILL)
        ended = flight.end()
    assert ended.code == 1
    assert "attitude_controller does not answer" in cause(ended)
    land = next(at for at, what in ended.report["events"] if what == "command 21")
    last = max(at for at, _ in ended.report["setpoints"] if at < land - 0.02)
    assert max(ended.report["heartbeats"]) <= last + 0.1
    assert "offboard lost" not in str(ended.report["events"])  # PX4 was asked to land before it had to by itself
    assert ended.report["events"][-1][1] == "disarmed"


def test_px4_lands_by_itself_when_the_bridge_dies_and_is_told_to_when_it_is_stopped(given, tmp_path):
    def fly(name):
        with Flight(tmp_path / name, given, {}, *WAITING) as flight:
            flight.wait_for("actuation_predicted")
            flight.bridge.send_signal(signal.Signals[name])
            code = flight.bridge.wait(30.0)
            time.sleep(2.0)
            return name, flight.stop(code)

    with ThreadPoolExecutor(2) as pool:
        ended = dict(pool.map(fly, ("SIGKILL", "SIGINT")))
    killed, stopped = ended["SIGKILL"].report, ended["SIGINT"].report
    lost = next(at for at, what in killed["events"] if what == "offboard lost")
    assert 0.08 < lost - max(killed["heartbeats"]) < 0.4  # COM_OF_LOSS_T of the fake is 0.1 s
    assert ended["SIGINT"].code == 1
    assert "command 21" in [what for _, what in stopped["events"]]
    assert "offboard lost" not in str(stopped["events"])
    for report in (killed, stopped):
        assert report["events"][-1][1] == "disarmed"


OURS = ["-p", "external_mode:=Case flight"]


def test_our_flight_is_a_mode_that_px4_lists_checks_and_flies(given, tmp_path):
    options = {"external": "accepted"}
    ended = flown(tmp_path / "flight", given, options, "attitude", NODES, *OURS)
    assert ended.code == 0, ended.output
    events = [what for _, what in ended.report["events"]]
    assert ended.report["names"][0] == "Case flight"
    assert "Case flight is EXTERNAL1 of PX4" in ended.output
    assert events.index("nav_state 23, arming_state 2") < events.index("nav_state 18, arming_state 2")
    assert "command 176" not in events  # offboard is not asked for
    assert ended.report["heartbeats"] == []
    assert events[-1] in ("disarmed", "unregistered")
    assert abs(min(pose[3] for pose in ended.report["poses"]) + 2.0) < 0.2
    checks = np.array(ended.report["checks"])
    assert np.diff(checks[:, 0]).max() < 0.7  # each answered while it flew, but for one that was late


def test_a_pilot_selects_our_mode_and_leaves_it(given, tmp_path):
    options = {"external": "accepted", "selected_after": 4.0, "pilot_after": 3.0}
    ended = flown(tmp_path / "flight", given, options, "attitude", NODES, *OURS, "-p", "chosen_by:=pilot")
    events = [what for _, what in ended.report["events"]]
    assert "command 100001" not in events  # the bridge does not choose
    assert events.index("selected") < events.index("nav_state 23, arming_state 2") < events.index("pilot")
    assert ended.code == 1
    assert "a pilot or PX4 took the vehicle in flight: mode POSCTL" in cause(ended)


@pytest.mark.parametrize(("external", "words"), [("", "no register_ext_component_reply"), ("refused", "refused")])
def test_a_px4_without_external_modes_is_flown_in_offboard_and_that_is_said(given, tmp_path, external, words):
    with Flight(tmp_path / "flight", given, {"external": external}, *ALONE, "-p", "mode:=attitude", *OURS) as flight:
        ended = flight.end()
    assert words in ended.output
    assert "flown in offboard instead" in ended.output
    assert "nav_state 14, arming_state 2" in [what for _, what in ended.report["events"]]


def checked(folder, given, *bridge):
    """Return the exit code and the output of check_plant on the bridge."""
    period = ["-p", "flight.roles:=simulator,attitude_controller", "-p", "flight.plant_period:=8000000"]
    with Flight(folder, given, {}, *period, *bridge) as flight:
        check = Path(get_package_prefix("quad_dynamics"), "lib", "quad_dynamics", "check_plant")
        code = flight.start("check", [check, "--ros-args", "--params-file", VEHICLE, *PERIODS, *period]).wait(LONGEST)
    return code, (folder / "check.log").read_text("utf-8")


def test_climb_and_doublets_have_the_right_sign_axis_and_size_and_a_turned_yaw_is_seen(given, tmp_path):
    turned = [
        word
        for rotor, km in enumerate((-0.016, -0.016, 0.016, 0.016))
        for word in ("-p", f"airframe.rotor{rotor}.km:={km}")
    ]
    with ThreadPoolExecutor(2) as pool:
        right = pool.submit(checked, tmp_path / "right", given, "-p", "mode:=motors")
        wrong = pool.submit(checked, tmp_path / "wrong", given, "-p", "mode:=motors", *turned)
    code, output = right.result()
    assert code == 0, output
    code, output = wrong.result()
    assert code == 1, output
    assert "FAIL  torque +z" in output
    assert "ok    torque +x" in output


def test_what_cannot_fly_ends_with_one_line_and_2(given):
    mavlink, crazyflie = MavlinkFlight.owner, CrazyflieFlight.owner
    own = [path for path in given["PYTHONPATH"].split(":") if "px4_msgs" not in path]
    without = {**given, "PYTHONPATH": ":".join(own)}
    whole = {**without, "PYTHONPATH": ":".join([*own, str(vehicle_packages())])}
    known, thrust = (
        [*PERIODS, "-p", "airframe.max_rotor_thrust:=5.0"],
        [*ALONE, *PERIODS, "-p", "max_rotor_thrust:=5.0"],
    )
    for bridge, found, words, named in (
        (BRIDGE, without, known, "px4_msgs: not found"),
        (BRIDGE, given, [*known, "-p", "flight.mode:=lockstep"], "flight.mode: found lockstep"),
        (BRIDGE, given, PERIODS, "airframe.max_rotor_thrust: found 0.0"),
        (BRIDGE, given, [*known, *OURS], "external_mode: found 'Case flight'"),
        (mavlink, without, thrust, "pymavlink: not found"),
        (mavlink, whole, [*ALONE, *PERIODS], "max_rotor_thrust: found 0.0"),
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
