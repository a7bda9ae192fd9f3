"""From an autopilot's estimate to the state of the flight: what is accepted, what is dropped, what is a jump.

In real time a controller takes the time since its last answer for dt. Gains that are tuned for a period need not stand
twice that. So the spacing of estimates must fit what is announced, or no flight begins.
"""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from quad_autopilot import frames
from quad_core.geometry import norm, normalized, relative_attitude, subtract, wrap_angle
from quad_core.types import Quat, Vec3, VehicleState

NED = 1  # POSE_FRAME_NED and VELOCITY_FRAME_NED
_SHORTEST, _LONGEST = 0.9, 1.1  # length of a quaternion in single precision that is still an attitude
_RESET_ANGLE = math.radians(10.0)
LEAST = 40
"""Spacings that must be known."""


class Sample(NamedTuple):
    """One estimate: stamps in microseconds of the autopilot, NED world in m and m/s, FRD body in rad/s, q as wxyz.

    ``reset_counter``: None where the autopilot counts no resets.
    """

    timestamp: int
    timestamp_sample: int
    pose_frame: int
    velocity_frame: int
    position: tuple[float, float, float]
    q: tuple[float, float, float, float]
    velocity: tuple[float, float, float]
    angular_velocity: tuple[float, float, float]
    reset_counter: int | None


class Jump(NamedTuple):
    """How far the estimate moved by itself: m, and rad about a horizontal axis and about the vertical."""

    shift: Vec3
    tilt: float
    heading: float

    @property
    def distance(self) -> float:
        """Return the length of ``shift``."""
        return norm(self.shift)


def refusal(sample: Sample, newest: int) -> str:
    """Return why a sample is dropped, empty if it is accepted; ``newest``: the last timestamp_sample, -1 before."""
    if sample.pose_frame != NED or sample.velocity_frame != NED:
        return f"pose_frame {sample.pose_frame}, velocity_frame {sample.velocity_frame}, expected 1 and 1 (NED)"
    numbers = (*sample.position, *sample.q, *sample.velocity, *sample.angular_velocity)
    if not all(math.isfinite(number) for number in numbers):
        return "a number that is not finite"
    if not is_attitude(sample.q):
        return "a quaternion that is not of length 1"
    if sample.timestamp_sample <= newest:
        return f"timestamp_sample {sample.timestamp_sample}, not after {newest}"
    return ""


def is_attitude(q: Sequence[float]) -> bool:
    """Return whether a quaternion is of length 1, as single precision has it."""
    return _SHORTEST < math.sqrt(sum(part * part for part in q)) < _LONGEST


def state(sample: Sample) -> VehicleState:
    """Return an accepted sample in ENU and FLU."""
    w, x, y, z = sample.q
    return VehicleState(
        frames.world(Vec3(*sample.position)),
        frames.world(Vec3(*sample.velocity)),
        frames.attitude(normalized(Quat(x, y, z, w))),
        frames.body(Vec3(*sample.angular_velocity)),
    )


def jump(before: VehicleState, after: VehicleState, elapsed: float) -> Jump:
    """Return by how much ``after`` differs from where ``before`` led within ``elapsed`` s at its own velocities."""
    led = Vec3(*(p + elapsed * v for p, v in zip(before.p_w, before.v_w, strict=True)))
    motion = elapsed * norm(before.omega_b)
    turn = relative_attitude(_inverse(after.q_wb), _inverse(before.q_wb))  # in world axes
    tilt = 2.0 * math.atan2(math.hypot(turn.x, turn.y), math.hypot(turn.z, turn.w))
    heading = abs(wrap_angle(2.0 * math.atan2(turn.z, turn.w)))
    return Jump(subtract(after.p_w, led), max(tilt - motion, 0.0), max(heading - motion, 0.0))


def _inverse(q: Quat) -> Quat:
    return Quat(-q.x, -q.y, -q.z, q.w)


def is_reset(found: Jump, limit: float) -> bool:
    """Return whether an estimate without a counter of its own was reset: a jump beyond ``limit`` m, or 10 deg."""
    return found.distance > limit or max(found.tilt, found.heading) > _RESET_ANGLE


def misfit(
    plant_period: int, periods: Mapping[str, int], spacings: Sequence[int], source: str = "vehicle_odometry"
) -> str:
    """Return why states ``spacings`` ns apart do not fit, with the numbers; empty if they do.

    ``periods`` are the announced periods of the controllers in plant steps of ``plant_period`` ns; ``source`` names the
    states.
    """
    if len(spacings) < LEAST:
        return f"{source}: {len(spacings)} states so far, expected {LEAST}"
    ordered = sorted(spacings)
    # one state in ten may be lost on the way: that is no other rate
    shortest, longest = ordered[0], ordered[len(ordered) * 9 // 10 - 1]
    if shortest < plant_period:
        return (
            f"{source}: states {_ms(shortest)} apart, flight.plant_period is {_ms(plant_period)}; "
            "expected at most one state a period"
        )
    for role, steps in periods.items():
        announced = steps * plant_period
        # a state that comes before its time is skipped, and the next one answered
        taken = longest if shortest >= announced else announced - plant_period + longest
        if taken > 2 * announced:
            return (
                f"{source}: states {_ms(shortest)} to {_ms(longest)} apart, {role} is told "
                f"{steps} x {_ms(plant_period)} = {_ms(announced)} but would compute every {_ms(taken)}; "
                f"expected at most twice as long: raise flight.plant_period or {role}'s period_steps"
            )
    return ""


def _ms(nanoseconds: int) -> str:
    return f"{nanoseconds / 1e6:g} ms"
