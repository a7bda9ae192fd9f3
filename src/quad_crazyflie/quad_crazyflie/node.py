"""`ros2 run quad_crazyflie crazyflie_bridge`: takes the simulator's place with a Crazyflie, over cflib.

``attitude_setpoint`` becomes manual setpoints, its log block becomes ``state``. It has no torque setpoint: attitude
laws stay in shadow. ``actuation`` is a prediction: a Crazyflie reports none.
"""

import sys
import time

from quad_autopilot import thrust
from quad_autopilot.arming import Phase, Setpoint
from quad_autopilot.autopilot import Request
from quad_autopilot.node import AutopilotInterface, AutopilotNode
from quad_autopilot.parameters import Flier
from quad_core.parameters import ParameterError
from quad_core.types import AttitudeThrust, VehicleState
from quad_crazyflie import setpoints
from quad_crazyflie.parameters import CRAZYFLIE
from quad_crazyflie.vehicle import PROFILE, CrazyflieVehicle
from quad_msgs.msg import FlightState
from quad_node.main import run


class CrazyflieInterface(AutopilotInterface):
    """A Crazyflie: unlocked, flown by angles, yaw rate and thrust, landed by itself."""

    profile = PROFILE

    def __init__(self, node: AutopilotNode) -> None:
        """Look for cflib and begin to connect; raises ParameterError for what cannot fly."""
        super().__init__(node)
        thrust.required(self.settings.max_rotor_thrust)
        if self.settings.arming.takeoff == Flier.AUTOPILOT:
            raise ParameterError("arming.takeoff: found autopilot, expected ours: a Crazyflie's take-off is not used")
        self._largest = setpoints.largest_thrust(self.settings) / 4.0
        self.predicted = thrust.predicted(0.0, self._largest)
        self.crazyflie = CrazyflieVehicle(self.settings, node.wake)

    def take(self) -> None:
        """Take what cflib's thread has put down; a link or a battery that fails ends the flight."""
        if self.crazyflie.blocks:
            self.spoke_at = time.monotonic()
        while self.crazyflie.blocks:
            stamp, block = self.crazyflie.blocks.popleft()
            self.crazyflie.note(block, time.monotonic())
            self.node.on_sample(setpoints.sample(stamp, block))
        self.autopilot, self.ack = self.crazyflie.autopilot, self.crazyflie.ack or self.ack
        self.crazyflie.ack = None
        problem = self.crazyflie.refusal() if self.node.phase == FlightState.FLYING else ""
        if self.crazyflie.problem:
            problem = f"{self.settings.uri}: {self.crazyflie.problem}"
        self.node.stop = self.node.stop or problem

    def missing(self) -> list[str]:
        """Return what the Crazyflie still has to do: to connect may take longer than a step of the arming sequence."""
        is_known = self.autopilot is not None or self.crazyflie.problem
        return [] if is_known else [f"{self.settings.uri}: the tables of its log and parameters"]

    def refusal(self) -> str:
        """Return what speaks against a flight: an empty battery, or thrust that does not suffice."""
        weak = thrust.weakness(self.node.vehicle, self._largest, "max_rotor_thrust at 100 %")
        return self.crazyflie.refusal() or weak

    def send_request(self, request: Request) -> None:
        """Ask for what the sequence wants in the Crazyflie's own way."""
        state = self.node.state
        height = state.p_w.z - state.ground_z if state else 0.0
        self.crazyflie.request(request, height, self.node.lift.ground_z)

    def send_attitude(self, setpoint: AttitudeThrust, state: VehicleState) -> None:
        """Send angles, yaw rate and thrust."""
        self.predicted = thrust.predicted(setpoint.thrust, self._largest)
        self.crazyflie.fly(setpoints.manual(self.settings, setpoint, state))

    def send_safe(self, output: Setpoint, _newtons: float, _state: VehicleState) -> None:
        """Send the zero setpoint on the ground; when given up nothing: the landing that is asked for comes first."""
        if output == Setpoint.IDLE:
            self.crazyflie.idle()

    def measurements(self) -> dict[str, float]:
        """Return the battery in V."""
        return {} if self.node.sequence.phase == Phase.STREAM else {"battery_v": self.crazyflie.battery}

    def close(self) -> None:
        """Close the link."""
        self.crazyflie.close()


def main() -> None:
    """Run the bridge to a Crazyflie."""
    text = "Bridge to a Crazyflie: takes attitude_setpoint, publishes state."
    sys.exit(run(CRAZYFLIE, lambda: AutopilotNode(CRAZYFLIE, CrazyflieInterface), text))
