"""The parameters of the commander's node; the conditions: ``docs/reference/modes.md``."""

import math
from typing import Annotated, NamedTuple

from quad_core.parameters import Flag, Real, Text, Whole
from quad_core.roles import Role
from quad_core.types import Vec3


class ModeParameters(NamedTuple):
    """When a condition is raised. All are fixed before a flight."""

    reference_late: Annotated[float, Real("s", "age of the mission reference: HOLD", 0.001, 100.0, "MRS, PX4")] = 0.2
    reference_lost: Annotated[float, Real("s", "age of the mission reference: LAND", 0.001, 100.0, "MRS, PX4")] = 2.0
    setpoint_lost: Annotated[float, Real("s", "age of the setpoint: DESCEND above", 0.001, 100.0, "ArduPilot")] = 0.3
    state_lost: Annotated[float, Real("s", "age of the state: above it, DESCEND", 0.001, 100.0, "MRS")] = 0.1
    position_error: Annotated[float, Real("m", "position error: above it, LAND", 0.01, 1000.0, "MRS")] = 1.5
    large_position_error: Annotated[float, Real("m", "position error: above it, DESCEND", 0.01, 1000.0, "MRS")] = 2.5
    battery_low: Annotated[float, Real("", "share of a full battery: below it, LAND", 0.0, 1.0)] = 0.2
    overruns: Annotated[float, Real("", "share of late cycles in 1 s: above it, HOLD", 0.0, 1.0, "ros2_control")] = 0.05
    land_without_recorder: Annotated[bool, Flag("a lost recorder lands the vehicle; else it is an event only")] = False
    # so long the take-off of a mission may be refused, too
    arming_late: Annotated[float, Real("s", "armed without take-off: DISARMED", 0.1, 1000.0, "COM_DISARM_PRFLT")] = 10.0
    spool_up: Annotated[float, Real("s", "least time from arming to take-off", 0.0, 100.0, "COM_SPOOLUP_TIME")] = 1.0
    takeoff_late: Annotated[float, Real("s", "longest take-off; after it the mode is LAND", 0.1, 1000.0)] = 30.0
    landing_late: Annotated[float, Real("s", "time without contact after a landing: then DESCEND", 0.1, 1000.0)] = 5.0
    release_time: Annotated[float, Real("s", "time for the guard to give back control on request", 0.01, 10.0)] = 0.5


class ArmingLimits(NamedTuple):
    """What must hold before a flight; defaults are those of ``docs/explanation/safety.md``."""

    rate_tolerance: Annotated[float, Real("", "a stream may be off its announced rate by this share", 0.0, 1.0)] = 0.2
    spacing_factor: Annotated[float, Real("", "largest factor between true and announced spacing", 1.0, 10.0)] = 2.0
    tilt: Annotated[float, Real("rad", "largest tilt on the ground", 0.01, 1.5)] = math.radians(15.0)
    speed: Annotated[float, Real("m/s", "speed, reported and by position, below which it rests", 0.001, 10.0)] = 0.1
    rate: Annotated[float, Real("rad/s", "body rate below which it rests", 0.001, 10.0)] = 0.1
    battery: Annotated[float, Real("", "least share of a full battery for arming", 0.0, 1.0)] = 0.3
    longest_flight: Annotated[float, Real("s", "longest plan that is armed", 1.0, 1e6)] = 3600.0


class Corner(NamedTuple):
    """A corner of the fence: world frame, its height above where the vehicle stands at arming."""

    x: Annotated[float, Real("m", "bound of the fence along x (east)", -1e4, 1e4)] = 100.0
    y: Annotated[float, Real("m", "bound of the fence along y (north)", -1e4, 1e4)] = 100.0
    z: Annotated[float, Real("m", "bound of the fence above the ground", -1e4, 1e4)] = 120.0


class Fence(NamedTuple):
    """A box: where the vehicle may be."""

    low: Corner = Corner(-100.0, -100.0, -1.0)
    high: Corner = Corner(100.0, 100.0, 120.0)

    def excludes(self, position: Vec3, ground_z: float) -> bool:
        """Return whether ``position`` is outside, above ``ground_z`` m; one that is not a number is."""
        sides = zip(self.low, (position.x, position.y, position.z - ground_z), self.high, strict=True)
        return not all(low <= value <= high for low, value, high in sides)


class FlightLimits(NamedTuple):
    """What a planned trajectory may ask of the vehicle."""

    speed: Annotated[float, Real("m/s", "largest speed of a mission's reference", 0.1, 100.0)] = 10.0
    acceleration: Annotated[float, Real("m/s^2", "largest acceleration of a mission's reference", 0.1, 100.0)] = 10.0
    tilt: Annotated[float, Real("rad", "largest tilt that a mission's reference needs", 0.01, 1.5)] = 0.8


class AxisLimits(NamedTuple):
    """What one axis may use; where the start has more of it, that is given up as quickly as the limits allow."""

    speed: Annotated[float, Real("m/s, rad/s", "largest speed (yaw: rad/s)", 0.01, 100.0)] = 1.0
    acceleration: Annotated[float, Real("m/s^2, rad/s^2", "largest acceleration (yaw: rad/s^2)", 0.01, 100.0)] = 2.0
    jerk: Annotated[float, Real("m/s^3, rad/s^3", "largest jerk (yaw: rad/s^3)", 0.01, 1e4)] = 6.0


class ReferenceLimits(NamedTuple):
    """Limits of the commander's own references; x and y each take ``horizontal``."""

    horizontal: AxisLimits = AxisLimits(1.0, 2.0, 6.0)
    climb: AxisLimits = AxisLimits(1.0, 1.5, 5.0)
    landing: AxisLimits = AxisLimits(0.7, 1.5, 5.0)
    yaw: AxisLimits = AxisLimits(1.0, 2.0, 8.0)
    # so that thrust drops after touchdown
    landing_depth: Annotated[float, Real("m", "the landing's reference ends so far below the ground", 0.0, 10.0)] = 0.5


class CommanderParameters(NamedTuple):
    """The commander node: modes, missions, arming and its own references."""

    period_steps: Annotated[int, Whole("steps", "plant steps between two decisions", 1, 100_000)] = 5
    mission: Annotated[
        str, Text("takeoff[:height], a trajectory, hold:seconds, goto:x y z [yaw], land; empty: wait for requests")
    ] = ""
    takeoff_height: Annotated[float, Real("m", "height of a take-off that names none", 0.1, 1000.0)] = 1.5
    wait_limit: Annotated[float, Real("s", "longest wait of a mission in HOLD after a fault; LAND", 1.0, 1e6)] = 60.0
    give_up: Annotated[float, Real("s", "lockstep: wall clock until a mission reference is lost", 0.1, 60.0)] = 1.0
    modes: ModeParameters = ModeParameters()
    arming: ArmingLimits = ArmingLimits()
    fence: Fence = Fence()
    limits: FlightLimits = FlightLimits()
    references: ReferenceLimits = ReferenceLimits()


ROLE = Role("quad_commander", CommanderParameters, {})
