"""kill -9 of recorders, shadow controllers and onlookers at random moments in lockstep: no step takes over 0.5 s.

``scripts/accept onlookers --each N``: N flights of four kills each, by default 25; the recorder is killed last, which
ends the flight by a landing.
"""

import os
import random
import signal
import subprocess
import sys
import threading
import time

from flying import LOW, domain_of, finish, start, stranger, wait_until_flying
from rclpy.executors import SingleThreadedExecutor

from quad_node.codec import head_of
from quad_node.topics import TOPICS

LIMIT = 0.5  # s
BEFORE = (0.05, 2.5)  # s between two kills: longer, too, than a recorder waits for a silent shadow
SHADOWS = ("--shadow", "position=aibs", "--shadow", "attitude=abfnitsm")
ROLE = "attitude_controller"
ONLOOKER = """
import rclpy
from quad_node import executor, topics
executor.init([])
node = rclpy.create_node("onlooker")
for name in ("state", "wrench_setpoint", "attitude_setpoint", "actuation"):
    entry = topics.TOPICS[name]
    node.create_subscription(entry.type, name, lambda payload: None, entry.qos(), raw=True)
print("ready", flush=True)
rclpy.spin(node)
"""


class Arrivals(threading.Thread):
    """When the state of each step arrives at a node that takes no part in the flight; s on the steady clock."""

    def __init__(self, domain):
        """Join ``domain``."""
        super().__init__()
        self.times, self._newest, self._ended = [], -1, threading.Event()
        self._domain = domain

    def run(self):
        """Receive states until ``end``."""
        entry = TOPICS["state"]
        with stranger(self._domain, "arrivals") as node:
            node.create_subscription(entry.type, "state", self._on_state, entry.qos(256), raw=True)
            executor = SingleThreadedExecutor(context=node.context)
            executor.add_node(node)
            while not self._ended.is_set():
                executor.spin_once(timeout_sec=0.1)

    def _on_state(self, payload):
        step = head_of(payload)[0]
        if step > self._newest:
            self._newest = step
            self.times.append(time.monotonic())

    def end(self):
        """Leave; return the longest time between two states, NaN without any."""
        self._ended.set()
        self.join()
        gaps = [later - earlier for earlier, later in zip(self.times, self.times[1:], strict=False)]
        return max(gaps, default=float("nan"))


def onlooker(domain):
    """Return a process that subscribes to four topics of a flight, once it is ready."""
    words = [sys.executable, "-c", ONLOOKER]
    started = subprocess.Popen(
        words, env={**os.environ, "ROS_DOMAIN_ID": str(domain)}, stdout=subprocess.PIPE, text=True
    )
    assert started.stdout.readline() == "ready\n"
    return started


def flown(out, draw):
    """Fly and kill two onlookers, a shadow and the recorder; return exit code, s of the longest step, states."""
    flight = start("hover", "--duration", "300", "--limits", "position_rmse=9", *LOW, *SHADOWS, "--out", out)
    pids = wait_until_flying(flight, out)
    domain = domain_of(flight.pid)
    arrivals = Arrivals(domain)
    arrivals.start()
    visitors = [onlooker(domain) for _ in range(2)]
    victims = [*(visitor.pid for visitor in visitors), pids[f"shadow_{ROLE}"]]
    draw.shuffle(victims)
    for pid in (*victims, pids["recorder"]):
        time.sleep(draw.uniform(*BEFORE))
        os.kill(pid, signal.SIGKILL)
    done = finish(flight)
    for visitor in visitors:
        visitor.communicate()
    return done, arrivals.end(), len(arrivals.times)


def run(figures):
    draw, worst, each = random.Random(1), 0.0, figures.each(25)
    for number in range(1, each + 1):
        done, longest, states = flown(figures.folder / str(number), draw)
        worst = max(worst, longest)
        named = done.returncode == 1 and "recorder was killed by SIGKILL" in done.stderr
        figures.check(
            named and states > 100,
            f"flight {number}: exit code {done.returncode}, recorder named: {named}; "
            f"{states} states seen, the longest step {longest:.3f} s",
        )
    figures.at_most(f"longest step of {each} flights with {4 * each} kills", worst, LIMIT, "s")
