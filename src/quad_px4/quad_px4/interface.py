"""What PX4 over uXRCE-DDS registers of itself as a vehicle interface."""

from quad_autopilot.parameters import rates
from quad_core.roles import VehicleInterface
from quad_px4.parameters import Px4BridgeParameters

PX4 = "px4_bridge"
INTERFACE = VehicleInterface(
    "quad_px4", Px4BridgeParameters, {}, "px4", "docs/how_to/px4.md", rates(4_000_000), autopilot_lands=True
)
