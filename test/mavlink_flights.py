"""The protocol of the MAVLink bridge against the fake autopilot, over UDP, without ROS and in simulated time."""

import sys
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation
from sockets import free_port
from vehicle_packages import vehicle_packages

HERE = Path(__file__).parent / "mavlink"
for _path in (vehicle_packages(), HERE):
    if str(_path) not in sys.path:
        sys.path.append(str(_path))

from fake_autopilot import FakeAutopilot  # noqa: E402

from quad_autopilot import arming, odometry  # noqa: E402
from quad_autopilot.arming import Inputs, Phase, Setpoint  # noqa: E402
from quad_autopilot.autopilot import Stamps  # noqa: E402
from quad_core.types import AttitudeThrust, Quat  # noqa: E402
from quad_mavlink import link, vehicle  # noqa: E402
from quad_mavlink.parameters import MavlinkBridgeParameters  # noqa: E402

MASS, WEIGHT = 2.064, 2.064 * 9.81
BEAT = 5  # steps of the fake's 4 ms


def hover(state, height):
    """Return what a simple position law asks for: attitude and thrust to stand at (0, 0, ``height``)."""
    error = np.array([0.0, 0.0, height]) - state.p_w
    force = MASS * (np.clip(3.0 * error, -2.0, 2.0) - 2.5 * np.array(state.v_w) + [0.0, 0.0, 9.81])
    z = force / np.linalg.norm(force)
    y = np.cross(z, [1.0, 0.0, 0.0])
    y /= np.linalg.norm(y)
    q = Rotation.from_matrix(np.array([np.cross(y, z), y, z]).T).as_quat()
    return AttitudeThrust(q_wb=Quat(*q.tolist()), thrust=float(np.linalg.norm(force)))


class Flight:
    """``height`` m is flown; without ``commands`` no controller answers."""

    def __init__(self, options=None, height=1.0, commands=True, **settings):
        port = free_port()
        settings = {"max_rotor_thrust": 8.549, "listen": f"127.0.0.1:{port}", **settings}
        self.settings = MavlinkBridgeParameters(**settings)
        self.fake = FakeAutopilot(port, options or {})
        self.link = link.Link(link.load(), self.settings.listen, "", 255, self.settings.target_system)
        self.vehicle = vehicle.MavlinkVehicle(self.link, self.settings)
        self.height, self.commands = height, commands
        self.memory, self.output, self.sample, self.state = arming.Memory(), None, None, None
        self.steps, self.heard, self.commanded, self.stop, self.ended = 0, -9.0, -9.0, "", False
        self.rejected, self.resets, self.is_level_sent, self.unanswered = [], 0, False, np.inf

    @property
    def events(self):
        return [what for _, what in self.fake.report["events"]]

    @property
    def refusals(self):
        return {why for _, why in self.fake.report["refusals"]}

    def send(self, setpoint):
        self.vehicle.fly(setpoint, Stamps(self.sample.timestamp, self.sample.timestamp_sample))

    def receive(self):
        now = self.fake.now
        for message in self.link.messages():
            sample = self.vehicle.handle(message, now)
            if sample is None:
                continue
            why = odometry.refusal(sample, self.sample.timestamp_sample if self.sample else -1)
            if why:
                self.rejected.append(why)
                continue
            self.resets += int(self.sample is not None and sample.reset_counter != self.sample.reset_counter)
            self.sample, self.heard, self.state = sample, now, odometry.state(sample)
            self.unanswered = min(self.unanswered, now)
            if self.memory.phase == Phase.FLY and self.commands:
                self.commanded, self.unanswered = now, np.inf
                self.send(hover(self.state, self.height))

    def beat(self):
        now = self.fake.now
        # as in the bridge: for how long a state has waited for a command
        age = max(now - self.unanswered, 0.0) if self.commanded > 0.0 else np.inf
        refusal = self.vehicle.refusal() if self.memory.phase == Phase.STREAM else ""
        given = Inputs(now, now, self.vehicle.autopilot, self.vehicle.ack, age, now - self.heard, refusal, self.stop)
        self.output, self.memory = arming.step(
            self.vehicle.profile, self.settings.arming, self.memory, given._replace(ended=self.ended)
        )
        self.vehicle.ack = None
        if self.output.request is not None:
            self.vehicle.request(self.output.request)
        level = self.output.setpoint == Setpoint.LEVEL
        if self.state is not None and (self.output.setpoint == Setpoint.IDLE or (level and not self.is_level_sent)):
            thrust = WEIGHT if level else 0.0
            self.is_level_sent = level
            self.send(AttitudeThrust(q_wb=self.state.q_wb, thrust=thrust))

    def run(self, until, longest=30.0):
        """Fly until phase ``until``; return the last output."""
        end = self.fake.now + longest
        while self.fake.now < end and (self.output is None or self.output.phase not in (until, Phase.RELEASED)):
            self.tick()
        return self.output

    def tick(self):
        """Go on by 4 ms of the fake's time."""
        self.fake.take()
        self.fake.step()
        self.fake.publish()
        self.receive()
        if self.steps % 250 == 0:
            self.vehicle.every_second(self.fake.now)
        if self.steps % BEAT == 0:
            self.beat()
        self.steps += 1

    def fly(self, seconds):
        """Go on for a time."""
        for _ in range(round(seconds / 0.004)):
            self.tick()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.link.close()
        self.fake.socket.close()
