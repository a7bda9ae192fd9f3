"""A standby controller takes over in lockstep: the flight goes on, with the bits that it would have had."""

import os
import signal

import flying
import pytest
from takeovers import STANDBY, active_pid
from test_same_bits import alone, assert_same

pytestmark = pytest.mark.flight


def test_both_controllers_die_and_the_flight_has_the_same_bits(tmp_path):
    out = tmp_path / "bag"
    process = flying.start("hover", "--duration", "2", "--seed", "31", *STANDBY, "--out", out)
    part = out / "bag_0.mcap.part"
    flying.wait_until(lambda: part.exists() and part.stat().st_size > 60_000, 90.0, "the recording began")
    for role in ("attitude_controller", "position_controller"):
        os.kill(active_pid(process.pid, role), signal.SIGKILL)
    done = flying.finish(process)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "attitude_controller was killed by SIGKILL; the flight does not depend on it" in done.stderr
    bag = flying.open_flight(out)
    assert_same(bag, alone("hover", 2.0, 31, "rigid_body", "tuned"))
    kinds = [row["kind"] for row in bag.array("flight/events")]
    assert kinds.count("taken_over") == 2
    assert sorted(row["role"] for row in bag.array("flight/takeover")) == [
        "shadow_attitude_controller",
        "shadow_position_controller",
    ]
