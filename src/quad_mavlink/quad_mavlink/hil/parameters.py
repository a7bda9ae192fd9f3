"""The parameters of our plant under PX4 that our own laws fly: sensors, bridge, and waiting times."""

from typing import Annotated, NamedTuple

from quad_autopilot.parameters import ArmingParameters, ResetLimit, ThrustCurve
from quad_core.guard_parameters import GuardParameters
from quad_core.parameters import Choice, Real, Text, Whole
from quad_px4.parameters import LossLimit, Mode

_ADIS = "ADIS16448 doubled, RotorS"
_BEARD = "Beard and McLain 2012, table 7.1"


class HomeParameters(NamedTuple):
    """Where the world's origin lies (``home.*``), WGS 84, and the Earth's magnetic field there."""

    latitude: Annotated[float, Real("deg", "latitude of the world's origin", -89.0, 89.0)] = 47.397742
    longitude: Annotated[float, Real("deg", "longitude of the world's origin", -180.0, 180.0)] = 8.545594
    altitude: Annotated[float, Real("m", "height of the world's origin above sea level", -500.0, 9000.0)] = 488.0
    field_strength: Annotated[float, Real("gauss", "strength of magnetic field", 0.0, 1.0, "WMM 2025")] = 0.484
    field_declination: Annotated[
        float, Real("deg", "direction of the magnetic field, east of north", -180.0, 180.0, "WMM 2025")
    ] = 3.5
    field_inclination: Annotated[
        float, Real("deg", "angle of the magnetic field below the horizon", -90.0, 90.0, "WMM 2025")
    ] = 63.4


class RateGyroParameters(NamedTuple):
    """White noise and a first-order Gauss-Markov bias (``gyro.*``)."""

    noise_density: Annotated[float, Real("rad/s/sqrt(Hz)", "white noise density", 0.0, 1.0, _ADIS)] = 3.394e-4
    bias_walk: Annotated[float, Real("rad/s^2/sqrt(Hz)", "drives the bias; 0: off", 0.0, 1.0, _ADIS)] = 3.879e-5
    bias_time: Annotated[float, Real("s", "correlation time of the bias", 0.1, 1e6, "RotorS")] = 1000.0
    turn_on: Annotated[float, Real("rad/s", "standard deviation of the bias at step 0", 0.0, 1.0, _ADIS)] = 8.727e-3


class AccelerometerParameters(NamedTuple):
    """White noise and a first-order Gauss-Markov bias (``accelerometer.*``)."""

    noise_density: Annotated[float, Real("m/s^2/sqrt(Hz)", "white noise density", 0.0, 10.0, _ADIS)] = 4e-3
    bias_walk: Annotated[float, Real("m/s^3/sqrt(Hz)", "drives the bias; 0: off", 0.0, 10.0, _ADIS)] = 6e-3
    bias_time: Annotated[float, Real("s", "correlation time of the bias", 0.1, 1e6, "RotorS")] = 300.0
    turn_on: Annotated[
        float, Real("m/s^2", "standard deviation of the bias at step 0; 0: calibrated (RotorS: 0.196)", 0.0, 10.0)
    ] = 0.0


class MagnetometerParameters(NamedTuple):
    """White noise and a first-order Gauss-Markov bias (``magnetometer.*``)."""

    period_steps: Annotated[int, Whole("steps", "plant steps between two readings", 1, 1000)] = 4
    noise_density: Annotated[float, Real("gauss/sqrt(Hz)", "white noise density", 0.0, 1.0, "PX4's Gazebo model")] = (
        4e-4
    )
    bias_walk: Annotated[float, Real("gauss/s/sqrt(Hz)", "drives the bias; 0: off", 0.0, 1.0, "PX4's Gazebo model")] = (
        6.4e-6
    )
    bias_time: Annotated[float, Real("s", "correlation time of the bias", 0.1, 1e6, "PX4's Gazebo model")] = 600.0


class BarometerParameters(NamedTuple):
    """White noise and drift of the air pressure (``barometer.*``)."""

    period_steps: Annotated[int, Whole("steps", "plant steps between two readings", 1, 1000)] = 5
    noise: Annotated[
        float, Real("Pa", "standard deviation of one reading; 0: none", 0.0, 1000.0, "MS5611-01BA03 data sheet")
    ] = 1.2
    drift: Annotated[float, Real("Pa/s", "steady change of the air pressure; 0.028: 1 hPa an hour", -10.0, 10.0)] = (
        0.028
    )


class GpsParameters(NamedTuple):
    """A slowly wandering position and a noisy velocity, late by ``delay`` (``gps.*``)."""

    period_steps: Annotated[int, Whole("steps", "plant steps between two fixes", 1, 10_000)] = 25
    walk: Annotated[
        float, Real("m/sqrt(s)", "noise that drives the error of latitude and longitude", 0.0, 100.0, _BEARD)
    ] = 0.21
    vertical_walk: Annotated[
        float, Real("m/sqrt(s)", "noise that drives the error of the altitude; 0: none", 0.0, 100.0, _BEARD)
    ] = 0.40
    walk_time: Annotated[float, Real("s", "correlation time of both errors", 0.1, 1e6, _BEARD)] = 1100.0
    velocity_noise: Annotated[
        float, Real("m/s", "standard deviation of each velocity", 0.0, 100.0, "u-blox NEO-M8 data sheet")
    ] = 0.05
    delay: Annotated[
        float, Real("s", "age of a fix when it is sent", 0.0, 1.0, "EKF2_GPS_DELAY of PX4's simulator start-up")
    ] = 0.01


class GateParameters(NamedTuple):
    """How long, by the clock on the wall, the plant waits for PX4's states and the controllers (``gate.*``)."""

    settle: Annotated[
        float, Real("s", "wait for PX4's outputs after a reading (offboard PX4 answers setpoints only)", 0.0, 1.0)
    ] = 0.002
    linger: Annotated[
        float, Real("s", "wait for outputs after a wrench, and for a state that may be due", 0.0, 1.0)
    ] = 0.01
    overdue: Annotated[
        float,
        Real("s", "wait for a state that is due, before the plant goes on with an event", 0.01, 600.0),
    ] = 2.0
    answer_timeout: Annotated[
        float, Real("s", "wait for PX4's motor outputs and for the controllers; then the flight fails", 0.1, 600.0)
    ] = 10.0


class JoinedPlantParameters(NamedTuple):
    """The plant under PX4's simulator interface and the bridge to PX4 in one vehicle interface."""

    mode: Annotated[int, Choice(("wrench", "motors"), "what is sent to PX4: thrust and torque, or motor commands")] = (
        Mode.WRENCH.value
    )
    plant: Annotated[str, Text("plug-in of group quad.plant; its parameters stand under its name")] = "rigid_body"
    disturbance: Annotated[str, Text("plug-in of group quad.disturbance; its parameters stand under its name")] = "none"
    sensing: Annotated[str, Text("plug-in of group quad.sensing; not used: `state` is PX4's estimate")] = "sensor"
    listen: Annotated[str, Text("host:port on which PX4 connects; 0.0.0.0: from other machines, too")] = (
        "127.0.0.1:4560"
    )
    namespace: Annotated[str, Text("prefix of /fmu, equal to UXRCE_DDS_NS; empty: none", "UXRCE_DDS_NS")] = ""
    target_system: Annotated[int, Whole("", "PX4's system number", 1, 255, "MAV_SYS_ID")] = 1
    thrust_curve: ThrustCurve = 0.0
    reset_limit: ResetLimit = 0.3
    loss_limit: LossLimit = 0.25
    truth_period_steps: Annotated[
        int, Whole("steps", "steps between two HIL_STATE_QUATERNION, the truth in PX4's own log", 1, 1000)
    ] = 5
    gate: GateParameters = GateParameters()
    arming: ArmingParameters = ArmingParameters()
    home: HomeParameters = HomeParameters()
    gyro: RateGyroParameters = RateGyroParameters()
    accelerometer: AccelerometerParameters = AccelerometerParameters()
    magnetometer: MagnetometerParameters = MagnetometerParameters()
    barometer: BarometerParameters = BarometerParameters()
    gps: GpsParameters = GpsParameters()
    guard: GuardParameters = GuardParameters()
