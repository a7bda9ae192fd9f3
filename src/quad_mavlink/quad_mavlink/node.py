"""`ros2 run quad_mavlink mavlink_bridge`: takes the simulator's place with a vehicle that PX4 or ArduPilot flies.

``attitude_setpoint`` becomes SET_ATTITUDE_TARGET, the autopilot's estimate becomes ``state``. MAVLink has no torque
message: attitude laws stay in shadow. ``actuation`` is a prediction: the autopilot reports none.
"""

import sys
import time
from contextlib import suppress

from rclpy.clock import Clock, ClockType

from quad_autopilot import thrust
from quad_autopilot.arming import Phase, Setpoint
from quad_autopilot.autopilot import Request
from quad_autopilot.node import AutopilotNode
from quad_core.parameters import ParameterError
from quad_core.safe import level_hover
from quad_core.types import AttitudeThrust, VehicleState
from quad_mavlink import link, modes, setpoints
from quad_mavlink.interface import MAVLINK
from quad_mavlink.parameters import MavlinkMode
from quad_mavlink.vehicle import MavlinkVehicle
from quad_msgs.msg import FlightEvent, FlightState
from quad_node.main import run


class MavlinkBridge(AutopilotNode):
    """Arms PX4 or ArduPilot, flies it by attitude or body rates, lands it."""

    def __init__(self) -> None:
        """Look for pymavlink and open the port; raises as FlightNode, ParameterError for what cannot fly."""
        super().__init__(MAVLINK, modes.UNKNOWN)
        if self.settings.max_rotor_thrust <= 0.0:
            raise ParameterError("max_rotor_thrust: found 0.0, expected the largest thrust of one rotor in N")
        found = self.settings
        self.udp = link.Link(link.load(), found.listen, found.connect, found.source_system, found.target_system)
        self.mavlink = MavlinkVehicle(self.udp, found)
        self.max_rotor_thrust = found.max_rotor_thrust
        self.predicted = setpoints.predict(found, 0.0)
        self._is_level_sent = self._is_waiting = False
        self.take_attitude()
        self.create_timer(1.0, self._on_second, clock=Clock(clock_type=ClockType.STEADY_TIME))
        self.udp.start(self._wake)

    def _wake(self) -> None:
        """Have the executor take what has come; called in the link's thread."""
        executor = self.executor
        if executor is not None and not self._is_waiting:
            self._is_waiting = True
            with suppress(RuntimeError):  # the process is leaving
                executor.create_task(self._take)

    def _take(self) -> None:
        self._is_waiting = False
        before = self.mavlink.kind
        for message in self.udp.messages():
            self.spoke_at = now = time.monotonic()
            sample = self.mavlink.handle(message, now)
            if sample is not None:
                self.on_sample(self.mavlink.stamped(sample, now))
        self.profile, self.autopilot = self.mavlink.profile, self.mavlink.autopilot
        self.ack = self.mavlink.ack or self.ack
        self.mavlink.ack = None
        if self.mavlink.kind != before:
            self.event(FlightEvent.INFO, "autopilot", f"{self.profile.name} at {self.udp.peer}", always=True)
            self._on_second()

    def _on_second(self) -> None:
        if self.phase not in (FlightState.ENDED, FlightState.FAILED):
            self.mavlink.every_second(time.monotonic())
        if self.mavlink.refused and not self.sample:
            self.event(FlightEvent.WARNING, "states_refused", self.mavlink.refused[-1], self.elapsed_ns)

    def before_beat(self) -> None:
        """Take what the watching thread could not announce."""
        self._take()

    def refusal(self) -> str:
        """Return what speaks against a flight: too weak rotors, or parameters of the autopilot."""
        weak = thrust.weakness(self.vehicle, self.max_rotor_thrust, "max_rotor_thrust")
        return weak or self.mavlink.refusal()

    def send_request(self, request: Request) -> None:
        """Send a COMMAND_LONG."""
        self.mavlink.request(request)

    def send_attitude(self, setpoint: AttitudeThrust, state: VehicleState) -> None:
        """Send an attitude, or rates towards it, and a thrust in N."""
        self.predicted = setpoints.predict(self.settings, setpoint.thrust)
        target = setpoints.target(self.settings, setpoint, state, self.mavlink.boosts)
        self.mavlink.fly(target, self.stamps())

    def send_safe(self, output: Setpoint, newtons: float, state: VehicleState) -> None:
        """Send level attitude: as a stream before the flight, once when it is given up, for a stream keeps the mode."""
        if output == Setpoint.LEVEL and self._is_level_sent:
            return
        self._is_level_sent = output == Setpoint.LEVEL
        level = level_hover(self.vehicle, state)._replace(thrust=newtons)
        # a rate sent once would be turned on with
        settings = self.settings._replace(mode=MavlinkMode.ATTITUDE.value)
        self.mavlink.fly(setpoints.target(settings, level, state, self.mavlink.boosts), self.stamps())

    def measurements(self) -> dict[str, float]:
        """Return diagnostics: the base's, the link's, the battery in V."""
        found = {**super().measurements(), "strangers": self.udp.strangers, "lost_datagrams": self.udp.lost}
        return {**found, "battery_v": self.mavlink.battery} if self.sequence.phase != Phase.STREAM else found

    def close(self) -> None:
        """Close the port."""
        self.udp.close()


def main() -> None:
    """Run the bridge over MAVLink."""
    sys.exit(run(MAVLINK, MavlinkBridge, "Bridge to PX4 or ArduPilot over MAVLink: takes attitude_setpoint."))
