"""The parameters of the bridge to a Crazyflie: where it is, what its motors give, when it is given up."""

from typing import Annotated, NamedTuple

from quad_autopilot.parameters import ArmingParameters, ResetLimit, ThrustCurve, rates
from quad_core.node_parameters import GuardParameters
from quad_core.parameters import Real, Text
from quad_core.roles import VehicleInterface


class CrazyflieBridgeParameters(NamedTuple):
    """The bridge to a Crazyflie: where it is, what it is sent, and when it is given up."""

    uri: Annotated[
        str, Text("where the Crazyflie is, as cflib names it: radio://0/80/2M/E7E7E7E7E7, udp://host:port")
    ] = "radio://0/80/2M/E7E7E7E7E7"
    max_rotor_thrust: Annotated[
        float, Real("N", "largest thrust of one rotor at thrust 65535; must be measured; 0 is refused", 0.0, 1e4, "T_m")
    ] = 0.0
    thrust_curve: ThrustCurve = 0.0
    yaw_gain: Annotated[float, Real("1/s", "yaw rate per heading error; 0: none", 0.0, 20.0, "manual setpoint")] = 3.0
    yaw_rate_limit: Annotated[float, Real("rad/s", "largest yaw rate that is sent", 0.0, 20.0, "manual setpoint")] = 3.0
    tilt_limit: Annotated[float, Real("rad", "largest roll, pitch that are sent", 0.05, 1.0, "manual setpoint")] = 0.5
    landing_speed: Annotated[float, Real("m/s", "mean speed of its own landing", 0.05, 2.0, "high level commander")] = (
        0.3
    )
    low_battery: Annotated[float, Real("V", "below it no flight starts, and one ends", 0.0, 20.0, "pm.vbatMV")] = 3.2
    reset_limit: ResetLimit = 0.3
    arming: ArmingParameters = ArmingParameters()
    guard: GuardParameters = GuardParameters()


CRAZYFLIE = "crazyflie_bridge"
INTERFACE = VehicleInterface(
    "quad_crazyflie",
    CrazyflieBridgeParameters,
    {},
    "crazyflie",
    "docs/how_to/crazyflie.md",
    rates(5_000_000),
    autopilot_lands=True,
)
