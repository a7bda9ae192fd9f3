"""The stage of the torque filter: its row in the cascade, the parameters of its node, what it takes and shows."""

from typing import Annotated, NamedTuple

from quad_core.parameters import Real, Text, Whole
from quad_core.roles import Input, Stage
from quad_core.types import Vec3, VehicleState, Wrench


class TorqueFilterInputs(NamedTuple):
    """All that a torque filter may look at in one step."""

    state: VehicleState
    wrench: Wrench


class TorqueFilterInternals(NamedTuple):
    """What a torque filter shows of one step: the torque that it took away, in N m (body)."""

    removed_b: Vec3 = Vec3()


class TorqueFilterParameters(NamedTuple):
    """The torque filter node."""

    law: Annotated[str, Text("plug-in of group quad.torque_filter; its parameters stand under its name")] = "low_pass"
    period_steps: Annotated[int, Whole("steps", "plant steps between two wrenches", 1, 100_000)] = 1
    input_timeout: Annotated[
        float, Real("s", "real time: age of the wrench after which nothing is answered", 0.01, 60.0)
    ] = 0.1


STAGE = Stage(
    role="torque_filter",
    package="quad_torque_filter",
    group="quad.torque_filter",
    parameters=TorqueFilterParameters,
    inputs_type=TorqueFilterInputs,
    inputs=(Input("wrench_setpoint"),),
    output="wrench_filtered",
    output_type=Wrench,
    internals=TorqueFilterInternals,
    messages="torque_filter_msgs",
)
