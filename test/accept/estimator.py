"""An estimator as real ones are: a process that receives the simulator's `odom` and sends `est/odom`, with faults.

Usage: python estimator.py KEY=VALUE ..., the keys of ``Faults``; it runs until it is ended.
"""

import math
import random
import sys
import time
from collections import deque
from contextlib import suppress
from copy import deepcopy
from typing import NamedTuple

import rclpy
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from rclpy.executors import ExternalShutdownException
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile, qos_profile_sensor_data
from spoiled import CHANGES

from quad_node.executor import SPIN_TIMEOUT, settle

WALL_CLOCK = 1_764_000_000_000_000_000  # ns
STALE = 1000 * 10**9  # ns
HALF_STEP = 1e6  # ns: a sample is that of the nearest plant step, what is left of its jitter is in its stamp
PRIORITY = 41  # of SCHED_FIFO, as the nodes of a flight in real time have: an estimator is no later than they are


JUMPS = {"jump": (3.0, 0.0), "jump in height": (0.0, 0.8), "small jump": (0.2, 0.0)}
STAMPS = {
    "zero stamps": lambda ns: 0,
    "whole seconds": lambda ns: ns // 10**9 * 10**9,
    "another clock": lambda ns: ns + WALL_CLOCK,
    "a clock behind": lambda ns: ns - 100 * 10**9,
}
LATENCY = 0.2  # s
NOISE = 1e-4  # m


class Faults(NamedTuple):
    """Rate in Hz; jitter of the spacing, and lost, doubled and swapped samples, as shares; what is wrong in each."""

    rate: int = 500
    jitter: float = 0.0
    lost: float = 0.0
    doubled: float = 0.0
    swapped: float = 0.0
    best_effort: int = 0
    wall_clock: int = 0
    pose: int = 0
    """1: a pose alone; 2: a pose with covariance, which the relay does not take."""
    publishers: int = 1
    wrong: str = ""
    begins: float = 0.0
    """s of the flight from which on ``wrong`` holds."""


def set_parts(part, values):
    """Write x, y, z of a message's part."""
    part.x, part.y, part.z = (float(value) for value in values)


def twist_of(message):
    """Return linear and angular twist of a message."""
    twist = message.twist.twist
    return [(part.x, part.y, part.z) for part in (twist.linear, twist.angular)]


def spoil(message, wrong):
    """Make one mistake in a message; returns whether it is sent at all."""
    pose = message.pose.pose
    if wrong in CHANGES:
        o = pose.orientation
        p, q = (pose.position.x, pose.position.y, pose.position.z), (o.x, o.y, o.z, o.w)
        p, q, v, w = CHANGES[wrong](p, q, *twist_of(message))
        set_parts(pose.position, p)
        o.x, o.y, o.z, o.w = map(float, q)
        set_parts(message.twist.twist.linear, v)
        set_parts(message.twist.twist.angular, w)
    elif wrong == "frame":
        message.header.frame_id = "odom"
    elif wrong == "body frame":
        message.child_frame_id = "imu"
    elif wrong == "no attitude":
        pose.orientation.x = pose.orientation.y = pose.orientation.z = pose.orientation.w = 0.0
    elif wrong == "not finite":
        pose.position.z = math.nan
    elif wrong in JUMPS:
        pose.position.x += JUMPS[wrong][0]
        pose.position.z += JUMPS[wrong][1]
    return wrong != "silent"


class Spoiler(Node):
    """Samples `odom` at a rate and sends what the faults leave of it."""

    def __init__(self, faults):
        """Subscribe to `odom` and publish `est/odom`."""
        super().__init__("estimator")
        self._faults, self._random = faults, random.Random(1)
        self._began = time.monotonic_ns()
        self._origin, self._grid, self._due = 0, 0.0, 0.0
        self._flies, self._kept = False, None
        qos = qos_profile_sensor_data if faults.best_effort else QoSProfile(depth=256)
        kind = (Odometry, PoseStamped, PoseWithCovarianceStamped)[faults.pose]
        self._outs = [self.create_publisher(kind, "est/odom", qos) for _ in range(faults.publishers)]
        self._before, self._frozen = deque(), None
        self.create_subscription(Odometry, "odom", self._on_odometry, QoSProfile(depth=256))

    def _on_odometry(self, message):
        ns = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
        waits, first = ns == 0, self._flies is False and ns > 0
        if waits:  # the vehicle repeats its step 0 until the flight begins: the sampling follows the steady clock
            self._origin = time.monotonic_ns() - self._began
        elif first:
            self._flies, self._grid, self._due = True, self._origin + ns, self._origin + ns
        at = self._origin + ns
        if at < self._due - HALF_STEP:
            return
        off = max(-HALF_STEP, min(HALF_STEP, self._due - at)) if self._faults.jitter and not (waits or first) else 0.0
        self._wait_for_next(at)
        self._send(message, ns + round(off), waits)

    def _wait_for_next(self, at):
        spacing = 1e9 / self._faults.rate
        self._grid += spacing * max(1, round((at - self._grid) / spacing) + 1)
        self._due = self._grid + self._faults.jitter * spacing * self._random.uniform(-1.0, 1.0)

    def _send(self, message, ns, waits):
        faults, draw = self._faults, self._random.random
        if not waits and draw() < faults.lost:
            return
        stale = faults.wrong == "stale first stamp"
        if 1e-9 * ns >= faults.begins and not spoil(message, faults.wrong):
            return
        message = self._older(message, ns, waits)
        stamp = STAMPS.get(faults.wrong, lambda same: same)(ns)
        stamp += WALL_CLOCK + self._origin if faults.wall_clock else 0
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp - STALE * (stale and waits), 10**9)
        kept, self._kept = self._kept, None
        if not waits and kept is None and draw() < faults.swapped:
            self._kept = message
            return
        self._publish(message)
        if kept is not None:
            self._publish(kept)
        if not waits and draw() < faults.doubled:
            self._publish(message)

    def _older(self, message, ns, waits):
        """Return the message whose pose, or whole content, is sent under this stamp."""
        wrong = self._faults.wrong
        if wrong == "latency" and not waits:
            self._before.append((ns, message))
            while len(self._before) > 1 and self._before[1][0] <= ns - LATENCY * 1e9:
                self._before.popleft()
            return deepcopy(self._before[0][1])
        if wrong == "two poses" and not waits:
            if 1e-9 * ns >= self._faults.begins:
                self._before.rotate()
                return deepcopy(self._before[0])
            self._before = deque([*self._before, deepcopy(message)], maxlen=2)
        if wrong in ("pose frozen", "noisy", "frozen") and 1e-9 * ns >= self._faults.begins:
            self._frozen = self._frozen or deepcopy(message)
            if wrong == "frozen":
                return deepcopy(self._frozen)
            message.pose = deepcopy(self._frozen.pose)
            message.pose.pose.position.x += self._random.gauss(0.0, NOISE) if wrong == "noisy" else 0.0
        return message

    def _publish(self, message):
        for number, out in enumerate(self._outs):
            if self._faults.pose:
                sent = (PoseStamped, PoseWithCovarianceStamped)[self._faults.pose - 1](header=message.header)
                sent.pose = message.pose.pose if self._faults.pose == 1 else message.pose
            else:
                sent = deepcopy(message) if number else message
                sent.pose.pose.position.x += 0.25 * number
            out.publish(sent)


def main():
    """Run until the process is ended."""
    given = dict(word.split("=", 1) for word in sys.argv[1:])
    kinds = {name: type(value) for name, value in Faults._field_defaults.items()}
    faults = Faults(**{name: kinds[name](value) for name, value in given.items()})
    rclpy.init()
    node = Spoiler(faults)
    settle(PRIORITY)  # every thread: those of DDS starve beside other work otherwise, for 90 ms at load 10
    node.create_timer(1.0, lambda: None)  # so that a signal gets its turn
    executor = EventsExecutor()
    executor.add_node(node)
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        executor.spin_until_future_complete(rclpy.task.Future(), timeout_sec=SPIN_TIMEOUT)


if __name__ == "__main__":
    main()
