"""The stage of the position controller: its row in the cascade and the parameters of its node."""

from typing import Annotated, NamedTuple

from quad_core.parameters import Real, Text, Whole
from quad_core.plugins import POSITION_LAW
from quad_core.prediction import Prediction
from quad_core.roles import Input, Stage
from quad_core.types import AttitudeThrust, PositionInputs, PositionInternals


class PositionControllerParameters(NamedTuple):
    """The position controller node."""

    law: Annotated[str, Text("plug-in of group quad.position_law; its parameters stand under its name")] = "aibs"
    preset: Annotated[str, Text("starting values of the law's parameters: tuned (its defaults) or one it offers")] = (
        "tuned"
    )
    period_steps: Annotated[int, Whole("steps", "plant steps between two attitude setpoints", 1, 100_000)] = 5
    input_timeout: Annotated[
        float, Real("s", "real time: age of the reference after which the position is held", 0.01, 60.0)
    ] = 0.2
    prediction: Prediction = Prediction()


STAGE = Stage(
    role="position_controller",
    package="quad_position_ctrl",
    group=POSITION_LAW,
    parameters=PositionControllerParameters,
    inputs_type=PositionInputs,
    inputs=(Input("reference"), Input("actuation", lag=1)),
    output="attitude_setpoint",
    output_type=AttitudeThrust,
    internals=PositionInternals,
    paper="eqs. 18-38",
)
