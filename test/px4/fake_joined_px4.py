"""PX4 in the loop whose plant is somebody else's: fake_joined_px4.py PORT REPORT '{"option": value}'.

One autopilot speaks both of PX4's wires: its simulator interface (MAVLink over TCP: readings in, motor outputs back, by
the simulator's clock) and DDS (odometry out, setpoints in). Its estimate is the truth that the simulator sends. What is
wrong in clock or order it notes in ``wrong``. Written from interface facts, it imports nothing of the plant's side.
"""

import math
import select
import socket
import time
from threading import Event, Thread

import numpy as np
from body import Body
from fake_px4 import ARMED, OFFBOARD, FakePx4
from pymavlink.dialects.v20 import common as mavlink
from rclpy.experimental import EventsExecutor
from rclpy.task import Future

EARTH = 6371000.0
LONGEST_AGE = 0.06  # s: two of the largest spacings, and a while for a wrench on its way
BOOT = 40  # readings without an answer
SLICE, PATIENCE = 0.005, 0.0005  # s without a look at DDS; s for the next reading
RESTING = -0.13  # m, NED: where the vehicle stands on its feet
JOINED = {"leave_at": 0, "alien_clock": False}


class Carried(Body):
    """A vehicle that somebody else moves; ``commands`` are what its motors were asked for last."""

    def __init__(self):
        super().__init__()
        self.commands, self.home = np.zeros(4), None

    @property
    def on_ground(self):
        """Return whether it stands still where it stood."""
        return self.p[2] > RESTING and np.abs(self.v).max() < 0.2

    def step(self, commands, dt=0.004):
        """Note what the motors are asked for."""
        self.commands = commands

    def carry(self, truth):
        """Take place and motion from HIL_STATE_QUATERNION."""
        place = np.array([math.radians(1e-7 * truth.lat), math.radians(1e-7 * truth.lon), 1e-3 * truth.alt])
        self.home = place if self.home is None else self.home
        north, east, up = (place - self.home) * [EARTH, EARTH * math.cos(self.home[0]), 1.0]
        self.p, self.v = np.array([north, east, -up]), 0.01 * np.array([truth.vx, truth.vy, truth.vz])
        self.r = self.matrix(truth.attitude_quaternion)
        self.w = np.array([truth.rollspeed, truth.pitchspeed, truth.yawspeed])


class FakeJoinedPx4(FakePx4):
    """The fake PX4, by the clock of a simulator."""

    def __init__(self, port, options):
        self.joined = {**JOINED, **{name: options.pop(name) for name in list(options) if name in JOINED}}
        self.wrong, self.lags, self.sent, self.answered = [], [], [], set()
        super().__init__(port, options)
        self.report |= {"wrong": self.wrong, "lags": self.lags}
        self.body, self.readings, self.last = Carried(), 0, None
        self.codec = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
        self.codec.robust_parsing = True
        self.port = port

    def expect(self, is_right, what):
        if not is_right and len(self.wrong) < 20:
            self.wrong.append(f"{self.now:.3f} s: {what}")

    @property
    def is_flown(self):
        return self.arming_state == ARMED and self.nav_state == OFFBOARD and bool(self.answered)

    def on_torque(self, message):
        super().on_torque(message)
        if self.nav_state == OFFBOARD and self.last is not None:
            self.body.step(self.motor_commands())
            self.send_outputs()
        if self.thrust[2] < -0.01:
            sampled = message.timestamp_sample
            self.expect(sampled in self.sent, f"a wrench answers {sampled}, of which no state was sent")
            self.answered.add(sampled)
            self.lags.append(round(self.now - 1e-6 * sampled, 6))

    def send_odometry(self):
        if self.is_flown:
            age = self.now - 1e-6 * max(self.answered)
            self.expect(age <= LONGEST_AGE, f"flown on for {age:.3f} s without a wrench")
        self.sent.append(self.stamp())
        super().send_odometry()

    def stamp(self):
        return super().stamp() + (10**12 if self.joined["alien_clock"] else 0)

    def on_reading(self, time_usec):
        """Go on by one step; return whether to."""
        self.readings += 1
        if self.last is not None:
            self.expect(time_usec - self.last == 4000, f"time went from {self.last} to {time_usec}")
        self.last = time_usec
        if self.readings <= BOOT:
            return True
        if self.readings == self.joined["leave_at"]:
            return False
        self.now = 1e-6 * time_usec - 0.004
        self.step()
        self.publish()
        if self.nav_state != OFFBOARD:
            self.send_outputs()
        return True

    def send_outputs(self):
        """Say what the motors are asked for; offboard only a setpoint makes new outputs, as in PX4."""
        mode = 129 if self.arming_state == ARMED else 1
        outputs = [*map(float, self.body.commands), *[0.0] * 12]
        message = mavlink.MAVLink_hil_actuator_controls_message(self.last, outputs, mode, 1)
        if self.link is not None:
            self.link.sendall(message.pack(self.codec))

    def connect(self):
        """Wait for the simulator, as PX4 does."""
        until = time.monotonic() + 120.0
        while time.monotonic() < until:
            self.link = socket.socket()
            if self.link.connect_ex(("127.0.0.1", self.port)) == 0:
                self.link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                return
            self.link.close()
            time.sleep(0.05)
        raise SystemExit("no simulator")

    def wait_for_readings(self, executor):
        """Sleep until the simulator has sent something, then have it read, as often as it does."""
        is_read = Event()
        while (link := self.link) is not None:
            select.select([link], [], [])
            is_read.clear()
            executor.create_task(lambda: (self.read(), is_read.set()))
            is_read.wait()

    def read(self):
        """Take what the simulator sends, then let DDS have its turn."""
        until = time.monotonic() + SLICE
        while self.link is not None and time.monotonic() < until:
            if not select.select([self.link], [], [], PATIENCE)[0]:
                return
            try:
                data = self.link.recv(65536)
            except OSError:
                data = b""
            goes_on = bool(data)
            for message in (self.codec.parse_buffer(data) or ()) if data else ():
                if message.get_type() == "HIL_STATE_QUATERNION":
                    self.body.carry(message)
                elif message.get_type() == "HIL_SENSOR":
                    goes_on = goes_on and self.on_reading(message.time_usec)
            if not goes_on:
                self.link.close()
                self.link = None

    def run(self, is_done):
        """Fly by the simulator's clock."""
        print("up", flush=True)
        self.connect()
        executor = EventsExecutor()
        executor.add_node(self.node)
        Thread(target=self.wait_for_readings, args=[executor], daemon=True).start()
        while not is_done():
            executor.spin_until_future_complete(Future(), timeout_sec=0.2)


if __name__ == "__main__":
    FakeJoinedPx4.serve()
