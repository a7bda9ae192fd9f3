"""A plant of your own: a point mass that turns at once, for a first look at a position law.

    m p'' = F_T R(phi, theta, psi) e_3 - m g e_3 + D,    I omega' = tau

The torque turns each axis by itself, without gyroscopic terms; wind, payload and rotor faults are not modelled.

Fly it: scripts/fly case1 --plant my_plant
"""

import math
from typing import Annotated, NamedTuple

from quad_core.cycle import as_disturbance
from quad_core.geometry import quaternion_from_euler
from quad_core.parameters import Real
from quad_core.types import Actuation, Conditions, Disturbance, Rotors, Vec3, VehicleState, Wrench
from quad_core.vehicle import Vehicle


class Parameters(NamedTuple):
    """Where the vehicle starts."""

    height: Annotated[float, Real("m", "height above the origin at step 0", -1000.0, 1000.0)] = 0.0


class State(NamedTuple):
    """All that the plant carries from step to step: position m, velocity m/s, angles rad and their rates rad/s."""

    p_w: Vec3 = Vec3()
    v_w: Vec3 = Vec3()
    angles: Vec3 = Vec3()
    rates: Vec3 = Vec3()


def init(parameters: Parameters, vehicle: Vehicle) -> State:
    """Return the state at step 0: at rest."""
    zero = Vec3(0.0, 0.0, 0.0)
    return State(Vec3(0.0, 0.0, parameters.height), zero, zero, zero)


def step(
    parameters: Parameters, vehicle: Vehicle, state: State, wrench: Wrench, conditions: Conditions, dt: float
) -> tuple[State, Actuation]:
    """Return the state ``dt`` s later under ``wrench``, and what the vehicle made of it: exactly that."""
    outer_force, turn = conditions.force_w, conditions.torque_b
    phi, theta, psi = state.angles
    lift = wrench.thrust / vehicle.mass
    ax = lift * (math.cos(phi) * math.sin(theta) * math.cos(psi) + math.sin(phi) * math.sin(psi))
    ay = lift * (math.cos(phi) * math.sin(theta) * math.sin(psi) - math.sin(phi) * math.cos(psi))
    az = lift * math.cos(phi) * math.cos(theta) - vehicle.gravity
    m = vehicle.mass
    v = Vec3(
        state.v_w.x + dt * (ax + outer_force.x / m),
        state.v_w.y + dt * (ay + outer_force.y / m),
        state.v_w.z + dt * (az + outer_force.z / m),
    )
    p = Vec3(state.p_w.x + dt * v.x, state.p_w.y + dt * v.y, state.p_w.z + dt * v.z)
    torque = wrench.torque_b
    rates = Vec3(
        state.rates.x + dt * (torque.x + turn.x) / vehicle.inertia_xx,
        state.rates.y + dt * (torque.y + turn.y) / vehicle.inertia_yy,
        state.rates.z + dt * (torque.z + turn.z) / vehicle.inertia_zz,
    )
    angles = Vec3(phi + dt * rates.x, theta + dt * rates.y, psi + dt * rates.z)
    none = Rotors(0.0, 0.0, 0.0, 0.0)
    actuation = Actuation(none, none, wrench.thrust, torque, False, False, False, False, False)
    return State(p, v, angles, rates), actuation


def observe(parameters: Parameters, vehicle: Vehicle, state: State) -> VehicleState:
    """Return the true state, as topic ``truth`` carries it."""
    return VehicleState(state.p_w, state.v_w, quaternion_from_euler(state.angles), state.rates)


def lumped(
    parameters: Parameters, vehicle: Vehicle, state: State, wrench: Wrench, conditions: Conditions
) -> Disturbance:
    """Return what acts beyond the nominal model: outer force and torque, as accelerations."""
    outer_force, turn = conditions.force_w, conditions.torque_b
    m = vehicle.mass
    linear = Vec3(outer_force.x / m, outer_force.y / m, outer_force.z / m)
    angular = Vec3(turn.x / vehicle.inertia_xx, turn.y / vehicle.inertia_yy, turn.z / vehicle.inertia_zz)
    return as_disturbance(conditions, linear, angular)
