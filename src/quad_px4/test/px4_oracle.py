"""PX4's allocation and the frames as matrices: written from PX4's documentation, importing nothing of the bridge."""

import numpy as np
from frames_oracle import BODY

__all__ = ["BODY", "allocated", "made"]
CT = 6.5  # PX4's default thrust coefficient: it must not matter


def allocated(rotors, torque_setpoint, thrust_setpoint):
    """Return PX4's motor commands: pseudo-inverse of the effectiveness, columns scaled.

    ``rotors`` rows: px, py, km (FRD).
    """
    axis = np.array([0.0, 0.0, -1.0])
    columns = [
        np.concatenate([CT * np.cross([px, py, 0.0], axis) - CT * km * axis, CT * axis]) for px, py, km in rotors
    ]
    mix = np.linalg.pinv(np.array(columns).T)
    roll, pitch = (np.sqrt(np.sum(mix[:, axis] ** 2) / (len(rotors) / 2)) for axis in (0, 1))
    mix[:, :2] /= max(roll, pitch)
    mix[:, 2] /= mix[:, 2].max()
    mix[:, 5] /= np.abs(mix[:, 5]).mean()
    return mix @ np.concatenate([torque_setpoint, thrust_setpoint])


def made(rotors, commands, max_thrust, drag_ratio=None):
    """Return the FLU torque and the collective thrust that ``commands`` make, by force times arm."""
    torque, thrust = np.zeros(3), 0.0
    for (px, py, km), command in zip(rotors, commands, strict=True):
        force = max_thrust * command
        ratio = abs(km) if drag_ratio is None else drag_ratio
        torque += np.cross([px, py, 0.0], [0.0, 0.0, -force])
        torque[2] += np.sign(km) * ratio * force
        thrust += force
    return BODY @ torque, thrust
