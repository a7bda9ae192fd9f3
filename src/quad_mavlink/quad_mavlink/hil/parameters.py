"""The parameters of the plant under an autopilot's simulator interface: address, sensor errors, end of the flight."""

from typing import Annotated, NamedTuple

from quad_autopilot.parameters import ThrustCurve
from quad_core.guard_parameters import GuardParameters
from quad_core.parameters import Flag, Real, Text, Whole

_ADIS = "ADIS16448 doubled, RotorS"
_BEARD = "Beard and McLain 2012, table 7.1"


class HomeParameters(NamedTuple):
    """Where the world's origin lies (``home.*``), WGS 84, and the Earth's magnetic field there."""

    latitude: Annotated[float, Real("deg", "latitude of the world's origin", -89.0, 89.0, "", False)] = 47.397742
    longitude: Annotated[float, Real("deg", "longitude of the world's origin", -180.0, 180.0, "", False)] = 8.545594
    altitude: Annotated[float, Real("m", "height of the world's origin above sea level", -500.0, 9000.0, "", False)] = (
        488.0
    )
    field_strength: Annotated[float, Real("gauss", "magnetic field", 0.0, 1.0, "WMM 2025", False)] = 0.484
    field_declination: Annotated[
        float, Real("deg", "of the magnetic field, east of north", -180.0, 180.0, "WMM 2025", False)
    ] = 3.5
    field_inclination: Annotated[
        float, Real("deg", "of the magnetic field, below the horizon", -90.0, 90.0, "WMM 2025", False)
    ] = 63.4


class RateGyroParameters(NamedTuple):
    """White noise and a first-order Gauss-Markov bias (``gyro.*``)."""

    noise_density: Annotated[float, Real("rad/s/sqrt(Hz)", "white noise, per axis", 0.0, 1.0, _ADIS, False)] = 3.394e-4
    bias_walk: Annotated[float, Real("rad/s^2/sqrt(Hz)", "what drives the bias", 0.0, 1.0, _ADIS, False)] = 3.879e-5
    bias_time: Annotated[float, Real("s", "correlation time of the bias", 0.1, 1e6, "RotorS", False)] = 1000.0
    turn_on: Annotated[float, Real("rad/s", "standard deviation of the bias at step 0", 0.0, 1.0, _ADIS, False)] = (
        8.727e-3
    )


class AccelerometerParameters(NamedTuple):
    """White noise and a first-order Gauss-Markov bias (``accelerometer.*``)."""

    noise_density: Annotated[float, Real("m/s^2/sqrt(Hz)", "white noise, per axis", 0.0, 10.0, _ADIS, False)] = 4e-3
    bias_walk: Annotated[float, Real("m/s^3/sqrt(Hz)", "what drives the bias", 0.0, 10.0, _ADIS, False)] = 6e-3
    bias_time: Annotated[float, Real("s", "correlation time of the bias", 0.1, 1e6, "RotorS", False)] = 300.0
    turn_on: Annotated[
        float,
        Real("m/s^2", "standard deviation of the bias at step 0; 0: calibrated (RotorS: 0.196)", 0.0, 10.0, "", False),
    ] = 0.0


class MagnetometerParameters(NamedTuple):
    """White noise and a first-order Gauss-Markov bias (``magnetometer.*``)."""

    period_steps: Annotated[int, Whole("steps", "plant steps between two readings", 1, 1000, "", False)] = 4
    noise_density: Annotated[
        float, Real("gauss/sqrt(Hz)", "white noise, per axis", 0.0, 1.0, "PX4's Gazebo model", False)
    ] = 4e-4
    bias_walk: Annotated[
        float, Real("gauss/s/sqrt(Hz)", "what drives the bias", 0.0, 1.0, "PX4's Gazebo model", False)
    ] = 6.4e-6
    bias_time: Annotated[float, Real("s", "correlation time of the bias", 0.1, 1e6, "PX4's Gazebo model", False)] = (
        600.0
    )


class BarometerParameters(NamedTuple):
    """White noise and drift of the air pressure (``barometer.*``)."""

    period_steps: Annotated[int, Whole("steps", "plant steps between two readings", 1, 1000, "", False)] = 5
    noise: Annotated[
        float, Real("Pa", "standard deviation of one reading", 0.0, 1000.0, "MS5611-01BA03 data sheet", False)
    ] = 1.2
    drift: Annotated[
        float, Real("Pa/s", "steady change of the air pressure; 0.028: 1 hPa an hour", -10.0, 10.0, "", False)
    ] = 0.028


class GpsParameters(NamedTuple):
    """A slowly wandering position and a noisy velocity, late by ``delay`` (``gps.*``)."""

    period_steps: Annotated[int, Whole("steps", "plant steps between two fixes", 1, 10_000, "", False)] = 25
    walk: Annotated[
        float, Real("m/sqrt(s)", "what drives the error of latitude and longitude", 0.0, 100.0, _BEARD, False)
    ] = 0.21
    vertical_walk: Annotated[
        float, Real("m/sqrt(s)", "what drives the error of the altitude", 0.0, 100.0, _BEARD, False)
    ] = 0.40
    walk_time: Annotated[float, Real("s", "correlation time of these errors", 0.1, 1e6, _BEARD, False)] = 1100.0
    velocity_noise: Annotated[
        float, Real("m/s", "standard deviation of each velocity", 0.0, 100.0, "u-blox NEO-M8 data sheet", False)
    ] = 0.05
    delay: Annotated[
        float, Real("s", "age of a fix when it is sent", 0.0, 1.0, "EKF2_GPS_DELAY of PX4's simulator start-up", False)
    ] = 0.01


Plant = Annotated[str, Text("plug-in of group quad.plant; its parameters stand under its name")]
Weather = Annotated[str, Text("plug-in of group quad.disturbance; its parameters stand under its name")]
Listen = Annotated[str, Text("host:port on which one autopilot is awaited; 0.0.0.0 takes it from other machines")]
TruthPeriod = Annotated[
    int, Whole("steps", "HIL_STATE_QUATERNION, truth for the autopilot's own log, once in so many steps", 1, 1000)
]


class HilPlantParameters(NamedTuple):
    """The plant under an autopilot's simulator interface: what flies, who may connect, when the flight ends."""

    plant: Plant = "rigid_body"
    disturbance: Weather = "none"
    sensing: Annotated[str, Text("plug-in of group quad.sensing: what `state` shows; the autopilot has its own")] = (
        "sensor"
    )
    listen: Listen = "127.0.0.1:4560"
    thrust_curve: ThrustCurve = 0.0
    answer_timeout: Annotated[
        float,
        Real("s", "wall-clock time without an answer after which the flight fails", 0.1, 3600.0, live=False),
    ] = 10.0
    duration: Annotated[
        float, Real("s", "flight time after which the flight ends; 0: when the autopilot leaves", 0.0, 1e5, "", False)
    ] = 0.0
    end_disarmed: Annotated[bool, Flag("end the flight once the autopilot disarms after it was armed", live=False)] = (
        False
    )
    truth_period_steps: TruthPeriod = 5
    window: Annotated[
        int, Whole("steps", "how far the plant may run ahead of what the recorder has acknowledged", 1, 200)
    ] = 60
    odom_period_steps: Annotated[int, Whole("steps", "odometry for tools once in so many steps", 1, 100_000)] = 10
    clock_period_steps: Annotated[int, Whole("steps", "clock once in so many steps", 1, 100_000)] = 5
    publish_state: Annotated[
        bool, Flag("false: another node, such as odometry_relay, makes `state`, here from odom", live=False)
    ] = True
    home: HomeParameters = HomeParameters()
    gyro: RateGyroParameters = RateGyroParameters()
    accelerometer: AccelerometerParameters = AccelerometerParameters()
    magnetometer: MagnetometerParameters = MagnetometerParameters()
    barometer: BarometerParameters = BarometerParameters()
    gps: GpsParameters = GpsParameters()
    guard: GuardParameters = GuardParameters()
