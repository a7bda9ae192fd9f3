"""`ros2 run quad_mavlink mavlink_bridge`: takes the simulator's place with a vehicle that PX4 or ArduPilot flies.

``attitude_setpoint`` becomes SET_ATTITUDE_TARGET, the autopilot's estimate becomes ``state``. MAVLink has no torque
message: attitude laws stay in shadow. ``actuation`` is a prediction: the autopilot reports none.
"""

import sys
import time

from quad_autopilot import thrust
from quad_autopilot.arming import Setpoint
from quad_autopilot.autopilot import Request
from quad_autopilot.node import OVER, AutopilotInterface, AutopilotNode
from quad_core.types import AttitudeThrust, VehicleState
from quad_mavlink import link, words
from quad_mavlink.parameters import MAVLINK
from quad_mavlink.vehicle import MavlinkVehicle
from quad_msgs.msg import FlightEvent
from quad_node.main import run


class MavlinkInterface(AutopilotInterface):
    """PX4 or ArduPilot over MAVLink: armed, flown by attitude, landed."""

    profile = words.UNKNOWN

    def __init__(self, node: AutopilotNode) -> None:
        """Look for pymavlink and open the port; raises ParameterError for what cannot fly."""
        super().__init__(node)
        found = self.settings
        self.max_rotor_thrust = thrust.required(found.max_rotor_thrust)
        self.predicted = thrust.predicted(0.0, self.max_rotor_thrust)
        self.udp = link.Link(link.load(), found.listen, found.connect, found.source_system, found.target_system)
        self.mavlink = MavlinkVehicle(self.udp, found)
        self._is_level_sent = False
        node.every(1.0, self._on_second)
        self.udp.start(node.wake)

    def take(self) -> None:
        """Take what the watching thread has announced, and what it could not."""
        before = self.mavlink.kind
        for message in self.udp.messages():
            self.spoke_at = now = time.monotonic()
            sample = self.mavlink.handle(message, now)
            if sample is not None:
                self.node.on_sample(self.mavlink.stamped(sample, now))
        self.profile, self.autopilot = self.mavlink.profile, self.mavlink.autopilot
        self.ack = self.mavlink.ack or self.ack
        self.mavlink.ack = None
        if self.mavlink.kind != before:
            self.node.estimator = self.profile.name
            self.node.event(FlightEvent.INFO, "autopilot", f"{self.profile.name} at {self.udp.peer}", always=True)
            self._on_second()

    def _on_second(self) -> None:
        if self.node.phase not in OVER:
            self.mavlink.every_second(time.monotonic())
        if self.mavlink.refused and not self.node.sample:
            self.node.event(FlightEvent.WARNING, "states_refused", self.mavlink.refused[-1], self.node.elapsed_ns)

    def refusal(self) -> str:
        """Return what speaks against a flight: too weak rotors, or parameters of the autopilot."""
        weak = thrust.weakness(self.node.vehicle, self.max_rotor_thrust, "max_rotor_thrust")
        return weak or self.mavlink.refusal()

    def send_request(self, request: Request) -> None:
        """Send a COMMAND_LONG."""
        self.mavlink.request(request)

    def send_attitude(self, setpoint: AttitudeThrust, _state: VehicleState) -> None:
        """Send an attitude and a thrust in N."""
        self.predicted = thrust.predicted(setpoint.thrust, self.max_rotor_thrust)
        self.mavlink.fly(setpoint, self.node.stamps())

    def send_safe(self, output: Setpoint, newtons: float, state: VehicleState) -> None:
        """Send level attitude: as a stream before the flight, once when it is given up, for a stream keeps the mode."""
        if output != Setpoint.LEVEL or not self._is_level_sent:
            super().send_safe(output, newtons, state)
        self._is_level_sent = output == Setpoint.LEVEL

    def measurements(self) -> dict[str, float]:
        """Return what the link dropped."""
        return {"strangers": self.udp.strangers, "lost_datagrams": self.udp.lost}

    def close(self) -> None:
        """Close the port."""
        self.udp.close()


def main() -> None:
    """Run the bridge over MAVLink."""
    text = "Bridge to PX4 or ArduPilot over MAVLink: takes attitude_setpoint."
    sys.exit(run(MAVLINK, lambda: AutopilotNode(MAVLINK, MavlinkInterface), text))
