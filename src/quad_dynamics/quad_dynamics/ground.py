"""Contact with flat ground: four feet below the rotors, each a spring and damper with friction.

A vehicle at rest sinks in by 1 mm. Feet push, never pull. Friction is that of sliding, smooth below ``CREEP``: what
stands under a sideways force creeps, slowly.
"""

import math

from quad_core.geometry import rotate, rotate_inverse
from quad_core.types import Quat, Vec3
from quad_core.vehicle import Layout, Triple, Vehicle
from quad_dynamics.newton_euler import Body
from quad_dynamics.parameters import Ground
from quad_dynamics.rotors import DIAGONAL

SINK = 1e-3
DAMPING_RATIO = 0.7
CREEP = 0.1


def contact_height(ground: Ground, vehicle: Vehicle) -> float:
    """Return the height in m, world frame, above which no foot can touch in any attitude."""
    depth, arm = ground.foot_depth, vehicle.arm_length
    return ground.height + math.sqrt(depth * depth + arm * arm)


def contact(
    ground: Ground, vehicle: Vehicle, body: Body, height: float, v_w: Triple, q_wb: Quat, omega_b: Triple
) -> tuple[Triple, Triple]:
    """Return force N (world) and torque N m (body, about the centre of gravity) of all feet.

    ``height`` m of the centre of gravity and ``v_w`` m/s in the world, ``omega_b`` rad/s.
    """
    fx, fy, fz, tx, ty, tz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    arm = vehicle.arm_length
    for i in range(4):
        along = arm if i == 0 else (-arm if i == 1 else 0.0)
        across = arm if i == 2 else (-arm if i == 3 else 0.0)
        if vehicle.layout == Layout.X:
            along, across = DIAGONAL * (along - across), DIAGONAL * (along + across)
        foot = Vec3(along, across, -ground.foot_depth)
        force = foot_force(ground, body, height, v_w, q_wb, omega_b, foot)
        force_b = rotate_inverse(q_wb, force)
        fx, fy, fz = fx + force.x, fy + force.y, fz + force.z
        tx += foot.y * force_b.z - foot.z * force_b.y
        ty += foot.z * force_b.x - foot.x * force_b.z
        tz += foot.x * force_b.y - foot.y * force_b.x
    return (fx, fy, fz), (tx, ty, tz)


def foot_force(ground: Ground, body: Body, height: float, v_w: Triple, q_wb: Quat, omega_b: Triple, foot: Vec3) -> Vec3:
    """Return the force in N, world frame, on one foot at ``foot`` m (body)."""
    p, q, r = omega_b
    turning = Vec3(q * foot.z - r * foot.y, r * foot.x - p * foot.z, p * foot.y - q * foot.x)
    turned = rotate(q_wb, turning)
    depth = ground.height - height - rotate(q_wb, foot).z
    if depth <= 0.0:
        return Vec3(0.0, 0.0, 0.0)
    stiffness = 0.25 * body.mass * body.gravity / SINK
    damping = 0.5 * DAMPING_RATIO * body.mass * math.sqrt(body.gravity / SINK)
    normal = stiffness * depth - damping * (v_w[2] + turned.z)
    if normal <= 0.0:
        return Vec3(0.0, 0.0, 0.0)
    vx, vy = v_w[0] + turned.x, v_w[1] + turned.y
    grip = ground.friction * normal / (math.sqrt(vx * vx + vy * vy) + CREEP)
    return Vec3(-grip * vx, -grip * vy, normal)
