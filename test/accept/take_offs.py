"""1,000 take-offs from any estimate: metres off, adrift, with a wrong heading; by four pairs of laws, without ROS.

Offsets to 20 m and drifts to 0.3 m/s per axis, headings wrong by up to 20 deg. A drift shows in the velocity in half of
them. None leans more than 15 deg below 0.5 m, none is lost; what is refused is refused by name.
"""

import math
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import wrong_estimate

from quad_core.types import Vec3
from quad_flight.flight import fly, from_names

OFFSET, DRIFT, HEADING = 20.0, 0.3, math.radians(20.0)
LOW, STEEPEST = 0.5, 15.0  # m, deg
LOST = 5.0
"""m from where the estimate's drift alone takes a vehicle that follows it."""
WATCHED = 9.0  # s
STANDS = 0.099
LAWS = ({}, {"preset": "minimal"}, {"position": "pid", "attitude": "pid"}, {"position": "se3", "attitude": "se3"})
GROUND = ("simulator.rigid_body.ground.enabled=true", f"simulator.rigid_body.initial.p.z={STANDS}")
SETTINGS = {"paper": GROUND, "calm": (*GROUND, "simulator.disturbance=none")}


def estimates(count):
    """Yield offset, drift, heading error and whether the drift shows; first single errors at their most."""
    rng = np.random.default_rng(2811)
    zero = np.zeros(3)
    for axis in np.vstack([np.eye(3), -np.eye(3)]):
        yield OFFSET * axis, zero, 0.0, 1.0
        yield zero, DRIFT * axis, 0.0, 0.0
        yield zero, DRIFT * axis, 0.0, 1.0
    yield zero, zero, HEADING, 1.0
    yield zero, zero, -HEADING, 1.0
    for number in range(count - 20):
        # a third hardly drifts: those are not refused
        most = DRIFT if number % 3 else 0.1
        drift = rng.uniform(-most, most, 3)
        yield rng.uniform(-OFFSET, OFFSET, 3), drift, rng.uniform(-HEADING, HEADING), float(rng.integers(2))


def flights(laws, weather, count):
    """Yield a flight for each estimate: hover 1.5 to 3 m above the ground, up to 3 m aside."""
    base = from_names("hover", duration=3.0, settings=list(SETTINGS[weather]), **laws)
    rng = np.random.default_rng(7)
    for seed, (offset, drift, yaw, shows) in enumerate(estimates(count), start=1):
        # an estimate that drifts up leads the vehicle down: not into the ground while it is watched
        height = rng.uniform(1.5, 3.0) + WATCHED * max(drift[2], 0.0)
        x, y, z = offset + np.append(rng.uniform(-3.0, 3.0, 2), height)
        sensing = wrong_estimate.Parameters(Vec3(*map(float, offset)), Vec3(*map(float, drift)), float(yaw), shows)
        place = base.setup.trajectory.position._replace(x=float(x), y=float(y), z=float(z))
        setup = base.setup._replace(sensing=sensing, trajectory=base.setup.trajectory._replace(position=place))
        yield base._replace(seed=seed, modules=base.modules._replace(sensing=wrong_estimate), setup=setup)


class Flown:
    """What became of one take-off: its outcome, tilt in deg while low, distance in m from where it was to be."""

    def __init__(self, flight):
        result = fly(flight, compiled=True)
        self.outcome, self.reason = result.outcome, result.reason or result.guard
        self.tilt = self.largest = self.astray = 0.0
        if result.topics:
            truth, reference = result.topics["truth"], result.topics["reference"]
            q = truth["q_wb"]
            tilt = np.degrees(np.arccos(np.clip(1.0 - 2.0 * (q[:, 0] ** 2 + q[:, 1] ** 2), -1.0, 1.0)))
            self.tilt, self.largest = tilt[truth["p_w"][:, 2] - STANDS < LOW].max(), tilt.max()
            sensing = flight.setup.sensing
            time = truth["stamp_ns"][-1] * 1e-9
            meant = reference["p_w"][-1] - np.array(sensing.offset) - time * np.array(sensing.drift)
            self.astray = float(np.linalg.norm(truth["p_w"][-1] - meant))


def run(figures):
    each = figures.each(125)
    for laws in LAWS:
        for weather in SETTINGS:
            name = f"{' '.join(laws.values()) or 'tuned'}, {weather}"
            chosen = list(flights(laws, weather, each))
            first = Flown(chosen[0])
            with ThreadPoolExecutor(2) as pool:
                judge(figures, name, chosen, [first, *pool.map(Flown, chosen[1:])])


def judge(figures, name, chosen, flown):
    """Print what became of the take-offs of one pair of laws in one weather."""
    refused = [one for one in flown if one.outcome == "refused"]
    rest = [one for one in flown if one.outcome != "refused"]
    lost = [k for k, one in enumerate(flown) if one.outcome not in ("ended", "refused") or one.astray > LOST]
    named = all("estimate moves" in one.reason for one in refused)
    figures.check(named, f"{name}: {len(refused)} of {len(flown)} refused, each by name")
    figures.at_most(f"{name}: largest tilt below {LOW} m", max(one.tilt for one in rest), STEEPEST, "deg")
    figures.check(not lost, f"{name}: {len(lost)} of {len(rest)} lost {[(k, flown[k].outcome) for k in lost[:3]]}")
    moving = sum(np.linalg.norm(one.setup.sensing.drift) * one.setup.sensing.shows > 0.15 for one in chosen)
    figures.check(
        len(refused) == moving, f"{name}: {moving} show more than 0.15 m/s at rest, those and no others refused"
    )
    figures.show(f"{name}: at most {max(one.largest for one in rest):.0f} deg of tilt in the whole flight")
