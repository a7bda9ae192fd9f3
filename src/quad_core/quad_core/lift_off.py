"""From the ground into the air: while the vehicle has not risen clear, laws lift it straight up and remember nothing.

    risen     = min(p_z - ground_z, integral of v_z) since arming
    on_ground = not armed, or since arming risen <= CLEAR, and not above AFOOT for HOVERS s
    tau       = J (W^2 e - 2 D W omega) on the ground, e = b x z; about z -J_zz K r

An estimate may stand metres off, drift, or have its heading wrong while the ground holds the vehicle. What a law would
correct there it cannot, so its integrators wind up, and the vehicle turns over once it is light. Therefore on the
ground the position law sees no error but that of height, the torque is that of a law without memory, which keeps the
body z axis b upright and damps the yaw rate r, and both laws start from their first memory when the vehicle is clear.

The vehicle interface keeps ``LiftOff`` and marks each state; all else follows from the state.
"""

from collections import deque
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

from quad_core.geometry import (
    ZERO,
    add,
    body_z,
    cross,
    euler_from_quaternion,
    norm,
    rotate_inverse,
    scale,
    subtract,
    total,
)
from quad_core.plugins import Law
from quad_core.records import referable
from quad_core.types import AttitudeInputs, PositionInputs, TrajectoryPoint, Vec3, VehicleState, Wrench
from quad_core.vehicle import Vehicle

CLEAR = 0.7
"""m above the height at arming from which on the vehicle is clear of the ground: 0.5 m, and what an estimate that
passes for one at rest (0.15 m/s) may have drifted on the way up."""
AFOOT, HOVERS = 0.15, 2.0
"""m above the height at arming, for so many s: the vehicle flies, and its reference goes no higher."""

UPRIGHT, DAMPING, YAW_DAMPING = 8.0, 0.9, 3.0
"""W in rad/s, D and K in rad/s of the attitude on the ground: those of the guard's own law, for any vehicle."""
RETURN = 1.2  # rad/s: bandwidth of the way back to the reference after lift-off, critically damped
RETURNED = 1e-3  # m, and m/s, from which on the vehicle counts as back

SUNK, SINKING = 0.1, 0.5
"""m below the ground, and m/s downwards, at lift-off: an estimate whose z points down. It turns a vehicle over."""


class LiftOff(NamedTuple):
    """Height in m of the vehicle standing on the ground, and whether it has not risen clear of there.

    ``climbed``: the integral of its upward velocity in m, ``hovered``: for how long in s it has been above AFOOT.
    """

    ground_z: float
    on_ground: bool
    climbed: float
    hovered: float


def standing(ground_z: float) -> LiftOff:
    """Return what is known of a vehicle that stands at ``ground_z`` m."""
    return LiftOff(ground_z, True, 0.0, 0.0)


def airborne(ground_z: float) -> LiftOff:
    """Return what is known of a vehicle that flies above a ground at ``ground_z`` m."""
    return LiftOff(ground_z, False, 0.0, 0.0)


def lifted_off(before: LiftOff, state: VehicleState, armed: bool, dt: float) -> LiftOff:
    """Return what follows ``before`` with ``state``, ``dt`` s later: disarmed it stands where its estimate has it."""
    if not armed:
        return standing(state.p_w.z)
    if not before.on_ground:
        return before
    climbed = before.climbed + dt * state.v_w.z
    height = state.p_w.z - before.ground_z
    risen = climbed if climbed < height else height
    hovered = before.hovered + dt if risen > AFOOT else 0.0
    # an estimate without a velocity is not to be kept from flying for ever
    on_ground = risen <= CLEAR and height <= 2.0 * CLEAR and hovered <= HOVERS
    return LiftOff(before.ground_z, on_ground, climbed, hovered)


def sinks(lift: LiftOff, state: VehicleState) -> bool:
    """Return whether a vehicle that lifts off is said to move into the ground."""
    return lift.on_ground and state.p_w.z < lift.ground_z - SUNK and state.v_w.z < -SINKING


def straight_up(inputs: PositionInputs) -> PositionInputs:
    """Return what a position law sees on the ground: the vehicle below its reference, at its heading, without drift."""
    state, reference = inputs.state, inputs.reference
    p, v = state.p_w, state.v_w
    above = TrajectoryPoint(
        reference.trajectory_time,
        Vec3(p.x, p.y, reference.p_w.z),
        Vec3(v.x, v.y, reference.v_w.z),
        Vec3(0.0, 0.0, reference.a_w.z),
        Vec3(0.0, 0.0, reference.jerk_w.z),
        Vec3(0.0, 0.0, reference.snap_w.z),
        euler_from_quaternion(state.q_wb).z,
        0.0,
        0.0,
    )
    return PositionInputs(state, above, inputs.actuation)


def upright(vehicle: Vehicle, state: VehicleState) -> Vec3:
    """Return the torque in N m, body frame, that keeps a vehicle level on its way up, whatever its law remembers."""
    turn = rotate_inverse(state.q_wb, cross(body_z(state.q_wb), Vec3(0.0, 0.0, 1.0)))
    omega, stiffness, damping = state.omega_b, UPRIGHT * UPRIGHT, 2.0 * DAMPING * UPRIGHT
    return Vec3(
        vehicle.inertia_xx * (stiffness * turn.x - damping * omega.x),
        vehicle.inertia_yy * (stiffness * turn.y - damping * omega.y),
        -vehicle.inertia_zz * YAW_DAMPING * omega.z,
    )


def horizontal_error(inputs: PositionInputs) -> tuple[Vec3, Vec3]:
    """Return how far in m, and with which speed in m/s, the vehicle is off its reference in the horizontal plane."""
    p, v, reference = inputs.state.p_w, inputs.state.v_w, inputs.reference
    return (
        Vec3(p.x - reference.p_w.x, p.y - reference.p_w.y, 0.0),
        Vec3(v.x - reference.v_w.x, v.y - reference.v_w.y, 0.0),
    )


def shifted(inputs: PositionInputs, distance: Vec3, speed: Vec3, pull: Vec3) -> PositionInputs:
    """Return ``inputs`` with the reference ``distance`` m, ``speed`` m/s and ``pull`` m/s^2 away from where it is."""
    reference = inputs.reference
    moved = TrajectoryPoint(
        trajectory_time=reference.trajectory_time,
        p_w=add(reference.p_w, distance),
        v_w=add(reference.v_w, speed),
        a_w=add(reference.a_w, pull),
        jerk_w=reference.jerk_w,
        snap_w=reference.snap_w,
        yaw=reference.yaw,
        yaw_rate=reference.yaw_rate,
        yaw_acceleration=reference.yaw_acceleration,
    )
    return PositionInputs(inputs.state, moved, inputs.actuation)


@cache
def with_lift_off(law: Law, inputs: type[Any]) -> Law:
    """Return ``law`` with a ``step`` that lifts the vehicle straight up while its state is on the ground.

    ``inputs`` is the class of what the law's stage takes. What runs it gives it the law's first memory there.
    """
    name = f"{law.name}[lift_off]"
    if inputs is not PositionInputs:
        return law._replace(name=name, step=_step(law.step, inputs is AttitudeInputs))
    fields = {"law": law.Memory, "distance": Vec3, "speed": Vec3, "returns": bool}
    memory: Any = referable("Memory", f"{law.name}_lifted", fields, __name__)

    def init(parameters: Any, vehicle: Any) -> Any:
        return memory(law.init(parameters, vehicle), ZERO, ZERO, False)

    return law._replace(name=name, Memory=memory, init=init, step=_position_step(law.step, memory))


def _step(law: Callable[..., Any], is_attitude: bool) -> Callable[..., Any]:
    """Return ``step`` of a law whose memory stays as it is on the ground.

    The torque of an attitude law is ``upright`` there: it may hold the angle by its integral alone.
    """

    def step(parameters: Any, vehicle: Any, memory: Any, inputs: Any, dt: float) -> Any:
        output, after, internals = law(parameters, vehicle, memory, inputs, dt)
        return output, memory if inputs.state.on_ground else after, internals

    def attitude_step(parameters: Any, vehicle: Any, memory: Any, inputs: Any, dt: float) -> Any:
        output, after, internals = law(parameters, vehicle, memory, inputs, dt)
        if inputs.state.on_ground:
            output, after = Wrench(output.thrust, upright(vehicle, inputs.state)), memory
        return output, after, internals

    return attitude_step if is_attitude else step


def _position_step(law: Callable[..., Any], kind: Any) -> Callable[..., Any]:
    """Return ``step`` that takes back by and by, not in one step, what the vehicle was carried aside on the way up."""

    # the law is called in one place: each call is a copy of it in the compiled loop
    def step(parameters: Any, vehicle: Any, memory: Any, inputs: Any, dt: float) -> Any:
        on_ground, seen = inputs.state.on_ground, inputs
        distance, speed, returns = memory.distance, memory.speed, memory.returns
        if on_ground:
            seen, returns = straight_up(inputs), True
            distance, speed = horizontal_error(inputs)
        elif returns:
            pull = add(scale(-RETURN * RETURN, distance), scale(-2.0 * RETURN, speed))
            seen = shifted(inputs, distance, speed, pull)
            speed = add(speed, scale(dt, pull))
            distance = add(distance, scale(dt, speed))
            returns = norm(distance) > RETURNED or norm(speed) > RETURNED
        output, own, internals = law(parameters, vehicle, memory.law, seen, dt)
        return output, kind(memory.law if on_ground else own, distance, speed, returns), internals

    return step


WINDOW = 1.0  # s of states that are looked at
LEAST = 0.5  # s of them that must be known


class Standing:
    """The states of the last WINDOW s: whether an estimate rests while its vehicle stands on the ground."""

    def __init__(self) -> None:
        self._seen: deque[tuple[float, VehicleState]] = deque()

    def note(self, time: float, state: VehicleState) -> None:
        """Take in a state of ``time`` s."""
        self._seen.append((time, state))
        while self._seen[0][0] < time - WINDOW:
            self._seen.popleft()

    def refusal(self, limit: float, source: str) -> str:
        """Return why the vehicle must not take off, empty if it may; ``limit`` in m/s, ``source`` names the states.

        An estimate at rest shows neither a mean velocity nor a position that moves.
        """
        known = self._seen[-1][0] - self._seen[0][0] if self._seen else 0.0
        if known < LEAST:
            return f"{source}: found states over {known:.1f} s, expected {LEAST:g} s of them at rest"
        states = [state for _, state in self._seen]
        drift = norm(subtract(states[-1].p_w, states[0].p_w)) / known
        speed = norm(total(state.v_w for state in states)) / len(states)
        if max(drift, speed) < limit:
            return ""
        return (
            f"{source}: the estimate moves while the vehicle stands: found its position at {drift:.2f} m/s, "
            f"its velocity {speed:.2f} m/s, expected less than {limit:g} m/s"
        )
