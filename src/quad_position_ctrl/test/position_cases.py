"""What the position law's tests share: presets, a vehicle, inputs over all that the law may be called with."""

from collections.abc import Iterator
from typing import Any

from hypothesis import strategies as st

from quad_core.geometry import quaternion_from_euler
from quad_core.parameters import build
from quad_core.types import Actuation, PositionInputs, Quat, TrajectoryPoint, Vec3, VehicleState
from quad_core.vehicle import Vehicle
from quad_position_ctrl import aibs

DT = 0.01
VEHICLE = Vehicle(mass=1.3, gravity=9.81, drag_coefficient=0.37, thrust_to_weight=3.5)
PRESETS = {name: build(aibs.Parameters, values) for name, values in aibs.PRESETS.items()}


def numbers(value: Any) -> Iterator[float]:
    """Yield every number of nested tuples, depth first."""
    if isinstance(value, tuple):
        for part in value:
            yield from numbers(part)
    else:
        yield value


def vectors(size: float) -> st.SearchStrategy[Vec3]:
    """Return vectors with components in +-``size``."""
    part = st.floats(-size, size, allow_subnormal=False)
    return st.builds(Vec3, part, part, part)


def attitudes() -> st.SearchStrategy[Quat]:
    """Return unit quaternions of any attitude."""
    turn = st.floats(-3.14, 3.14)
    return st.builds(Vec3, turn, st.floats(-1.57, 1.57), turn).map(quaternion_from_euler)


def any_inputs() -> st.SearchStrategy[PositionInputs]:
    """Return inputs over the whole flyable range."""
    return st.builds(
        PositionInputs,
        st.builds(VehicleState, vectors(1e4), vectors(1e3), attitudes(), vectors(1e3)),
        st.builds(
            TrajectoryPoint,
            p_w=vectors(1e4),
            v_w=vectors(100.0),
            a_w=vectors(100.0),
            jerk_w=vectors(1e5),
            snap_w=vectors(1e7),
            yaw=st.floats(-3.14, 3.14),
            yaw_rate=st.floats(-10.0, 10.0),
            yaw_acceleration=st.floats(-100.0, 100.0),
        ),
        st.builds(Actuation, thrust=st.floats(0.0, 100.0), thrust_high=st.booleans(), thrust_low=st.booleans()),
    )


def any_memory(parameters: aibs.Parameters) -> st.SearchStrategy[aibs.Memory]:
    """Return memories as a flight may leave them, within the bounds that the law keeps."""
    bound = parameters.observer.max_estimate
    gains = st.floats(0.0, min(parameters.x.max_gain, 1e6))
    return st.builds(
        aibs.Memory,
        vectors(min(parameters.x.max_integral, 1e6)),
        st.builds(Vec3, gains, gains, gains),
        vectors(bound),
        vectors(1e3),
        vectors(0.57),
        st.booleans(),
    )
