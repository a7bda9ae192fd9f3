"""From what the controllers command to PX4's setpoint messages, in the mode that was chosen; no ROS calls."""

from types import ModuleType
from typing import Any, NamedTuple

from quad_core.geometry import norm
from quad_core.px4_parameters import Mode, Px4BridgeParameters
from quad_core.safe import level_hover
from quad_core.types import Actuation, AttitudeThrust, Quat, Vec3, VehicleState, Wrench
from quad_core.vehicle import Vehicle
from quad_px4 import mapping, messages

_AT_REST, _AIRBORNE = 0.3, 0.3
"""Speed in m/s below which, and height in m above which, the mean thrust is that of a hover."""


_RESERVE = 1.05
"""Least thrust over weight."""


class Stamps(NamedTuple):
    """Microseconds of PX4: now, and of the state that is answered."""

    now: int = 0
    sampled: int = 0


class Setpoints:
    """Makes setpoint messages; ``predicted`` is what the rotors will make of the last one."""

    def __init__(self, px4: ModuleType, settings: Px4BridgeParameters, vehicle: Vehicle) -> None:
        """Raise ParameterError for an airframe that cannot be."""
        self._px4, self._settings, self._vehicle = px4, settings, vehicle
        self.mode = Mode(settings.mode)
        self.by_attitude = self.mode in (Mode.ATTITUDE, Mode.RATES)
        self._mapping = mapping.build(settings.airframe)
        self.predicted: Actuation = mapping.predict(self._mapping, Wrench())
        self._hover_thrusts, self._hover_count = 0.0, 0

    def of_wrench(self, wrench: Wrench, stamps: Stamps) -> tuple[Any, ...]:
        """Return the messages for a FLU ``wrench`` in N and N m: mode wrench or motors."""
        self.predicted = mapping.predict(self._mapping, wrench)
        if self.mode == Mode.MOTORS:
            return (messages.motors(self._px4, mapping.motors(self._mapping, wrench), *stamps),)
        return messages.thrust_torque(self._px4, mapping.thrust_torque(self._mapping, wrench), *stamps)

    def of_attitude(self, setpoint: AttitudeThrust, q: Quat, stamps: Stamps) -> tuple[Any, ...]:
        """Return the messages for an attitude and a thrust in N at attitude ``q``: mode attitude or rates."""
        self.predicted = mapping.predict(self._mapping, Wrench(setpoint.thrust, Vec3()))
        if self.mode == Mode.ATTITUDE:
            return (messages.attitude(self._px4, mapping.attitude(self._mapping, setpoint), stamps.now),)
        gain, limit = self._settings.rate_gain, self._settings.rate_limit
        return (messages.rates(self._px4, mapping.rates(self._mapping, setpoint, q, gain, limit), stamps.now),)

    def safe(self, thrust: float, state: VehicleState, stamps: Stamps) -> tuple[Any, ...]:
        """Return the messages for level attitude, or for no torque, with ``thrust`` in N."""
        if self.by_attitude:
            return self.of_attitude(level_hover(self._vehicle, state)._replace(thrust=thrust), state.q_wb, stamps)
        return self.of_wrench(Wrench(thrust, Vec3()), stamps)

    def weakness(self) -> str:
        """Return why the rotors cannot lift the vehicle; empty if they can."""
        available, mass = 4.0 * self._settings.airframe.max_rotor_thrust, self._vehicle.mass
        if available >= _RESERVE * mass * self._vehicle.gravity:
            return ""
        return f"airframe.max_rotor_thrust: four rotors give {available:g} N, too little for {mass:g} kg"

    def note(self, state: VehicleState) -> None:
        """Note the thrust just sent if the vehicle hovers at ``state``."""
        if state.p_w.z > _AIRBORNE and norm(state.v_w) < _AT_REST:
            self._hover_thrusts += self.predicted.thrust
            self._hover_count += 1

    def hover_report(self) -> str:
        """Return what the mean thrust in hover says of the largest thrust of a rotor; empty if none was seen."""
        if self._hover_count < 50:
            return ""
        mean, weight = self._hover_thrusts / self._hover_count, self._vehicle.mass * self._vehicle.gravity
        told = self._settings.airframe.max_rotor_thrust
        return (
            f"mean thrust in hover {mean:.2f} N of our scale, weight {weight:.2f} N: if the mass is right, a rotor's "
            f"largest thrust is {told * weight / mean:.2f} N (told {told:g} N)"
        )
