"""What the fake autopilot can be told, and which SET_ATTITUDE_TARGET it does not obey."""

import math

OPTIONS = {
    "kind": "px4",  # or ardupilot
    "bad_preflight": False,
    "refused": {},  # {command: result}
    "lost_acks": [],
    "ack_delay": 0.02,
    "drop": 0.0,
    "nan_every": 0,
    "child_frame": 1,  # of ODOMETRY's velocity
    "reset_after": 0.0,  # s of flight; 0: never
    "reset_by": 0.1,  # m
    "pilot_after": 0.0,
    "silent_after": 0.0,
    "battery_after": 0.0,
    "guid_options": 8,
    "angle_boost": 1,
    "stranger": False,  # another system speaks, too
}
FRESH = 0.5
"""Seconds for which a target is fresh."""


def fault(m, now):
    """Return why a SET_ATTITUDE_TARGET is not obeyed."""
    numbers = [*m.q, m.body_roll_rate, m.body_pitch_rate, m.body_yaw_rate, m.thrust]
    age = now - 1e-3 * m.time_boot_ms
    checks = (
        ("target", (m.target_system, m.target_component) != (1, 1)),
        ("not finite", not all(map(math.isfinite, numbers))),
        ("type_mask", m.type_mask != 7),
        ("quaternion", abs(math.hypot(*m.q) - 1.0) > 1e-3),
        ("thrust", not 0.0 <= m.thrust <= 1.0),
        ("stale", not -0.05 <= age <= FRESH),
    )
    return next((name for name, wrong in checks if wrong), "")
