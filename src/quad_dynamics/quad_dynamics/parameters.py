"""Parameters that both plants take: how they integrate, how they differ from the nominal vehicle, where they start."""

from typing import Annotated, NamedTuple

from quad_core.parameters import Choice, Flag, Real, Whole
from quad_core.vehicle import DragSign


class InertiaError(NamedTuple):
    """Diagonal of dI of Eq. 10."""

    xx: Annotated[float, Real("kg m^2", "true minus nominal inertia about body x", -100.0, 100.0, "Eq. 10")] = 0.0
    yy: Annotated[float, Real("kg m^2", "true minus nominal inertia about body y", -100.0, 100.0, "Eq. 10")] = 0.0
    zz: Annotated[float, Real("kg m^2", "true minus nominal inertia about body z", -100.0, 100.0, "Eq. 10")] = 0.0


class Effectiveness(NamedTuple):
    """True over nominal control effectiveness: Delta F_A and Delta tau_A of Eq. 10 as factors."""

    thrust: Annotated[float, Real("", "true over nominal thrust; 1: intact", 0.0, 2.0, "Eq. 10")] = 1.0
    roll: Annotated[float, Real("", "true over nominal roll torque; 1: intact", 0.0, 2.0, "Eq. 10")] = 1.0
    pitch: Annotated[float, Real("", "true over nominal pitch torque; 1: intact", 0.0, 2.0, "Eq. 10")] = 1.0
    yaw: Annotated[float, Real("", "true over nominal yaw torque; 1: intact", 0.0, 2.0, "Eq. 10")] = 1.0


class InitialPosition(NamedTuple):
    """Where the flight starts, world frame."""

    x: Annotated[float, Real("m", "initial position east", -1e4, 1e4, "x7")] = 0.0
    y: Annotated[float, Real("m", "initial position north", -1e4, 1e4, "x9")] = 0.0
    z: Annotated[float, Real("m", "initial height", -1e4, 1e4, "x11")] = 0.0


class InitialVelocity(NamedTuple):
    """Velocity at the start, world frame."""

    x: Annotated[float, Real("m/s", "initial velocity east", -1e3, 1e3, "x8")] = 0.0
    y: Annotated[float, Real("m/s", "initial velocity north", -1e3, 1e3, "x10")] = 0.0
    z: Annotated[float, Real("m/s", "initial velocity up", -1e3, 1e3, "x12")] = 0.0


class InitialAngles(NamedTuple):
    """Z-Y-X Euler angles at the start."""

    phi: Annotated[float, Real("rad", "initial roll", -3.14, 3.14, "x1")] = 0.0
    theta: Annotated[float, Real("rad", "initial pitch", -1.5, 1.5, "x3")] = 0.0
    psi: Annotated[float, Real("rad", "initial yaw", -3.15, 3.15, "x5")] = 0.0


class InitialRates(NamedTuple):
    """Angular velocity at the start, body frame (both plants; the paper's Euler rates follow by Eq. 13)."""

    x: Annotated[float, Real("rad/s", "initial angular velocity p about body x", -1e3, 1e3, "")] = 0.0
    y: Annotated[float, Real("rad/s", "initial angular velocity q about body y", -1e3, 1e3, "")] = 0.0
    z: Annotated[float, Real("rad/s", "initial angular velocity r about body z", -1e3, 1e3, "")] = 0.0


class Initial(NamedTuple):
    """State at step 0; the paper starts at rest in the origin."""

    p: InitialPosition = InitialPosition()
    v: InitialVelocity = InitialVelocity()
    angles: InitialAngles = InitialAngles()
    omega: InitialRates = InitialRates()


class Ground(NamedTuple):
    """A flat ground under four feet, one below each rotor; elastic, damped, with friction."""

    enabled: Annotated[bool, Flag("false: no ground; plants rigid_body and mujoco")] = False
    height: Annotated[float, Real("m", "height of the ground, world frame", -1e4, 1e4, "")] = 0.0
    foot_depth: Annotated[float, Real("m", "how far the feet reach below the centre of gravity", 0.001, 10.0, "")] = 0.1
    friction: Annotated[float, Real("", "coefficient of sliding friction", 0.0, 10.0, "")] = 0.8


class PlantParameters(NamedTuple):
    """Parameters of the plants; the errors are what no law knows of the vehicle."""

    substeps: Annotated[int, Whole("", "Runge-Kutta steps per plant period; larger: more exact, slower", 1, 1000)] = 1
    drag_sign: Annotated[
        int, Choice(DragSign, "corrected: drag opposes motion; printed: as eqs. 5 and 9", "Eq. 5, Eq. 9")
    ] = DragSign.CORRECTED.value
    mass_error: Annotated[float, Real("kg", "true minus nominal mass", -1000.0, 1000.0, "Eq. 10")] = 0.0
    inertia_error: InertiaError = InertiaError()
    drag_error: Annotated[float, Real("N s/m", "true minus nominal drag k_F", -100.0, 100.0, "Eq. 5, as Eq. 10")] = 0.0
    lag_error: Annotated[
        float, Real("s", "true minus nominal rotor lag; `actuation` tells the nominal; not plant paper", -1.0, 1.0)
    ] = 0.0
    effectiveness: Effectiveness = Effectiveness()
    ground: Ground = Ground()
    initial: Initial = Initial()
