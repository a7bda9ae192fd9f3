"""The bench without propellers: whether a tilt by hand is seen as it was made, and whether torque opposes it.

The pilot makes: right side down and back, nose down and back, a turn to the left and back. In FLU each begins with a
positive angle and rate about its axis, x, y, z in this order.
"""

import numpy as np
from numpy.typing import NDArray

from quad_analysis.arrays import Floats, by_stamp, euler_angles
from quad_core.cascade import COMMAND
from quad_flight_log.messages import part_of
from quad_flight_log.reader import Flight

TOLD = {"roll": "right side down", "pitch": "nose down", "yaw": "a turn to the left"}
LEAST_ANGLE, LEAST_RATE, CLEAR = np.radians(10.0), 0.15, 2.0
"""rad that an axis must be tilted by; rad/s of a tilt, and how many times faster than about the other axes it is."""
LEAST_SHARE = 0.9  # of the time of a tilt, in which the torque must oppose it


def wrong_directions(flight: Flight) -> str:
    """Return what the bag of a bench shows against each axis, empty if nothing does; raises FlightLogError."""
    state = by_stamp(flight.array("state"))
    times, rates = state["stamp_ns"] * 1e-9, state["omega_b"]
    angles = np.unwrap(euler_angles(state["q_wb"]), axis=0)
    torque = np.zeros_like(rates)
    if flight.has(COMMAND):
        asked = by_stamp(flight.array(COMMAND))
        at, parts = asked["stamp_ns"] * 1e-9, (part_of(asked, f"wrench.torque.{axis}") for axis in "xyz")
        torque = np.stack([np.interp(times, at, part) for part in parts], axis=1)
    return "; ".join(_faults(times, angles - angles[0], rates, torque))


def _faults(times: Floats, angles: Floats, rates: Floats, torque: Floats) -> list[str]:
    found, begins = list[str](), dict[str, float]()
    for axis, name in enumerate(TOLD):
        away = _tilts(axis, angles, rates)
        if not away.any():
            found.append(f"{name}: {TOLD[name]} is not in the state, expected {np.degrees(LEAST_ANGLE):.0f} deg of it")
            continue
        first = int(away.argmax())
        begins[name] = float(times[first])
        if rates[first, axis] < 0.0:
            found.append(f"{name}: wrong sign of the state: {TOLD[name]} came as the opposite")
        opposes = torque[away, axis] * rates[away, axis] < 0.0
        if torque.any() and opposes.mean() < LEAST_SHARE:
            share = 100.0 * opposes.mean()
            found.append(f"{name}: wrong sign of the torque: it opposes the tilt in {share:.0f} % of its time")
    if sorted(begins, key=begins.__getitem__) != list(begins):
        order = ", ".join(sorted(begins, key=begins.__getitem__))
        found.append(f"axes: found the tilts in the order {order}, expected {', '.join(TOLD)}")
    return found


def _tilts(axis: int, angles: Floats, rates: Floats) -> NDArray[np.bool_]:
    """Return when a tilt about ``axis`` alone goes on and grows."""
    own, others = np.abs(rates[:, axis]), np.delete(np.abs(rates), axis, axis=1).max(axis=1)
    if np.abs(angles[:, axis]).max() < LEAST_ANGLE:
        return np.zeros(len(rates), dtype=bool)
    grows = angles[:, axis] * rates[:, axis] > 0.0
    tilts: NDArray[np.bool_] = grows & (own > LEAST_RATE) & (own > CLEAR * others)
    return tilts
