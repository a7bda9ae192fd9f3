"""Making and reading ``Conditions`` in pure text."""

from quad_core.types import (
    ALL_ROTORS,
    NO_LINK_FAULT,
    NO_PAYLOAD,
    NO_SENSOR_FAULT,
    Conditions,
    Disturbance,
    Vec3,
)

STILL_AIR = Vec3(0.0, 0.0, 0.0)


def pushed(force_w: Vec3, torque_b: Vec3) -> Conditions:
    """Return conditions with an outer force N (world) and torque N m (body), all else calm."""
    return Conditions(force_w, torque_b, STILL_AIR, NO_PAYLOAD, ALL_ROTORS, 1.0, NO_SENSOR_FAULT, NO_LINK_FAULT)


def as_disturbance(conditions: Conditions, acceleration_w: Vec3, angular_acceleration_b: Vec3) -> Disturbance:
    """Return what is published: ``conditions`` with D_P in m/s^2 (world) and D_A in rad/s^2 (body) of Eqs. 10-12."""
    sensor, link = conditions.sensor, conditions.link
    return Disturbance(
        conditions.force_w,
        conditions.torque_b,
        acceleration_w,
        angular_acceleration_b,
        conditions.wind_w,
        conditions.rotor_effectiveness,
        conditions.thrust_limit,
        conditions.payload.mass,
        sensor.frozen,
        sensor.offset_w,
        sensor.yaw_offset,
        link.delay,
        link.lost,
    )
