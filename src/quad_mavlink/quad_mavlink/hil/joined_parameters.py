"""The parameters of our plant under PX4 that our own laws fly: sensors, bridge, and waiting times."""

from typing import Annotated, NamedTuple

from quad_autopilot.parameters import ArmingParameters, ResetLimit, ThrustCurve
from quad_core.guard_parameters import GuardParameters
from quad_core.parameters import Choice, Flag, Real, Text, Whole
from quad_mavlink.hil.parameters import (
    AccelerometerParameters,
    BarometerParameters,
    GpsParameters,
    HomeParameters,
    Listen,
    MagnetometerParameters,
    Plant,
    RateGyroParameters,
    TruthPeriod,
    Weather,
)
from quad_px4.parameters import LossLimit, Mode


class GateParameters(NamedTuple):
    """How long, by the clock on the wall, the plant waits for PX4's states and the controllers (``gate.*``)."""

    watch: Annotated[
        bool,
        Flag("go on as soon as PX4, its agent and our middleware sleep (Linux, one machine)", live=False),
    ] = True
    linger: Annotated[
        float,
        Real("s", "not watched: wait for a state that may be due, before a step of the plant", 0.0, 1.0, live=False),
    ] = 0.01
    settle: Annotated[
        float,
        Real("s", "not watched: wait for outputs after a reading; offboard PX4 answers setpoints", 0.0, 1.0),
    ] = 0.002
    overdue: Annotated[
        float,
        Real("s", "wait for a state at the largest spacing known, before the plant goes on and says so", 0.01, 600.0),
    ] = 2.0
    answer_timeout: Annotated[
        float,
        Real("s", "wait for PX4's motor outputs, and for the controllers, before the flight fails", 0.1, 600.0),
    ] = 10.0


class JoinedPlantParameters(NamedTuple):
    """The plant under PX4's simulator interface and the bridge to PX4 in one vehicle interface."""

    mode: Annotated[int, Choice(("wrench", "motors"), "what is sent to PX4: thrust and torque, or motor commands")] = (
        Mode.WRENCH.value
    )
    plant: Plant = "rigid_body"
    disturbance: Weather = "none"
    sensing: Annotated[str, Text("plug-in of group quad.sensing; not used: `state` is PX4's estimate")] = "sensor"
    listen: Listen = "127.0.0.1:4560"
    namespace: Annotated[str, Text("what stands before /fmu, as UXRCE_DDS_NS says; empty: nothing", "UXRCE_DDS_NS")] = (
        ""
    )
    target_system: Annotated[int, Whole("", "PX4's system number", 1, 255, "MAV_SYS_ID")] = 1
    thrust_curve: ThrustCurve = 0.0
    reset_limit: ResetLimit = 0.3
    loss_limit: LossLimit = 0.25
    truth_period_steps: TruthPeriod = 5
    gate: GateParameters = GateParameters()
    arming: ArmingParameters = ArmingParameters()
    home: HomeParameters = HomeParameters()
    gyro: RateGyroParameters = RateGyroParameters()
    accelerometer: AccelerometerParameters = AccelerometerParameters()
    magnetometer: MagnetometerParameters = MagnetometerParameters()
    barometer: BarometerParameters = BarometerParameters()
    gps: GpsParameters = GpsParameters()
    guard: GuardParameters = GuardParameters()
