"""MAVLink over UDP against an autopilot that refuses: modes, masks, reasons, landings, both autopilots, no ROS."""

import numpy as np
import pytest
from mavlink_flights import FakeAutopilot, Flight, hover

from quad_autopilot.evidence import Intent, Phase
from quad_autopilot.parameters import ArmingParameters

pytestmark = pytest.mark.unit
QUICK = {"arming": ArmingParameters(step_timeout=2.0)}
KINDS = {
    "px4": {"kind": "px4", "child_frame": 12, "drop": 0.03, "nan_every": 50},
    "ardupilot": {"kind": "ardupilot"},
    "ardupilot without boost": {"kind": "ardupilot", "angle_boost": 0, "stranger": True},
}


@pytest.mark.parametrize("options", KINDS.values(), ids=KINDS)
def test_from_the_ground_to_a_hover_and_back(options):
    with Flight(options) as flight:
        assert flight.run(Phase.FLY).phase == Phase.FLY, flight.output
        flight.fly(4.0)
        assert np.array(flight.state.p_w) == pytest.approx([0.0, 0.0, 1.0], abs=0.1)
        assert -flight.fake.body.p[2] == pytest.approx(1.0, abs=0.1)
        flight.intent = Intent.LAND
        output = flight.run(Phase.LANDED)
        assert (output.phase, output.reason) == (Phase.LANDED, "")
        assert flight.refusals == set()
        assert flight.fake.report["idle_broken"] == 0
        assert flight.events[-1] == "disarmed"
        beats = np.diff(flight.fake.report["heartbeats"])
        assert beats[1:] == pytest.approx(1.0, abs=0.1)  # one more when the autopilot is found
        assert bool(flight.rejected) == bool(options.get("nan_every"))


def test_targets_are_stamped_in_the_autopilot_s_time_and_stale_ones_are_refused():
    with Flight() as flight:
        flight.run(Phase.FLY)
        flight.fly(0.5)
        rows = np.array(flight.fake.report["targets"])
        assert np.abs(rows[:, 0] - 1e-3 * rows[:, 2]).max() < 0.1
        old = flight.sample._replace(timestamp_sample=1_000_000)
        flight.sample = old
        flight.bridge.send_attitude(hover(flight.state, 1.0))
        flight.fake.take()
        assert "stale" in flight.refusals


DENIED = {
    "preflight": (
        {"bad_preflight": True},
        {},
        [
            "did not arm",
            "temporarily rejected",
            "pre-flight checks fail",
            "Compass Sensor 0 missing and nothing else can be said",
        ],
    ),
    "mode": ({"refused": {"176": 2}}, {}, ["did not change to OFFBOARD", "DO_SET_MODE denied"]),
    "ardupilot": ({"kind": "ardupilot", "bad_preflight": True}, {}, ["ArduPilot did not arm", "failed", "Compass"]),
    "target": ({}, {"target_system": 7}, ["no HEARTBEAT", "`listen`"]),
    "thrust": ({"kind": "ardupilot", "guid_options": 0}, {}, ["GUID_OPTIONS: found 0", "climb rate"]),
}


@pytest.mark.parametrize("name", DENIED)
def test_what_the_autopilot_refuses_ends_with_its_reason(name):
    options, settings, words = DENIED[name]
    with Flight(options, **settings, **QUICK) as flight:
        output = flight.run(Phase.FLY)
        assert output.phase == Phase.RELEASED
        assert output.reason
        assert [word for word in words if word not in output.reason] == [], output.reason
        assert flight.fake.armed is False


def flying(options=None, **settings):
    flight = Flight(options, **settings)
    flight.run(Phase.FLY)
    return flight


@pytest.mark.parametrize("kind", ["px4", "ardupilot"])
def test_a_pilot_has_the_vehicle_within_one_heartbeat_and_nothing_is_asked_again(kind):
    with flying({"kind": kind, "pilot_after": 3.0}) as flight:
        output = flight.run(Phase.LANDED)
        taken = next(at for at, what in flight.fake.report["events"] if what == "pilot")
        assert f"a pilot or {flight.profile.name} took the vehicle in flight" in output.reason
        assert flight.fake.now - taken < 0.3
        sent = len(flight.fake.report["targets"])
        flight.fly(0.5)
        assert len(flight.fake.report["targets"]) <= sent + 1
        assert "command 21" not in flight.events


def test_dead_controllers_stop_the_stream_and_the_autopilot_lands():
    with flying() as flight:
        flight.fly(2.5)
        flight.commands, last = False, flight.fake.now
        output = flight.run(Phase.LANDED)
        assert "no command for" in output.reason
        after = [row for row in flight.fake.report["targets"] if row[0] > last + 0.05]
        assert len(after) == 1  # level, once: a stream would hold the mode
        assert after[0][0] - last < 0.1
        land = next(at for at, what in flight.fake.report["events"] if what == "command 21")
        assert land - last < 0.1
        assert flight.events[-1] == "disarmed"


def test_another_address_with_the_same_number_is_a_stranger():
    with flying() as flight:
        second = FakeAutopilot(flight.fake.peer[1], {})
        for _ in range(300):
            second.step()
            second.publish()
            second.socket.sendto(b"\xfd\xff", second.peer)  # the begin of a message of 255 bytes
            flight.tick()
        assert flight.bridge.link.strangers > 0
        assert flight.output.phase == Phase.FLY
        second.socket.close()
