"""The vehicle of the fake autopilot: rigid body in NED and FRD, four rotors, allocation and PX4-like controllers.

Written from PX4's documentation alone: nothing here imports the bridge or the flight stack.
"""

import copy
import json
import signal
import sys
import time
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

GRAVITY = 9.81
PLACES = np.array(
    [[0.174, 0.174], [-0.174, -0.174], [0.174, -0.174], [-0.174, 0.174]]
)  # m: front right, rear left, ...
TURNS = np.array([1.0, 1.0, -1.0, -1.0])  # +1 counter-clockwise seen from above


STEP = 0.004  # s


class Fake:
    """What all fakes share: a report, and what their options make happen so many s after the begin of flight.

    A fake is a process beside a test: PROGRAM PORT REPORT '{"option": value}', until SIGTERM.
    """

    @classmethod
    def serve(cls):
        """Fly one as the command line says and write its report."""
        done = []
        for name in (signal.SIGTERM, signal.SIGINT):
            signal.signal(name, lambda *_: done.append(1))
        port, report, options = sys.argv[1], Path(sys.argv[2]), json.loads((*sys.argv, "{}")[3])
        fake = cls(int(port), options)
        fake.run(lambda: bool(done))
        report.write_text(json.dumps({**fake.report, "ended": round(fake.now, 3)}), encoding="utf-8")

    def run(self, is_done):
        """Call ``turn`` every STEP; where the machine is late, this clock waits."""
        print("up", flush=True)
        began, steps = time.monotonic(), 0
        while not is_done():
            began = max(began, time.monotonic() - STEP * (steps + 6))
            while began + STEP * steps <= time.monotonic():
                self.turn()
                steps += 1
            time.sleep(max(0.0, began + STEP * steps - time.monotonic()))

    frozen = None

    @property
    def told(self):
        """Return the body whose pose is told: it stands still from ``frozen_after`` on."""
        if self.happens("frozen_after"):
            self.frozen = copy.deepcopy(self.body)
        return self.frozen or self.body

    def note(self, what):
        """Report an event."""
        self.report["events"].append([round(self.now, 3), what])

    def happens(self, option):
        """Return whether what an option names happens now, once."""
        due = 0.0 < self.options[option] < self.flown_for
        if due:
            self.options[option] = 0.0
            self.note(option.removesuffix("_after"))
        return due


class Body:
    """A quadrotor on flat ground; ``step`` moves it by 4 ms."""

    def __init__(self, mass=2.064, max_thrust=8.549, drag_ratio=0.016, lag=0.0125):
        self.mass, self.max_thrust, self.drag_ratio, self.lag = mass, max_thrust, drag_ratio, lag
        self.inertia = np.array([0.02362, 0.02362, 0.0439])
        self.p, self.v, self.w = np.zeros(3), np.zeros(3), np.zeros(3)
        self.r = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # nose east: yaw 0 in ENU
        self.thrusts = np.zeros(4)
        self.effectiveness = np.array([-PLACES[:, 1], PLACES[:, 0], drag_ratio * TURNS, np.ones(4)]) * max_thrust
        mix = np.linalg.pinv(self.effectiveness / max_thrust)
        mix[:, :2] /= max(np.sqrt(np.sum(mix[:, axis] ** 2) / 2.0) for axis in (0, 1))
        mix[:, 2] /= mix[:, 2].max()
        mix[:, 3] /= np.abs(mix[:, 3]).mean()
        self.mix = mix

    @property
    def on_ground(self):
        """Return whether the legs touch."""
        return self.p[2] >= -1e-9

    def allocate(self, torque, thrust):
        """Return the commands 0..1 of the motors for normalised setpoints (FRD; thrust downwards is negative z)."""
        return np.clip(self.mix @ [*torque, -thrust[2]], 0.0, 1.0)

    def wrench(self, commands):
        """Return FRD torque in N m and thrust in N of motor commands."""
        found = self.effectiveness @ commands
        return found[:3], found[3]

    def step(self, commands, dt=0.004):
        """Move on by ``dt`` s."""
        self.thrusts += (commands - self.thrusts) * (1.0 - np.exp(-dt / self.lag))
        torque, thrust = self.wrench(self.thrusts)
        acceleration = np.array([0.0, 0.0, GRAVITY]) - self.r[:, 2] * thrust / self.mass - 0.3 * self.v / self.mass
        self.w = self.w + dt * (torque - np.cross(self.w, self.inertia * self.w)) / self.inertia
        self.v = self.v + dt * acceleration
        self.p = self.p + dt * self.v
        self.r = self.r @ Rotation.from_rotvec(dt * self.w).as_matrix()
        if self.p[2] > 0.0 or (self.p[2] >= 0.0 and self.v[2] >= 0.0):
            self.p[2], self.v, self.w = 0.0, np.zeros(3), np.zeros(3)

    def quaternion(self):
        """Return the attitude as wxyz."""
        return np.roll(Rotation.from_matrix(self.r).as_quat(), 1)

    def matrix(self, q):
        """Return the rotation matrix of a quaternion wxyz."""
        return Rotation.from_quat(np.roll(q, -1)).as_matrix()

    def hold_rates(self, rates, thrust):
        """Return motor commands of a rate controller; ``thrust`` is normalised, upwards positive."""
        torque = self.inertia * 20.0 * (np.asarray(rates) - self.w)
        return np.clip(np.linalg.inv(self.effectiveness) @ [*torque, 4.0 * self.max_thrust * thrust], 0.0, 1.0)

    def hold_attitude(self, wanted, thrust):
        """Return motor commands of an attitude controller for a rotation matrix."""
        error = 0.5 * (wanted.T @ self.r - self.r.T @ wanted)
        return self.hold_rates(-6.0 * np.array([error[2, 1], error[0, 2], error[1, 0]]), thrust)

    def land(self):
        """Return motor commands that bring the vehicle down at 0.7 m/s, as PX4 does with its own controllers."""
        return self.move(0.7)

    def climb(self, height):
        """Return motor commands that bring the vehicle to ``height`` m and hold it there."""
        return self.move(-np.clip(height + self.p[2], -1.0, 1.0))

    def move(self, sinking):
        """Return motor commands for a vertical speed in m/s, downwards positive."""
        force = self.mass * (np.array([0.0, 0.0, GRAVITY]) + 2.0 * (self.v - [0.0, 0.0, sinking]))
        down = force / np.linalg.norm(force)
        right = np.cross(down, [*self.r[:2, 0], 0.0])
        right /= np.linalg.norm(right)
        wanted = np.array([np.cross(right, down), right, down]).T
        return self.hold_attitude(wanted, np.linalg.norm(force) / (4.0 * self.max_thrust))
