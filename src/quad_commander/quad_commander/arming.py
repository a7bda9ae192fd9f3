"""Arming: what is observed before take-off, and every reason why it must not happen.

    reasons = refusals(limits, observed)          # every 0.3 s while ARMING; empty: the checks have passed

The node observes for a second and fills ``Observed``; nothing here knows where a number comes from. A reason names what
was found and what was expected, so that it can be shown to the operator as it is.
"""

import math
from typing import NamedTuple

from quad_commander.parameters import ArmingLimits, Fence, FlightLimits
from quad_core.extent import Extent
from quad_core.types import Vec3


class Stream(NamedTuple):
    """One topic over the last second: publishers counted, announced rate, messages counted, both per second."""

    topic: str
    publishers: int
    expected_rate: float
    rate: float


class Observed(NamedTuple):
    """All that arming looks at; the node fills it.

    ``run_ids`` and ``interface_hashes`` are those heard in the domain, ``run_id`` our own. ``state_spacing`` and
    ``announced_spacing`` in s. ``drift``: how fast in m/s the estimate moved over the last second.
    ``battery`` and ``disk`` (GB) are None where nothing tells them. ``plan`` is None before
    one was latched; ``plans`` counts different ones.
    """

    run_id: str
    run_ids: tuple[str, ...]
    interface_hashes: tuple[str, ...]
    streams: tuple[Stream, ...]
    announced_spacing: float
    state_spacing: float
    tilt: float
    speed: float
    drift: float
    ground_z: float
    body_rate: float
    battery: float | None
    disk: float | None
    plan: Extent | None
    plans: int
    faulty_nodes: tuple[str, ...]


def refusals(limits: ArmingLimits, fence: Fence, flight: FlightLimits, observed: Observed) -> list[str]:
    """Return every reason against arming; none: the vehicle may take off."""
    return [
        *_identity(observed),
        *_streams(limits, observed),
        *_vehicle(limits, observed),
        *_plan(limits, fence, flight, observed),
    ]


def outside(fence: Fence, position: Vec3, ground_z: float) -> bool:
    """Return whether ``position`` is outside the fence above ``ground_z`` m; one that is not a number is."""
    sides = zip(fence.low, (position.x, position.y, position.z - ground_z), fence.high, strict=True)
    return not all(low <= value <= high for low, value, high in sides)


def _identity(observed: Observed) -> list[str]:
    found = []
    if not observed.run_id:
        found.append("flight.run_id is empty; arming needs a run id")
    strangers = sorted(set(observed.run_ids) - {observed.run_id})
    if strangers:
        found.append(f"run ids: found {', '.join(map(repr, strangers))} too, expected {observed.run_id!r} alone")
    if len(set(observed.interface_hashes)) > 1:
        found.append(f"interface hashes: found {len(set(observed.interface_hashes))} different ones, expected one")
    found += [f"{node}: found FAULT, expected no faulty node" for node in observed.faulty_nodes]
    return found


def _streams(limits: ArmingLimits, observed: Observed) -> list[str]:
    found = []
    for stream in observed.streams:
        if stream.publishers != 1:
            found.append(f"{stream.topic}: found {stream.publishers} publishers, expected 1")
        low, high = ((1.0 + side * limits.rate_tolerance) * stream.expected_rate for side in (-1.0, 1.0))
        if not low <= stream.rate <= high:
            found.append(f"{stream.topic}: found {stream.rate:.1f} Hz, expected {low:.1f} to {high:.1f} Hz")
    true, announced, factor = observed.state_spacing, observed.announced_spacing, limits.spacing_factor
    if not announced / factor <= true <= announced * factor:
        found.append(
            f"state: found samples {1e3 * true:.2f} ms apart, expected {1e3 * announced / factor:.2f} to "
            f"{1e3 * announced * factor:.2f} ms: {1e3 * announced:.2f} ms are announced"
        )
    return found


def _vehicle(limits: ArmingLimits, observed: Observed) -> list[str]:
    found = []
    if not observed.tilt < limits.tilt:
        degrees, largest = math.degrees(observed.tilt), math.degrees(limits.tilt)
        found.append(f"tilt: found {degrees:.1f} deg, expected less than {largest:.1f} deg")
    if not observed.speed < limits.speed:
        found.append(f"speed: found {observed.speed:.2f} m/s, expected less than {limits.speed:.2f} m/s")
    if not observed.drift < limits.speed:
        found.append(
            f"state: found an estimate that moves at {observed.drift:.2f} m/s while the vehicle stands, "
            f"expected less than {limits.speed:.2f} m/s"
        )
    if not observed.body_rate < limits.rate:
        found.append(f"body rate: found {observed.body_rate:.2f} rad/s, expected less than {limits.rate:.2f} rad/s")
    if observed.battery is not None and not observed.battery >= limits.battery:
        found.append(
            f"battery: found {100.0 * observed.battery:.0f} %, expected at least {100.0 * limits.battery:.0f} %"
        )
    if observed.disk is not None and not observed.disk > limits.disk:
        found.append(f"disk: found {observed.disk:.2f} GB free, expected more than {limits.disk:.2f} GB")
    return found


def _plan(limits: ArmingLimits, fence: Fence, flight: FlightLimits, observed: Observed) -> list[str]:
    if observed.plans > 1:
        return [f"plan: found {observed.plans} different ones, expected one, latched"]
    plan = observed.plan
    if plan is None:
        return ["plan: found none, expected one, latched"]
    found = [
        f"plan: found it outside the fence at ({', '.join(f'{part:.1f}' for part in corner)}) m, expected it within"
        for corner in (plan.low, plan.high)
        if outside(fence, corner, observed.ground_z)
    ]
    pairs = (
        ("a speed", plan.speed, flight.speed, "m/s"),
        ("an acceleration", plan.acceleration, flight.acceleration, "m/s^2"),
        ("a tilt", plan.tilt, flight.tilt, "rad"),
        ("a duration", plan.duration, limits.longest_flight, "s"),
    )
    for name, value, largest, unit in pairs:
        if not 0.0 <= value <= largest:
            found.append(f"plan: found {name} of {value:.2f} {unit}, expected at most {largest:.2f} {unit}")
    return found
