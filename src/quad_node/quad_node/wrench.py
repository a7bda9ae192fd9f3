"""Between quad_core's Wrench and geometry_msgs/WrenchStamped in base_link."""

from geometry_msgs.msg import WrenchStamped

from quad_core.types import Vec3, Wrench
from quad_node.conversion import all_finite, set_stamp

FRAME = "base_link"


def read_wrench(message: WrenchStamped) -> Wrench | None:
    """Return thrust and torque of a message, None if a number is not finite."""
    force, torque = message.wrench.force, message.wrench.torque
    wrench = Wrench(force.z, Vec3(torque.x, torque.y, torque.z))
    return wrench if all_finite(wrench) else None


def write_wrench(wrench: Wrench, stamp_ns: int, message: WrenchStamped) -> None:
    """Write ``wrench`` and the stamp of the state that it answers into ``message``."""
    set_stamp(message.header.stamp, stamp_ns)
    message.header.frame_id = FRAME
    message.wrench.force.z = wrench.thrust
    torque = message.wrench.torque
    torque.x, torque.y, torque.z = wrench.torque_b
