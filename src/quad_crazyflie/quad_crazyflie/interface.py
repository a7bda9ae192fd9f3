"""What a Crazyflie registers of itself as a vehicle interface."""

from quad_autopilot.parameters import rates
from quad_core.roles import VehicleInterface
from quad_crazyflie.parameters import CrazyflieBridgeParameters

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
