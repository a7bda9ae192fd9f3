"""Plant rigid_body: against an integration of the full model, and what must hold of a free rigid body."""

import numpy as np
import plant_cases
import pytest
from plant_cases import ASYMMETRIC, NO_DRAG, NONE, WRONG, allocate, gentle_wrench, motion, starting, vector
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation
from test_rotors import PLACES

from quad_core.types import CALM, Conditions, Rotors, Vec3, Wrench
from quad_core.vehicle import DragSign, Layout
from quad_dynamics import rigid_body
from quad_dynamics.parameters import Effectiveness, InitialRates, PlantParameters

LAGGING = ASYMMETRIC._replace(
    rotor_time_constant=0.04, rotor_inertia=3e-4, rotor_drag_coefficient=6e-5, thrust_to_weight=4.0
)
START = starting(v=(2.0, 1.0, -1.5), angles=(0.4, -0.3, 2.0), omega=(2.0, -1.5, 1.0))
TURNS = np.array([-1.0, 1.0, -1.0, 1.0])
"""Rotation about body z: rotors 1 and 3 turn clockwise seen from above."""


def flat(state):
    """Return p, v, q, omega and the true rotor speeds, without those that the vehicle is told."""
    return plant_cases.flat(state)[:17]


class Model:
    """The right side for y = (p, v, q, omega, rotor speeds) after Newton and Euler, not after the code."""

    def __init__(self, vehicle, parameters, conditions):
        self.vehicle, self.conditions = vehicle, conditions
        self.factor = parameters.effectiveness
        self.mass = vehicle.mass + parameters.mass_error + conditions.payload_mass
        inertia = np.diag([vehicle.inertia_xx, vehicle.inertia_yy, vehicle.inertia_zz])
        self.inertia = inertia + np.diag(parameters.inertia_error)
        self.drag = vehicle.drag_coefficient + parameters.drag_error
        self.lag = vehicle.rotor_time_constant + parameters.lag_error

    def rate(self, commanded):
        vehicle, c = self.vehicle, self.conditions
        places = np.array(list(PLACES[vehicle.layout].values())) * vehicle.arm_length / 0.21
        commanded = np.array(commanded)

        def f(_t, y):
            v, q, omega, speeds = y[3:6], y[6:10], y[10:13], y[13:]
            rotation = Rotation.from_quat(q).as_matrix()
            accelerating = (commanded - speeds) / self.lag
            lifts = vehicle.lift_coefficient * speeds**2 * np.array(c.rotor_effectiveness)
            air = rotation.T @ (v - np.array(c.wind_w))
            gravity = rotation.T @ [0.0, 0.0, -vehicle.gravity]
            induced = -vehicle.rotor_drag_coefficient * speeds.sum() * np.array([air[0], air[1], 0.0])
            force = [0.0, 0.0, self.factor.thrust * lifts.sum()] - self.drag * air + induced
            force = force + rotation.T @ np.array(c.force_w) + self.mass * gravity
            torque = np.cross(places, np.outer(lifts, [0.0, 0.0, 1.0])).sum(axis=0)
            torque[2] -= vehicle.torque_coefficient / vehicle.lift_coefficient * (TURNS * lifts).sum()
            torque = torque * [self.factor.roll, self.factor.pitch, self.factor.yaw]
            spin = vehicle.rotor_inertia * TURNS
            torque = torque - np.cross(omega, [0.0, 0.0, (spin * speeds).sum()]) - [0, 0, (spin * accelerating).sum()]
            torque = torque - vehicle.drag_torque_coefficient * np.abs(omega) * omega + np.array(c.torque_b)
            a, alpha = force / self.mass, np.linalg.solve(self.inertia, torque - np.cross(omega, self.inertia @ omega))
            p, r, s = omega
            four = np.array([[0, s, -r, p], [-s, 0, p, r], [r, -p, 0, s], [-p, -r, -s, 0]])
            return np.concatenate([v, rotation @ a, 0.5 * four @ q, alpha, accelerating])

        return f


WEAK = Rotors(1.0, 0.7, 0.0, 0.9)
CASES = [
    pytest.param(PlantParameters(), CALM, Layout.PLUS, id="rotors alone"),
    pytest.param(PlantParameters(), CALM, Layout.X, id="rotors alone, x"),
    pytest.param(WRONG, Conditions(wind_w=Vec3(4.0, -3.0, 1.0)), Layout.X, id="wind, every error"),
    pytest.param(
        WRONG._replace(effectiveness=Effectiveness(0.95, 0.9, 1.1, 0.8), lag_error=0.02),
        Conditions(Vec3(1.0, -2.0, 0.5), Vec3(0.02, 0.03, -0.01), Vec3(-2.0, 5.0, 0.5), 0.4, WEAK),
        Layout.X,
        id="everything",
    ),
]


def in_reach(rng, vehicle):
    while True:
        wrench = gentle_wrench(rng, vehicle)
        commanded = allocate(vehicle, wrench)
        if not any(commanded[4:]):
            return wrench, commanded.rotor_speed


@pytest.mark.parametrize(("parameters", "conditions", "layout"), CASES)
def test_flight_under_a_changing_wrench(parameters, conditions, layout):
    dt, rng = 0.002, np.random.default_rng(2)
    vehicle = LAGGING._replace(layout=layout)
    parameters = parameters._replace(substeps=4, initial=START)
    model = Model(vehicle, parameters, conditions)
    state = rigid_body.init(parameters, vehicle)
    expected = flat(state)
    known = expected[13:]
    for _ in range(120):
        wrench, commanded = in_reach(rng, vehicle)
        f = model.rate(commanded)
        expected = solve_ivp(f, (0.0, dt), expected, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
        state, actuation = rigid_body.step(parameters, vehicle, state, wrench, conditions, dt)
        # the vehicle is told what rotors with the nominal lag would do, which is the truth if there is no error
        known = commanded + (known - commanded) * np.exp(-dt / vehicle.rotor_time_constant)
        assert actuation.rotor_speed == pytest.approx(known, rel=1e-10)
        assert actuation.thrust == pytest.approx(vehicle.lift_coefficient * (known**2).sum(), rel=1e-10)
        assert state.rotor_speed == pytest.approx(expected[13:], rel=1e-10)
    np.testing.assert_allclose(motion(state), expected[:13], atol=2e-9)
    assert np.abs(expected - flat(rigid_body.init(parameters, vehicle)))[:3].max() > 0.2


@pytest.mark.parametrize(("parameters", "conditions", "layout"), CASES)
def test_lumped_terms_make_up_for_all_that_the_nominal_model_lacks(parameters, conditions, layout):
    rng = np.random.default_rng(3)
    vehicle = LAGGING._replace(layout=layout)
    parameters = parameters._replace(initial=START)
    state = rigid_body.init(parameters, vehicle)
    wrench, commanded = in_reach(rng, vehicle)
    y = flat(state)
    true = Model(vehicle, parameters, conditions).rate(commanded)(0.0, y)
    axis, omega = Rotation.from_quat(y[6:10]).as_matrix()[:, 2], y[10:13]
    inertia = np.diag([vehicle.inertia_xx, vehicle.inertia_yy, vehicle.inertia_zz])
    nominal = (axis * wrench.thrust - vehicle.drag_coefficient * y[3:6]) / vehicle.mass - [0, 0, vehicle.gravity]
    damping = vehicle.drag_torque_coefficient * np.abs(omega) * omega
    turning = np.linalg.solve(inertia, np.array(wrench.torque_b) - damping - np.cross(omega, inertia @ omega))
    lumped = rigid_body.lumped(parameters, vehicle, state, wrench, conditions)
    np.testing.assert_allclose(lumped.lumped_acceleration_w, true[3:6] - nominal, atol=1e-9)
    np.testing.assert_allclose(lumped.lumped_angular_acceleration_b, true[10:13] - turning, atol=1e-8)
    assert lumped.wind_w == conditions.wind_w
    assert lumped.payload_mass == conditions.payload_mass
    assert lumped.rotor_effectiveness == conditions.rotor_effectiveness


def test_rotor_speeds_follow_the_exact_exponential_at_any_step():
    wrench = Wrench(20.0, Vec3(0.05, -0.03, 0.01))
    commanded = np.array(allocate(LAGGING, wrench).rotor_speed)
    for dt, substeps in ((0.002, 1), (0.01, 1), (0.01, 5)):
        parameters = PlantParameters(substeps=substeps)
        state = rigid_body.init(parameters, LAGGING)
        start = flat(state)[13:]
        for k in range(1, 21):
            state, _ = rigid_body.step(parameters, LAGGING, state, wrench, CALM, dt)
            exact = commanded + (start - commanded) * np.exp(-k * dt / 0.04)
            np.testing.assert_allclose(flat(state)[13:], exact, rtol=1e-12)


def test_runge_kutta_keeps_order_four_with_everything_on():
    parameters = WRONG._replace(initial=START)
    vehicle = LAGGING._replace(drag_torque_coefficient=0.0)
    conditions = Conditions(wind_w=Vec3(3.0, 1.0, 0.0), payload_mass=0.4)
    wrench, commanded = in_reach(np.random.default_rng(5), vehicle)
    start = rigid_body.init(parameters, vehicle)
    f = Model(vehicle, parameters, conditions).rate(commanded)
    exact = solve_ivp(f, (0.0, 0.32), flat(start), method="DOP853", rtol=1e-13, atol=1e-14).y[:13, -1]
    errors = []
    for substeps in (8, 16, 32, 64):
        end, _ = rigid_body.step(parameters._replace(substeps=substeps), vehicle, start, wrench, conditions, 0.32)
        errors.append(np.abs(motion(end) - exact).max())
    assert errors[-1] > 1e-12
    np.testing.assert_allclose(np.log2(np.array(errors[:-1]) / np.array(errors[1:])), 4.0, atol=0.4)


def test_a_sagging_battery_limits_thrust_and_says_so():
    wrench = Wrench(30.0, Vec3(0.0, 0.0, 0.0))
    state = rigid_body.init(PlantParameters(), ASYMMETRIC)
    weak = Conditions(thrust_limit=0.5)
    _, full = rigid_body.step(PlantParameters(), ASYMMETRIC, state, wrench, CALM, 0.002)
    _, half = rigid_body.step(PlantParameters(), ASYMMETRIC, state, wrench, weak, 0.002)
    most = ASYMMETRIC.thrust_to_weight * ASYMMETRIC.mass * ASYMMETRIC.gravity
    assert (full.thrust, full.thrust_high) == (pytest.approx(30.0), False)
    assert (half.thrust, half.thrust_high) == (pytest.approx(0.5 * most), True)


def test_rotors_never_turn_slower_than_their_least_speed():
    vehicle = LAGGING._replace(rotor_speed_min=120.0)
    least = vehicle.lift_coefficient * 120.0**2
    idle = allocate(vehicle, Wrench(0.0, Vec3(0.0, 0.0, 0.0)))
    assert idle.rotor_speed == pytest.approx([120.0] * 4)
    assert (idle.thrust, idle.thrust_low) == (pytest.approx(4.0 * least), True)
    rng = np.random.default_rng(11)
    for _ in range(300):
        wrench = Wrench(float(rng.uniform(-5.0, 60.0)), vector(rng, 3.0))
        made = allocate(vehicle, wrench)
        assert min(made.rotor_thrust) >= least * (1.0 - 1e-12)
        if not any(made[4:]):
            assert made.thrust == pytest.approx(wrench.thrust, rel=1e-9)
            assert made.torque_b == pytest.approx(wrench.torque_b, abs=1e-9)


def test_rotors_start_at_hover_speed():
    speeds = flat(rigid_body.init(PlantParameters(), LAGGING))[13:]
    lift = LAGGING.lift_coefficient * (speeds**2).sum()
    assert lift == pytest.approx(LAGGING.mass * LAGGING.gravity, rel=1e-12)


TUMBLING = PlantParameters(initial=starting((1.0, 2.0, 50.0), (3.0, -2.0, 5.0), (0.3, -0.8, 1.2), (5.0, 0.1, 3.0)))
IDLE = Wrench(0.0, NONE)
INERTIA = np.diag([ASYMMETRIC.inertia_xx, ASYMMETRIC.inertia_yy, ASYMMETRIC.inertia_zz])


def kinetic(y):
    return 0.5 * ASYMMETRIC.mass * y[3:6] @ y[3:6], 0.5 * y[10:] @ INERTIA @ y[10:]


def energy(y):
    return sum(kinetic(y)) + ASYMMETRIC.mass * ASYMMETRIC.gravity * y[2]


def momentum(y):
    return Rotation.from_quat(y[6:10]).as_matrix() @ INERTIA @ y[10:]


def fall(vehicle, parameters, steps):
    state = rigid_body.init(parameters, vehicle)
    history = [motion(state)]
    for _ in range(steps):
        state, _ = rigid_body.step(parameters, vehicle, state, IDLE, CALM, 0.002)
        history.append(motion(state))
    return np.array(history)


def test_energy_and_angular_momentum_are_conserved_without_torque_and_drag():
    history = fall(NO_DRAG, TUMBLING, 2500)
    assert np.ptp([energy(y) for y in history]) < 1e-9 * energy(history[0])
    rotation = np.array([kinetic(y)[1] for y in history])
    assert np.ptp(rotation) < 1e-8 * rotation[0]
    spins = np.array([momentum(y) for y in history])
    assert np.abs(spins - spins[0]).max() < 1e-8 * np.linalg.norm(spins[0])
    # it does tumble: the body rates are far from constant
    assert np.ptp(history[:, 11]) > 3.0
    np.testing.assert_allclose(np.linalg.norm(history[:, 6:10], axis=1), 1.0, atol=4e-16)


def test_free_fall_is_a_parabola():
    history = fall(NO_DRAG, TUMBLING, 500)
    t = 0.002 * np.arange(501)
    start = TUMBLING.initial
    np.testing.assert_allclose(history[:, 0], start.p.x + start.v.x * t, atol=1e-11)
    np.testing.assert_allclose(history[:, 2], start.p.z + start.v.z * t - 0.5 * 9.81 * t * t, atol=1e-11)


def test_drag_takes_energy_and_the_printed_sign_adds_it():
    taken = np.array([energy(y) for y in fall(ASYMMETRIC, TUMBLING, 500)])
    assert np.diff(taken).max() < 0.0
    fast = TUMBLING._replace(drag_sign=DragSign.PRINTED)
    fast = fast._replace(initial=fast.initial._replace(omega=InitialRates(5.0, 4.0, 3.0)))
    added = np.array([energy(y) for y in fall(ASYMMETRIC, fast, 100)])
    assert np.diff(added).min() > 0.0


def test_spin_about_one_axis_decays_as_the_closed_form():
    # Izz r' = -k_T r abs(r)  =>  r = r0 / (1 + r0 k_T t / Izz)
    spin = PlantParameters(initial=starting(omega=(0.0, 0.0, -20.0)))
    history = fall(ASYMMETRIC, spin, 500)
    rate = 20.0 * ASYMMETRIC.drag_torque_coefficient * 1.0 / ASYMMETRIC.inertia_zz
    assert history[-1, 12] == pytest.approx(-20.0 / (1.0 + rate), rel=1e-9)
    decay = ASYMMETRIC.drag_coefficient / ASYMMETRIC.mass
    pushed = PlantParameters(initial=starting(v=(7.0, -3.0, 0.0)))
    assert fall(ASYMMETRIC, pushed, 500)[-1, 3:5] == pytest.approx([7.0 * np.exp(-decay), -3.0 * np.exp(-decay)])
