"""The true vehicle, the nominal one, and the lumped uncertainties D_P and D_A (Eqs. 10-12).

Eq. 11 did not survive in the source; it follows from Eq. 10 and Lemma 1. Eq. 10, with the outer force f and torque t
(f = m d, t = I d of Appendix A) and tau_G = 0, reads::

    (m + dm) P''     = F_A + dF_A + F_G + dF_G + F_D + f
    (I + dI) Omega'  = -Omega x (I + dI) Omega + tau_A + dtau_A + tau_D + t

where F_A and tau_A are what the *commanded* wrench would give, and dF_A = R (0, 0, e_T T - T_cmd), dtau_A = e tau -
tau_cmd hold the rotors' limits (achieved T, tau) and the loss of effectiveness (e). Lemma 1 with A = m, BCD = dm, and
with A = I, BCD = dI, splits the inverse of the left side; then Eq. 11 is::

    P''    = m^-1 (F_A + F_G + F_D) + D_P
    Omega' = I^-1 (-Omega x I Omega + tau_A + tau_D) + D_A                                            (Eq. 11)

    D_P = (m + dm)^-1 (dF_A + dF_G + f) - (1 + m^-1 dm)^-1 m^-1 dm m^-1 (F_A + F_G + F_D)
    D_A = (I + dI)^-1 (-Omega x dI Omega + dtau_A + t)
          - (E + I^-1 dI)^-1 I^-1 dI I^-1 (-Omega x I Omega + tau_A + tau_D)

that is: the true acceleration minus the one that the nominal model expects of the commanded wrench. It is computed as
just this difference; a test holds it against the formulas above. What a plant has beyond Eq. 10 (lag, wind, ground)
adds to the true acceleration and so to D_P and D_A.
"""

from quad_core.geometry import clamp
from quad_core.types import Wrench
from quad_core.vehicle import Triple, Vehicle
from quad_dynamics.newton_euler import angular_acceleration, linear_acceleration, nominal_body, true_body
from quad_dynamics.parameters import PlantParameters
from quad_dynamics.rotors import LARGEST_TORQUE, rotor_lag

SMALLEST_MASS = 1e-3
SMALLEST_INERTIA = 1e-7


def check_true_body(parameters: PlantParameters, vehicle: Vehicle) -> None:
    """Raise ValueError naming the parameter if the errors leave no physical mass, inertia, drag or lag."""
    body = true_body(parameters, vehicle, 0.0)
    if not body.mass >= SMALLEST_MASS:
        raise ValueError("mass_error: found vehicle.mass + mass_error below 0.001 kg, expected at least that")
    if not body.drag_coefficient >= 0.0:
        raise ValueError("drag_error: found vehicle.drag_coefficient + drag_error below 0, expected at least that")
    if not rotor_lag(parameters, vehicle) >= 0.0:
        raise ValueError("lag_error: found vehicle.rotor_time_constant + lag_error below 0 s, expected at least that")
    if not body.inertia_xx >= SMALLEST_INERTIA:
        raise ValueError("inertia_error.xx: found vehicle.inertia_xx + error below 1e-7 kg m^2, expected at least that")
    if not body.inertia_yy >= SMALLEST_INERTIA:
        raise ValueError("inertia_error.yy: found vehicle.inertia_yy + error below 1e-7 kg m^2, expected at least that")
    if not body.inertia_zz >= SMALLEST_INERTIA:
        raise ValueError("inertia_error.zz: found vehicle.inertia_zz + error below 1e-7 kg m^2, expected at least that")


def nominal_acceleration(
    parameters: PlantParameters, vehicle: Vehicle, axis_w: Triple, v_w: Triple, rates: Triple, wrench: Wrench
) -> tuple[Triple, Triple]:
    """Return P'' in m/s^2 (world) and Omega' in rad/s^2 that the nominal model expects of the commanded ``wrench``.

    ``axis_w`` body z axis in the world, ``v_w`` m/s, ``rates`` rad/s (body rates, or the Euler rates of Eq. 16).
    """
    nominal = nominal_body(parameters, vehicle)
    torque = (
        clamp(wrench.torque_b.x, -LARGEST_TORQUE, LARGEST_TORQUE),
        clamp(wrench.torque_b.y, -LARGEST_TORQUE, LARGEST_TORQUE),
        clamp(wrench.torque_b.z, -LARGEST_TORQUE, LARGEST_TORQUE),
    )
    thrust = clamp(wrench.thrust, -LARGEST_TORQUE, LARGEST_TORQUE)
    linear = linear_acceleration(nominal, axis_w, thrust, v_w, (0.0, 0.0, 0.0))
    return linear, angular_acceleration(nominal, rates, torque)
