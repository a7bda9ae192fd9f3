"""From what the controllers command to PX4's setpoint messages, in the mode that was chosen; no ROS calls."""

from types import ModuleType
from typing import Any

from quad_autopilot import frames
from quad_autopilot.autopilot import Stamps
from quad_core.safe import level_hover
from quad_core.types import Actuation, AttitudeThrust, Vec3, VehicleState, Wrench
from quad_core.vehicle import Vehicle
from quad_px4 import mapping, messages
from quad_px4.parameters import AirframeParameters, Mode, Px4BridgeParameters


class Setpoints:
    """Makes setpoint messages; ``predicted`` is what the rotors will make of the last one."""

    def __init__(
        self, px4: ModuleType, settings: Px4BridgeParameters, airframe: AirframeParameters, vehicle: Vehicle
    ) -> None:
        """Raise ParameterError for an airframe that cannot be, with parameter ``mode`` of ``settings``."""
        self._px4, self._vehicle = px4, vehicle
        self.mode = Mode(settings.mode)
        self.by_attitude = self.mode == Mode.ATTITUDE
        self._mapping = mapping.build(airframe)
        self.predicted: Actuation = mapping.predict(self._mapping, Wrench())

    def of_wrench(self, wrench: Wrench, stamps: Stamps) -> tuple[Any, ...]:
        """Return the messages for a FLU ``wrench`` in N and N m: mode wrench or motors."""
        self.predicted = mapping.predict(self._mapping, wrench)
        if self.mode == Mode.MOTORS:
            return (messages.motors(self._px4, mapping.motors(self._mapping, wrench), *stamps),)
        return messages.thrust_torque(self._px4, mapping.thrust_torque(self._mapping, wrench), *stamps)

    def of_attitude(self, setpoint: AttitudeThrust, stamps: Stamps) -> tuple[Any, ...]:
        """Return the message for an attitude and a thrust in N: mode attitude."""
        self.predicted = mapping.predict(self._mapping, Wrench(setpoint.thrust, Vec3()))
        thrust_body = mapping.collective(self._mapping, setpoint.thrust)
        return (messages.attitude(self._px4, frames.attitude(setpoint.q_wb), thrust_body, stamps.now),)

    def safe(self, newtons: float, state: VehicleState, stamps: Stamps) -> tuple[Any, ...]:
        """Return the messages for level attitude, or for no torque, with a thrust in N."""
        if self.by_attitude:
            return self.of_attitude(level_hover(self._vehicle, state)._replace(thrust=newtons), stamps)
        return self.of_wrench(Wrench(newtons, Vec3()), stamps)
