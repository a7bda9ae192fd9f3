"""The stage of the attitude controller: its row in the cascade and the parameters of its node."""

from typing import Annotated, NamedTuple

from quad_core.parameters import Real, Text, Whole
from quad_core.plugins import ATTITUDE_LAW
from quad_core.prediction import Prediction
from quad_core.roles import Input, Stage
from quad_core.types import AttitudeInputs, AttitudeInternals, Wrench


class AttitudeControllerParameters(NamedTuple):
    """The attitude controller node."""

    law: Annotated[str, Text("plug-in of group quad.attitude_law; its parameters stand under its name")] = "abfnitsm"
    preset: Annotated[str, Text("starting values of the law's parameters: tuned (its defaults) or one it offers")] = (
        "tuned"
    )
    period_steps: Annotated[int, Whole("steps", "plant steps between two wrenches", 1, 100_000)] = 1
    input_timeout: Annotated[
        float, Real("s", "real time: age of the setpoint after which the vehicle is levelled", 0.01, 60.0)
    ] = 0.1
    prediction: Prediction = Prediction()


STAGE = Stage(
    role="attitude_controller",
    package="quad_attitude_ctrl",
    group=ATTITUDE_LAW,
    parameters=AttitudeControllerParameters,
    inputs_type=AttitudeInputs,
    inputs=(Input("attitude_setpoint"), Input("actuation", lag=1)),
    output="wrench_setpoint",
    output_type=Wrench,
    internals=AttitudeInternals,
    paper="eqs. 39-60",
)
