"""A node without a standby that was killed in flight and started again: it stays silent, and the vehicle lands."""

import time

import flying
import pytest
from takeovers import active_pid, killed_and_started_again

pytestmark = pytest.mark.flight

ATTITUDE = "attitude_controller"


def details(bag, role):
    """Return what ``role`` said on flight/nodes."""
    return [row["detail"] for row in bag.array("flight/nodes") if row["role"] == role]


@pytest.mark.parametrize(
    ("role", "words"),
    [
        (ATTITUDE, ["hover", "--duration", "60"]),
        # begun anew it would be DISARMED, and the motors off
        ("commander", ["--mission", "takeoff,hold:60,land"]),
    ],
)
def test_a_node_that_was_started_again_stays_silent(tmp_path, role, words):
    out = tmp_path / "bag"
    # patient, so that the plant still waits when the new process is there
    process = flying.start(*words, "--set", "simulator.answer_timeout=6.5", "--out", out)
    flying.wait_until_flying(process, out)
    time.sleep(2.0)
    with killed_and_started_again(active_pid(process.pid, role), tmp_path / "again.log") as again:
        done = flying.finish(process)
        assert again.wait(20.0) == 1
    assert f"the flight is under way without {role}; this process stays silent" in (tmp_path / "again.log").read_text()
    assert done.returncode == 1, done.stdout + done.stderr
    bag = flying.open_flight(out)
    assert f"{role} does not answer" in bag.metadata["reason"]
    assert [said for said in details(bag, role) if "under way without" in said]
    lost = int(bag.metadata["reason"].partition("answer step ")[2].partition(":")[0])
    given = {ATTITUDE: "wrench_setpoint", "commander": "flight/mode"}[role]
    assert int(bag.array(given)["stamp_ns"].max()) < lost * 2_000_000
    assert "motors stopped" not in done.stderr
