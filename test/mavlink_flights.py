"""The protocol of the MAVLink bridge against the fake autopilot, over UDP, without ROS and in simulated time."""

import sys
from pathlib import Path
from unittest.mock import Mock, patch

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
from quad_autopilot.autopilot import Stamps  # noqa: E402
from quad_autopilot.autopilot_flight import AutopilotFlight  # noqa: E402
from quad_autopilot.evidence import Inputs, Intent, Memory, Phase  # noqa: E402
from quad_core.types import AttitudeThrust, Quat  # noqa: E402
from quad_core.vehicle import Vehicle  # noqa: E402
from quad_mavlink import node  # noqa: E402
from quad_mavlink.parameters import MavlinkBridgeParameters  # noqa: E402

MASS = 2.064
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
    """Stands for the flight's side of the bridge; ``height`` m is flown; without ``commands`` no controller answers."""

    safe_thrust, level = AutopilotFlight.safe_thrust, AutopilotFlight.level

    def __init__(self, options=None, height=1.0, commands=True, **settings):
        port = free_port()
        settings = {"max_rotor_thrust": 8.549, "listen": f"127.0.0.1:{port}", **settings}
        self.settings = MavlinkBridgeParameters(**settings)
        self.fake = FakeAutopilot(port, options or {})
        self.node, self.leader, self.is_over = Mock(vehicle=Vehicle(mass=MASS)), Mock(), False
        self.said = self.ack = self.sample = self.state = self.output = None
        with patch.object(node, "AutopilotFlight", self.made):
            self.bridge = node.MavlinkBridge()
        self.height, self.commands = height, commands
        self.memory = Memory()
        self.steps, self.heard, self.intent = 0, -9.0, Intent.FLY
        self.rejected, self.unanswered = [], np.inf

    def made(self, kind, profile, *, ask, refusal, **_):
        self.profile, self.ask, self.refusal = profile, ask, refusal
        return self

    @property
    def events(self):
        return [what for _, what in self.fake.report["events"]]

    @property
    def refusals(self):
        return {why for _, why in self.fake.report["refusals"]}

    def clock(self):
        return self.fake.now

    def stamps(self):
        return Stamps(self.sample.timestamp, self.sample.timestamp_sample)

    def take(self, sample):
        why = odometry.refusal(sample, self.sample.timestamp_sample if self.sample else -1)
        if why:
            self.rejected.append(why)
            return
        self.sample, self.heard, self.state = sample, self.fake.now, odometry.state(sample)
        self.unanswered = min(self.unanswered, self.heard)
        if self.memory.phase != Phase.FLY or self.commands:
            self.unanswered = np.inf
        if self.memory.phase == Phase.FLY and self.commands:
            self.bridge.send_attitude(hover(self.state, self.height))

    def begin_step(self):
        return True

    def step(self):
        now = self.fake.now
        # as in the bridge: for how long a state has waited for a command
        age = max(now - self.unanswered, 0.0)
        refusal = self.refusal() if self.memory.phase == Phase.STREAM else ""
        given = Inputs(now, now, self.said, self.ack, age, now - self.heard, refusal)
        self.output, self.memory = arming.step(
            self.profile, self.settings.arming, self.memory, given._replace(intent=self.intent)
        )
        self.ack = None
        if self.output.request is not None:
            self.ask(self.output.request)
        return self.output

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
        self.bridge._read()
        if self.steps % 250 == 0:
            self.bridge.ask_for_more()
        if self.steps % BEAT == 0:
            self.bridge.step()
        self.steps += 1

    def fly(self, seconds):
        """Go on for a time."""
        for _ in range(round(seconds / 0.004)):
            self.tick()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.bridge.shut_down()
        self.fake.socket.close()
