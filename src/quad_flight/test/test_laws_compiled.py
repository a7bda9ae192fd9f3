"""Every law compiled has the bits of the interpreted one, memory carried along, on inputs over all that may come."""

import math
import random
import struct

import pytest

from quad_core import plugins
from quad_core.compilation import compiled
from quad_core.geometry import body_z, quaternion_from_euler
from quad_core.parameters import build
from quad_core.types import (
    Actuation,
    AttitudeInputs,
    AttitudeThrust,
    PositionInputs,
    TrajectoryPoint,
    Vec3,
    VehicleState,
)
from quad_core.vehicle import Vehicle, max_thrust

pytest.importorskip("numba")

STEPS = 3000
VEHICLE = Vehicle(
    mass=1.3,
    gravity=9.81,
    arm_length=0.21,
    inertia_xx=0.011,
    inertia_yy=0.017,
    inertia_zz=0.026,
    drag_coefficient=0.37,
    drag_torque_coefficient=2.9e-3,
    thrust_to_weight=3.5,
)
ZERO = Vec3(0.0, 0.0, 0.0)
FORMS = {
    "abfnitsm": [
        {"command": "raw", "adaptation_form": "sat", "roll.reaching_width": 1e-3, "roll.dead_zone": 0.0},
        {"command": "feed_forward"},
    ],
    "abfnitsm_so3": [{"command": "led"}],
    "itsm": [{"switching": "layer"}],
}
"""What no preset takes."""
CASES = [
    pytest.param(group, name, values, id=f"{name}-{key}")
    for group in (plugins.POSITION_LAW, plugins.ATTITUDE_LAW)
    for name in plugins.names(group)
    if getattr(plugins.load(group, name), "COMPILES", True)
    for key, values in (
        *getattr(plugins.load(group, name), "PRESETS", {"tuned": {}}).items(),
        *enumerate(FORMS.get(name, []) if group == plugins.ATTITUDE_LAW else []),
    )
]


def bits(value):
    """Return every number of nested tuples as its bytes: signs of zeros count."""

    def numbers(part):
        for item in part if isinstance(part, tuple) else ():
            yield from numbers(item)
        if not isinstance(part, tuple):
            yield float(part)

    found = list(numbers(value))
    return struct.pack(f"{len(found)}d", *found)


def vector(rng, size):
    return Vec3(*(rng.uniform(-size, size) for _ in range(3)))


def position_inputs(rng):
    """Return inputs from near the reference up to the ends of the flyable range, in any attitude."""
    far, fast = 10.0 ** rng.uniform(-3.0, 4.0), 10.0 ** rng.uniform(-3.0, 3.0)
    attitude = quaternion_from_euler(Vec3(rng.uniform(-3.1, 3.1), rng.uniform(-1.57, 1.57), rng.uniform(-3.1, 3.1)))
    state = VehicleState(vector(rng, far), vector(rng, fast), attitude, vector(rng, 20.0))
    yaw = (rng.uniform(-3.1, 3.1), rng.uniform(-2.0, 2.0), rng.uniform(-5.0, 5.0))
    reference = TrajectoryPoint(0.0, vector(rng, 0.5 * far), vector(rng, 5.0), vector(rng, 5.0), ZERO, ZERO, *yaw)
    actuation = Actuation(thrust=rng.uniform(0.0, 40.0), thrust_high=rng.random() < 0.1, thrust_low=rng.random() < 0.1)
    return PositionInputs(state, reference, actuation)


def attitude_inputs(rng):
    """Return inputs from a calm hover up to tumbling at the ends of the flyable range."""
    turned, fast = 10.0 ** rng.uniform(-4.0, 0.1), 10.0 ** rng.uniform(-4.0, 3.0)
    angles = Vec3(rng.uniform(-2.4, 2.4) * turned, rng.uniform(-1.2, 1.2) * turned, rng.uniform(-3.1, 3.1))
    state = VehicleState(ZERO, ZERO, quaternion_from_euler(angles), vector(rng, fast))
    goal = Vec3(rng.uniform(-0.8, 0.8), rng.uniform(-0.8, 0.8), rng.uniform(-3.1, 3.1))
    setpoint = AttitudeThrust(
        goal, vector(rng, 5.0), vector(rng, 50.0), quaternion_from_euler(goal), rng.uniform(0.0, 16.0), rng.random()
    )
    limited = {f"{axis}_limited": rng.random() < 0.1 for axis in ("roll", "pitch", "yaw")}
    return AttitudeInputs(state, setpoint, Actuation(torque_b=vector(rng, 0.1), **limited))


def is_within(answer):
    """Return whether an answer keeps the limits of the tuned laws."""
    if hasattr(answer, "torque_b"):
        return all(abs(torque) <= 0.5 for torque in answer.torque_b)
    share = answer.thrust / max_thrust(VEHICLE)
    return 0.02 - 1e-12 <= share <= 1.0 + 1e-12 and body_z(answer.q_wb).z >= math.cos(0.87) - 1e-9


@pytest.mark.parametrize(("group", "name", "values"), CASES)
def test_random_steps_are_bit_equal_and_tuned_laws_keep_their_limits(group, name, values):
    law, rng = plugins.load(group, name), random.Random(38)
    draw, dt = (position_inputs, 0.01) if group == plugins.POSITION_LAW else (attitude_inputs, 0.002)
    parameters, step = build(law.Parameters, values), compiled(law.step)
    here = there = start = law.init(parameters, VEHICLE)
    assert bits(compiled(law.init)(parameters, VEHICLE)) == bits(start)
    frozen = 0
    for k in range(STEPS):
        inputs = draw(rng)
        mine = law.step(parameters, VEHICLE, here, inputs, dt)
        theirs = step(parameters, VEHICLE, there, inputs, dt)
        assert bits(mine) == bits(theirs), k
        assert values or is_within(mine[0]), k
        rests = getattr(mine[2], "adaptation_frozen", False)  # a law that a user has installed may have none
        frozen += any(rests) if isinstance(rests, tuple) else rests
        here, there = (start, start) if k % 250 == 249 else (mine[1], theirs[1])
    assert name not in ("aibs", "abfnitsm", "abfnitsm_so3") or values or STEPS / 10 < frozen < STEPS
