"""What the attitude law's tests share: presets, a vehicle, inputs over all that the law may be called with."""

from collections.abc import Iterator
from typing import Any

from hypothesis import strategies as st

from quad_attitude_ctrl import abfnitsm
from quad_attitude_ctrl.command import FilterState, FilterStates
from quad_attitude_ctrl.sliding_control import AxisMemory, Estimates
from quad_core.geometry import quaternion_from_euler
from quad_core.parameters import build
from quad_core.types import Actuation, AttitudeInputs, AttitudeThrust, Quat, Vec3, VehicleState
from quad_core.vehicle import Vehicle

DT = 0.002
VEHICLE = Vehicle(inertia_xx=0.011, inertia_yy=0.017, inertia_zz=0.026, arm_length=0.21, drag_torque_coefficient=2.9e-3)
PRESETS = {name: build(abfnitsm.Parameters, values) for name, values in abfnitsm.PRESETS.items()}
AXES = ("roll", "pitch", "yaw")
LIMITED = build(
    PRESETS["minimal"],
    {"command": "raw", "anti_windup": True} | {f"{axis}.max_torque": 0.5 for axis in ("roll", "pitch", "yaw")},
)
"""Table 2 with limited torque and commands as they come, for numbers by hand."""


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
    """Return unit quaternions of any attitude, straight up and down included."""
    turn = st.floats(-3.14, 3.14)
    return st.builds(Vec3, turn, st.floats(-1.5707963267948966, 1.5707963267948966), turn).map(quaternion_from_euler)


def any_inputs() -> st.SearchStrategy[AttitudeInputs]:
    """Return inputs over the whole flyable range."""
    turn = st.floats(-3.14, 3.14)
    return st.builds(
        AttitudeInputs,
        st.builds(VehicleState, q_wb=attitudes(), omega_b=st.one_of(vectors(1.0), vectors(1e3))),
        st.builds(
            AttitudeThrust,
            angles=st.builds(Vec3, st.floats(-1.57, 1.57), st.floats(-1.57, 1.57), turn),
            rates=vectors(10.0),
            accelerations=vectors(100.0),
            q_wb=attitudes(),
            thrust=st.floats(0.0, 100.0),
        ),
        st.builds(Actuation, roll_limited=st.booleans(), pitch_limited=st.booleans(), yaw_limited=st.booleans()),
    )


def axis_memories(max_integral: float, max_estimate: float) -> st.SearchStrategy[AxisMemory]:
    """Return memories of one axis within its bounds."""
    estimate = st.floats(0.0, min(max_estimate, 1e6))
    integral = st.floats(-min(max_integral, 1e6), min(max_integral, 1e6))
    return st.builds(
        AxisMemory, st.one_of(integral, st.floats(-0.3, 0.3)), st.builds(Estimates, estimate, estimate, estimate)
    )


def any_memory(parameters: abfnitsm.Parameters) -> st.SearchStrategy[abfnitsm.Memory]:
    """Return memories as a flight may leave them."""
    axes = [axis_memories(axis.max_surface_integral, axis.max_estimate) for axis in parameters[:3]]
    turn = st.floats(-3.14, 3.14)
    state = st.builds(FilterState, turn, st.floats(-100.0, 100.0), st.floats(-1e4, 1e4), turn)
    return st.builds(abfnitsm.Memory, *axes, st.builds(FilterStates, state, state, state), st.booleans())
