"""Missions over the real wire to each vehicle: whole, and with what pilots, links, batteries and estimators do."""

import signal
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from flying import flown as landed
from px4_flights import VEHICLES, WHOLE, cause, flown, happened, in_hold, killed, when

from quad_core.enumerations import Mode

# an autopilot has a processor of its own
pytestmark = [pytest.mark.flight, pytest.mark.wall_clock]

LONG = "takeoff:2,hold:60,land"
LATER = 7.0
"""Seconds in our mode after which something happens: in the air, in HOLD."""
FAULTS = {
    "pilot": ({"pilot_after": LATER}, LONG, "took the vehicle in flight"),
    "lost link": ({"silent_after": LATER}, LONG, "nothing for|no good state|state older"),
    "frozen state": ({"frozen_after": LATER}, LONG, "state: frozen"),
    "low battery": ({"battery_after": LATER}, LONG, "battery"),
    "reset": ({"reset_after": LATER, "reset_by": 3.0}, "takeoff:2,hold:5,land", "the estimate jumped by 3.00 m"),
    "Ctrl-C": ({}, LONG, "SIGINT"),
    "commander killed": ({}, LONG, "commander does not answer: flight/mode older than 0.5 s"),
}
GOOD = {"reset"}
"""Faults that a mission survives, or that end it as planned."""


ACTS = {
    "Ctrl-C": in_hold(lambda flight: flight.bridge.send_signal(signal.SIGINT)),
    "commander killed": killed("commander"),
}


GROUNDED = {
    "fence": (("-p", "fence.low.x:=50.0"), "not armed: plan: found it outside the fence"),
    "battery": (("-p", "arming.battery:=1.0"), "not armed: battery: found"),
    "Ctrl-C": (("-p", "arming.battery:=1.0"), "simulator was asked to end by SIGINT"),
}
"""{what speaks against a take-off: how the commander is set, what is said}."""


@pytest.fixture(scope="module", params=VEHICLES)
def missions(request, tmp_path_factory):
    """Return a vehicle and how its flights ended: the whole mission and each of FAULTS, two at a time."""
    top = tmp_path_factory.mktemp(request.param)
    flights = {"whole": ({}, WHOLE, ""), **FAULTS}
    with ThreadPoolExecutor(2) as pool:
        runs = {
            name: pool.submit(flown, top / name.replace(" ", "_"), request.param, options, mission, then=ACTS.get(name))
            for name, (options, mission, _) in flights.items()
        }
        return request.param, {name: run.result() for name, run in runs.items()}


def heights(ended, vehicle):
    """Return stamps in s and true heights in m."""
    poses = np.array(ended.report["poses"])
    return (1e-3 * poses[:, 0], poses[:, 3]) if vehicle == "crazyflie" else (1e-6 * poses[:, 0], -poses[:, 3])


def height_at(ended, vehicle, moment):
    """Return the true height in m at which ``moment`` happened."""
    stamps, height = heights(ended, vehicle)
    return height[np.argmin(np.abs(stamps - when(ended, moment)))]


def test_a_mission_takes_off_holds_and_lands(missions):
    vehicle, flights = missions
    ended = flights["whole"]
    assert ended.code == 0, ended.output
    assert happened(ended)[-1] == "disarmed"
    assert 1.8 < heights(ended, vehicle)[1].max() < 2.3
    assert not ended.report.get("idle_broken")
    assert not ended.report.get("refusals")


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_in_the_middle_ends_on_the_ground_or_with_a_pilot_and_is_named(missions, name):
    vehicle, flights = missions
    ended = flights[name]
    said = ended.output
    assert any(words in said for words in FAULTS[name][2].split("|")), said
    assert (ended.code == 0) == (name in GOOD), said
    if name == "pilot":
        taken = when(ended, "pilot")
        assert not [what for at, what in ended.report["events"] if at > taken and "command" in what]
        sent = [*ended.report.get("heartbeats", []), *(row[0] for row in ended.report.get("setpoints", []))]
        assert vehicle != "px4" or max(sent) < taken + 0.1
    elif (vehicle, name) == ("crazyflie", "lost link"):  # it lands by itself, and nothing can disarm it then
        assert happened(ended)[-1].startswith("land to 0"), said
    else:
        assert happened(ended)[-1] == "disarmed", said
        if name != "lost link":  # its last pose is that of its last message
            assert height_at(ended, vehicle, "disarmed") < 0.1


@pytest.mark.parametrize(
    ("vehicle", "name"),
    [*(("px4", name) for name in GROUNDED), *((name, "fence") for name in VEHICLES if name != "px4")],
)
def test_a_take_off_that_is_refused_ends_with_the_reason_and_nothing_armed(tmp_path, vehicle, name):
    def interrupt(flight):
        flight.wait_for("flying")
        flight.bridge.send_signal(signal.SIGINT)

    settings, words = GROUNDED[name]
    late, then = (60.0, interrupt) if name == "Ctrl-C" else (3.0, None)
    ended = flown(tmp_path / "flight", vehicle, {}, WHOLE, then=then, late=late, commander=settings)
    assert ended.code == 1, ended.output
    assert words in cause(ended), ended.output
    assert not [what for what in happened(ended) if "arming_state 2" in what or what.startswith("armed")]


@pytest.mark.long
def test_a_mission_on_mujoco_takes_off_flies_holds_and_lands(tmp_path):
    mission = ("--mission", "takeoff:1,hover,hold:1,land", "--duration", "2", "--set", "trajectory.hover.position.z=1")
    bag = landed(*mission, "--plant", "mujoco", "--out", tmp_path / "bag")
    height, mode = bag.array("truth")["p_w"][:, 2], bag.array("flight/mode")["mode"]
    assert 0.95 < height.max() < 1.1
    assert abs(height[-1]) < 0.01
    assert mode[-1] == Mode.DISARMED


def test_a_landing_of_ours_is_disarmed_on_the_ground(tmp_path):
    ended = flown(tmp_path / "ours", "px4", {}, "takeoff:1.5,hold:1,land", "-p", "arming.landing:=ours")
    assert ended.code == 0, ended.output
    assert "command 21" not in happened(ended)
    assert height_at(ended, "px4", "disarmed") < 0.05


def test_the_autopilots_own_take_off_is_flown_on_by_us(tmp_path):
    ended = flown(tmp_path / "climb", "px4", {}, "takeoff:3,hold:2,land", "-p", "arming.takeoff:=autopilot")
    assert ended.code == 0, ended.output
    events = happened(ended)
    assert events.index("command 22") < events.index("took off") < events.index("nav_state 18, arming_state 2")
    assert 2.7 < heights(ended, "px4")[1].max() < 3.4
