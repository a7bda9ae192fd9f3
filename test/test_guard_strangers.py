"""A stranger's wrenches and plans in real time: refused, counted and named, while the controller flies on."""

import re
import time

import pytest
from flying import PATIENT, finish, start, stranger, wait_until, wait_until_flying
from geometry_msgs.msg import WrenchStamped

from quad_flight_log.bag.reader import open_flight
from quad_msgs.msg import FlightPlan
from quad_node.conversion import set_stamp
from quad_node.topics import latched, stream

pytestmark = pytest.mark.flight

SECONDS = 2.0


def wrench(thrust, stamp_ns):
    message = WrenchStamped()
    message.header.frame_id = "base_link"
    message.wrench.force.z = thrust
    set_stamp(message.header.stamp, stamp_ns)
    return message


def test_wrenches_and_plans_of_a_stranger_change_nothing(tmp_path):
    out = tmp_path / "bag"
    flight = start("hover", "--realtime", "--duration", "8", "--limits", "position_max=5", *PATIENT, "--out", out)
    domain = int(re.search(r"ROS_DOMAIN_ID=(\d+)", flight.stdout.readline())[1])
    wait_until_flying(flight, out)
    with stranger(domain) as node:
        out_again = node.create_publisher(WrenchStamped, "wrench_setpoint", stream(10))
        plans = node.create_publisher(FlightPlan, "flight/plan", latched(2))
        wait_until(lambda: out_again.get_subscription_count() >= 1, 20.0, "the simulator")
        wait_until(lambda: plans.get_subscription_count() >= 1, 20.0, "the simulator")
        for end_step in (1, 2**63):
            plans.publish(FlightPlan(trajectory="stranger", start="printed", end_step=end_step))
            time.sleep(1.5)  # events of one kind are a second apart
        began = time.monotonic()
        sent = 0
        while time.monotonic() - began < SECONDS:
            # 100 m/s^2 up, for a step that is over and for one that is yet to come
            for message in (wrench(50.0, 2_000_000), wrench(50.0, 60_000_000_000)):
                out_again.publish(message)
                sent += 1
            time.sleep(0.01)
        done = finish(flight)
    assert done.returncode == 0, done.stdout + done.stderr
    bag = open_flight(out)
    guard = bag.array("flight/guard")
    assert not guard["mode"].any()
    assert int(guard["refused_commands"][-1]) > 0.5 * sent
    events = bag.array("flight/events")
    texts = [str(text) for text in events["text"][events["kind"] == "guard_refused"]]
    refused = [str(text) for text in events["text"][events["kind"] == "rejected_plan"]]
    assert any("end_step 1, " in text for text in refused), refused
    assert any(f"end_step {2**63}, " in text for text in refused), refused
    assert any("not newer than the last" in text for text in texts), texts
    assert any("ahead of the vehicle's time" in text for text in texts), texts
