"""`ros2 run quad_crazyflie crazyflie_bridge`: takes the simulator's place with a Crazyflie, over cflib.

``attitude_setpoint`` becomes manual setpoints, its log block becomes ``state``. It has no torque setpoint: attitude
laws stay in shadow. ``actuation`` is a prediction: a Crazyflie reports none.
"""

import math
import sys
import time
from contextlib import suppress

from quad_autopilot import odometry, thrust
from quad_autopilot.arming import Phase, Setpoint
from quad_autopilot.autopilot import Request
from quad_autopilot.node import AutopilotNode
from quad_autopilot.parameters import Flier
from quad_core.geometry import clamp
from quad_core.parameters import ParameterError
from quad_core.types import Actuation, AttitudeThrust, Rotors, VehicleState
from quad_crazyflie import setpoints
from quad_crazyflie.interface import CRAZYFLIE
from quad_crazyflie.vehicle import PROFILE, CrazyflieVehicle
from quad_msgs.msg import FlightState
from quad_node.main import run

_RESET_ANGLE = math.radians(10.0)


class CrazyflieBridge(AutopilotNode):
    """Unlocks a Crazyflie, flies it by angles, yaw rate and thrust, lands it."""

    def __init__(self) -> None:
        """Look for cflib and begin to connect; raises as FlightNode, ParameterError for what cannot fly."""
        super().__init__(CRAZYFLIE, PROFILE)
        if self.settings.max_rotor_thrust <= 0.0:
            raise ParameterError("max_rotor_thrust: found 0.0, expected the largest thrust of one rotor in N")
        if self.settings.arming.takeoff == Flier.AUTOPILOT:
            raise ParameterError("arming.takeoff: found autopilot, expected ours: a Crazyflie's take-off is not used")
        self.max_rotor_thrust = self.settings.max_rotor_thrust
        self.predicted = self._predict(0.0)
        self._is_waiting = False
        self._resets = 0
        self._last: odometry.Sample | None = None
        self.take_attitude()
        self.crazyflie = CrazyflieVehicle(self.settings, self._wake)

    def _wake(self) -> None:
        """Have the executor take what has come; called in cflib's thread."""
        executor = self.executor
        if executor is not None and not self._is_waiting:
            self._is_waiting = True
            with suppress(RuntimeError):  # the process is leaving
                executor.create_task(self._take)

    def _take(self) -> None:
        self._is_waiting = False
        if self.crazyflie.blocks:
            self.spoke_at = time.monotonic()
        while self.crazyflie.blocks:
            stamp, block = self.crazyflie.blocks.popleft()
            self.crazyflie.note(block, time.monotonic())
            sample = setpoints.sample(stamp, block, self._resets)
            limit = self.settings.reset_limit
            if self._last is not None and odometry.jumped(self._last, sample, limit, _RESET_ANGLE):
                self._resets += 1
                sample = sample._replace(reset_counter=self._resets)
            self._last = sample
            self.on_sample(sample)
        self.autopilot, self.ack = self.crazyflie.autopilot, self.crazyflie.ack or self.ack
        self.crazyflie.ack = None

    def prepare(self) -> list[str]:
        """Return what the Crazyflie still has to do: to connect may take longer than a step of the arming sequence."""
        return super().prepare() if self._last else [f"{self.settings.uri}: the tables of its log and parameters"]

    def on_beat(self) -> None:
        """Begin the sequence once the Crazyflie is connected, or cannot be."""
        self._take()
        if self._last is not None or self.crazyflie.problem:
            super().on_beat()

    def before_beat(self) -> None:
        """Take what has come; a link or a battery that fails ends the flight."""
        if self.phase == FlightState.FLYING:
            self.stop = self.stop or self.crazyflie.refusal()
        if self.crazyflie.problem:
            self.stop = self.stop or f"{self.settings.uri}: {self.crazyflie.problem}"

    def refusal(self) -> str:
        """Return what speaks against a flight: an empty battery, or thrust that does not suffice."""
        largest = setpoints.largest_thrust(self.settings) / 4.0
        return self.crazyflie.refusal() or thrust.weakness(self.vehicle, largest, "max_rotor_thrust at 100 %")

    def send_request(self, request: Request) -> None:
        """Ask for what the sequence wants in the Crazyflie's own way."""
        height = self.state.p_w.z - self.state.ground_z if self.state else 0.0
        self.crazyflie.request(request, height, self.lift.ground_z)

    def send_attitude(self, setpoint: AttitudeThrust, state: VehicleState) -> None:
        """Send angles, yaw rate and thrust."""
        self.predicted = self._predict(setpoint.thrust)
        self.crazyflie.fly(setpoints.manual(self.settings, setpoint, state))

    def send_safe(self, output: Setpoint, _newtons: float, _state: VehicleState) -> None:
        """Send the zero setpoint on the ground; when given up nothing: the landing that is asked for comes first."""
        if output == Setpoint.IDLE:
            self.crazyflie.idle()

    def _predict(self, newtons: float) -> Actuation:
        largest = setpoints.largest_thrust(self.settings)
        made = clamp(newtons, 0.0, largest)
        each = made / 4.0
        return Actuation(
            rotor_thrust=Rotors(each, each, each, each),
            thrust=made,
            thrust_high=newtons > largest,
            thrust_low=newtons < 0.0,
        )

    def measurements(self) -> dict[str, float]:
        """Return diagnostics: the base's, and the battery in V."""
        found = super().measurements()
        return found if self.sequence.phase == Phase.STREAM else {**found, "battery_v": self.crazyflie.battery}

    def close(self) -> None:
        """Close the link."""
        self.crazyflie.close()


def main() -> None:
    """Run the bridge to a Crazyflie."""
    sys.exit(run(CRAZYFLIE, CrazyflieBridge, "Bridge to a Crazyflie: takes attitude_setpoint, publishes state."))
