"""The parameters of the bridge to PX4: what the airframe is, how it is armed, when it is given up."""

from enum import IntEnum
from typing import Annotated, NamedTuple

from quad_autopilot.parameters import ArmingParameters, ResetLimit, RotorThrust, ThrustCurve, rates
from quad_core.node_parameters import GuardParameters
from quad_core.parameters import Choice, Real, Text, Whole
from quad_core.roles import VehicleInterface

_LOSS = "modes wrench and motors: PX4 must notice a lost stream within it, tested before arming; 0: not tested"
LossLimit = Annotated[float, Real("s", _LOSS, 0.0, 60.0, "COM_OF_LOSS_T")]


class Mode(IntEnum):
    """What is sent to PX4."""

    WRENCH = 0
    MOTORS = 1
    ATTITUDE = 2


class ChosenBy(IntEnum):
    """What changes PX4 to our external mode."""

    BRIDGE = 0
    PILOT = 1


class RotorPlace(NamedTuple):
    """One rotor as PX4 describes it: body frame FRD, so y to the right; ``km`` > 0 turns counter-clockwise."""

    px: Annotated[float, Real("m", "distance in front of the centre of gravity", -10.0, 10.0, "CA_ROTORn_PX")]
    py: Annotated[float, Real("m", "distance right of the centre of gravity", -10.0, 10.0, "CA_ROTORn_PY")]
    km: Annotated[float, Real("m", "drag torque over thrust; > 0: counter-clockwise", -10.0, 10.0, "CA_ROTORn_KM")]


class AirframeParameters(NamedTuple):
    """What turns N and N m into PX4's normalised setpoints (``airframe.*``); four rotors in X, counted as PX4 does."""

    max_rotor_thrust: RotorThrust = 0.0
    drag_ratio: Annotated[float, Real("m", "true drag torque over thrust; 0: as PX4's KM", 0.0, 10.0, "k_q")] = 0.0
    thr_mdl_fac: Annotated[float, Real("", "the thrust curve set in PX4; 0: linear", 0.0, 1.0, "THR_MDL_FAC")] = 0.0
    thrust_curve: ThrustCurve = 0.0
    rotor0: RotorPlace = RotorPlace(0.15, 0.15, 0.05)
    rotor1: RotorPlace = RotorPlace(-0.15, -0.15, 0.05)
    rotor2: RotorPlace = RotorPlace(0.15, -0.15, -0.05)
    rotor3: RotorPlace = RotorPlace(-0.15, 0.15, -0.05)


class Px4BridgeParameters(NamedTuple):
    """The bridge to PX4: what it commands, whom, and when it lets go."""

    mode: Annotated[int, Choice(Mode, "what is sent to PX4: thrust and torque, motors, attitude")] = Mode.WRENCH.value
    namespace: Annotated[str, Text("prefix of /fmu, equal to UXRCE_DDS_NS; empty: none", "UXRCE_DDS_NS")] = ""
    target_system: Annotated[int, Whole("", "PX4's system number", 1, 255, "MAV_SYS_ID")] = 1
    external_mode: Annotated[str, Text("own mode in PX4's list, at most 24 letters; empty: offboard mode")] = ""
    chosen_by: Annotated[int, Choice(ChosenBy, "what selects external_mode")] = ChosenBy.BRIDGE.value
    reset_limit: ResetLimit = 0.3
    loss_limit: LossLimit = 0.25
    airframe: AirframeParameters = AirframeParameters()
    arming: ArmingParameters = ArmingParameters()
    guard: GuardParameters = GuardParameters()


PX4 = "px4_bridge"
INTERFACE = VehicleInterface(
    "quad_px4", Px4BridgeParameters, {}, "px4", "docs/how_to/px4.md", rates(4_000_000), autopilot_lands=True
)
