"""An estimator as real ones are: a process that receives the simulator's `odom` and sends `est/odom`, with faults.

Usage: python estimator.py KEY=VALUE ..., the keys of ``Faults``; it runs until it is ended.
"""

import math
import random
import sys
import time
from contextlib import suppress
from typing import NamedTuple

import rclpy
from nav_msgs.msg import Odometry
from rclpy.executors import ExternalShutdownException
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile, qos_profile_sensor_data
from scipy.spatial.transform import Rotation

from quad_node.executor import SPIN_TIMEOUT, settle

WALL_CLOCK = 1_764_000_000_000_000_000  # ns
STALE = 1000 * 10**9  # ns
HALF_STEP = 1e6  # ns: a sample is that of the nearest plant step, what is left of its jitter is in its stamp
PRIORITY = 41  # of SCHED_FIFO, as the nodes of a flight in real time have: an estimator is no later than they are


class Faults(NamedTuple):
    """Rate in Hz; jitter of the spacing, and lost, doubled and swapped samples, as shares; what is wrong in each."""

    rate: int = 500
    jitter: float = 0.0
    lost: float = 0.0
    doubled: float = 0.0
    swapped: float = 0.0
    best_effort: int = 0
    wall_clock: int = 0
    wrong: str = ""
    begins: float = 0.0
    """s of the flight from which on ``wrong`` holds."""


def turned(vector, quaternion, inverse=False):
    """Return a vector turned by an attitude."""
    return Rotation.from_quat(quaternion).apply(vector, inverse=inverse)


def set_parts(part, values):
    """Write x, y, z of a message's part."""
    part.x, part.y, part.z = (float(value) for value in values)


def spoil(message, wrong):
    """Make one mistake in a message; returns whether it is sent at all."""
    pose, twist = message.pose.pose, message.twist.twist
    p = (pose.position.x, pose.position.y, pose.position.z)
    q = (pose.orientation.x, pose.orientation.y, pose.orientation.z, pose.orientation.w)
    v = (twist.linear.x, twist.linear.y, twist.linear.z)
    w = (twist.angular.x, twist.angular.y, twist.angular.z)
    if wrong == "world twist":
        set_parts(twist.linear, turned(v, q))
    elif wrong == "zero twist":
        set_parts(twist.linear, (0, 0, 0))
    elif wrong == "sign":
        set_parts(twist.linear, [-part for part in v])
    elif wrong == "frd twist":
        set_parts(twist.linear, (v[0], -v[1], -v[2]))
        set_parts(twist.angular, (w[0], -w[1], -w[2]))
    elif wrong == "degrees":
        set_parts(twist.angular, [math.degrees(part) for part in w])
    elif wrong == "km/h":
        set_parts(twist.linear, [3.6 * part for part in v])
    elif wrong == "frame":
        message.header.frame_id = "odom"
    elif wrong == "body frame":
        message.child_frame_id = "imu"
    elif wrong == "no attitude":
        pose.orientation.x = pose.orientation.y = pose.orientation.z = pose.orientation.w = 0.0
    elif wrong == "not finite":
        pose.position.z = math.nan
    elif wrong == "jump":
        pose.position.x += 3.0
    elif wrong == "jump in height":
        pose.position.z += 0.8
    elif wrong == "ned":
        set_parts(pose.position, (p[1], p[0], -p[2]))
        s = math.sqrt(0.5)
        x, y, z, o = q
        pose.orientation.x, pose.orientation.y = s * (x + y), s * (x - y)
        pose.orientation.z, pose.orientation.w = s * (o - z), s * (o + z)
        set_parts(twist.linear, (v[0], -v[1], -v[2]))
        set_parts(twist.angular, (w[0], -w[1], -w[2]))
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
        self._out = self.create_publisher(Odometry, "est/odom", qos)
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
        stamp = ns + (WALL_CLOCK + self._origin if faults.wall_clock else 0)
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp - STALE * (stale and waits), 10**9)
        kept, self._kept = self._kept, None
        if not waits and kept is None and draw() < faults.swapped:
            self._kept = message
            return
        self._out.publish(message)
        if kept is not None:
            self._out.publish(kept)
        if not waits and draw() < faults.doubled:
            self._out.publish(message)


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
