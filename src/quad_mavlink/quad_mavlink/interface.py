"""What MAVLink's two nodes register of themselves as vehicle interfaces."""

from quad_autopilot.parameters import rates
from quad_core.roles import PLANT_SLOTS, VehicleInterface
from quad_mavlink.hil.parameters import JoinedPlantParameters
from quad_mavlink.parameters import MavlinkBridgeParameters

MAVLINK = "mavlink_bridge"
JOINED = "joined_plant"

BRIDGE = VehicleInterface(
    "quad_mavlink",
    MavlinkBridgeParameters,
    {},
    "mavlink",
    "docs/how_to/mavlink.md",
    rates(4_000_000),
    autopilot_lands=True,
)
JOINED_PLANT = VehicleInterface(
    "quad_mavlink",
    JoinedPlantParameters,
    PLANT_SLOTS,
    "joined",
    "docs/how_to/px4.md",
    # s of wall time: the plant waits for the autopilot, so nothing ages meanwhile
    (*rates(4_000_000), "position_controller.input_timeout=60", "attitude_controller.input_timeout=60"),
    autopilot_lands=True,
    flies_on_estimate=True,
)
