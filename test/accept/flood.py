"""A stranger sends 10,000 old wrenches a second to a hover in real time: what is refused, and how the flight ends."""

import re
import tempfile
import threading
import time
from pathlib import Path

import numpy as np
from figures import Figures
from flying import finish, start, stranger, wait_until, wait_until_flying
from geometry_msgs.msg import WrenchStamped

from quad_core.types import Vec3, Wrench
from quad_flight_log.bag.reader import open_flight
from quad_guard import guard
from quad_node.codec import pack_wrench
from quad_node.topics import stream

RATE = 10_000  # 1/s
SECONDS = 5.0
BURST = 0.005  # s


def flood(domain):
    """Send for ``SECONDS``; returns how many messages a second went out."""
    payload, sent = pack_wrench(Wrench(50.0, Vec3(0.0, 0.0, 0.0)), 2_000_000), 0
    with stranger(domain) as node:
        out = node.create_publisher(WrenchStamped, "wrench_setpoint", stream(10))
        wait_until(lambda: out.get_subscription_count() >= 1, 20.0, "the simulator")
        began = time.monotonic()
        while (now := time.monotonic() - began) < SECONDS:
            for _ in range(int(now * RATE) - sent):
                out.publish(payload)
                sent += 1
            time.sleep(BURST)
        return sent / (time.monotonic() - began)


def main():
    figures = Figures()
    with tempfile.TemporaryDirectory(prefix="flood-") as folder:
        out = Path(folder, "bag")
        flight = start("hover", "--realtime", "--duration", "20", "--limits", "position_max=5", "--out", out)
        domain = int(re.search(r"ROS_DOMAIN_ID=(\d+)", flight.stdout.readline())[1])
        wait_until_flying(flight, out)
        time.sleep(3.0)
        rates = []
        sender = threading.Thread(target=lambda: rates.append(flood(domain)))
        sender.start()
        sender.join(60.0)
        done = finish(flight)
        bag = open_flight(out)
        rows, truth = bag.array("flight/guard"), bag.array("truth")
        refused = int(rows["refused_commands"].max())
        figures.check(
            bool(rates), f"sent {rates[0] if rates else 0:.0f} messages a second, {refused} refused by the guard"
        )
        modes = sorted({guard.MODES[mode] for mode in rows["mode"]})
        speed = float(np.linalg.norm(truth["v_w"][-1]))
        figures.check(guard.MODES[guard.KILL] not in modes, f"guard: {', '.join(modes)}; exit code {done.returncode}")
        figures.at_most("speed of the last state", speed, 1.5, "m/s")
        # two messages of one stamp: the judge refuses the flight, and so it should
        said = [line for line in done.stderr.splitlines() if line.startswith("fly: hover: ")]
        figures.check(
            done.returncode == 1 and any("wrench_setpoint" in line for line in said),
            f"the verdict names the topic: {'; '.join(said) or 'nothing said'}",
        )
        figures.check(not bag.truncated, f"the bag is whole: {bag.metadata.get('reason', '') or 'flown to its end'}")
    return figures.code()
