"""A nonlinear MPC in the place of both laws, as a yardstick: CasADi states the problem, its solver FATROP solves it.

    min  sum_i |x_i - x_ref,i|^2_Q + |u_i - u_ref,i|^2_R + |x_N - x_ref,N|^2_P    over N intervals, multiple shooting
    s.t. x_{i+1} = RK4(f, x_i, u_i),  f = eqs. 1 to 7 with a constant acceleration d (no Eq. 9),  u within the limits

x = (p, v, q, omega), u = (thrust, torque), 20 intervals of 50 ms, at the position law's rate; each problem is solved
until it converges and starts from the solution before. Between two solutions the attitude stage follows the predicted
body rates: torque = J (alpha + K (omega_ref - omega)) + omega x J omega. References of attitude, rates and inputs come
from the trajectory ahead (flatness without drag). Form: Sun, Romero, Foehn, Kaufmann and Scaramuzza, IEEE T-RO 2022.
CasADi is installed into .cache/nmpc on demand, never beside the stack.
"""

import importlib
import math
import subprocess
import sys
import time
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

from quad_core.geometry import body_z, clamp, cross
from quad_core.types import AttitudeInternals, AttitudeThrust, PositionInternals, Quat, Vec3, Wrench
from quad_core.vehicle import max_thrust
from quad_flight.stages import PerStage
from quad_position_ctrl.disturbance_observer import ObservedStep, Observer, estimate

HERE = Path(__file__).resolve().parent
PLACE = HERE.parent / ".cache" / "nmpc"
NODES, INTERVAL, TICK = 20, 0.05, 0.01
STATES, INPUTS = 13, 4
WEIGHTS = (6000.0,) * 3 + (60.0,) * 3 + (2.0,) * 4 + (0.1,) * 3
"""Of position 1/m^2, velocity s^2/m^2, quaternion and body rates s^2/rad^2."""
INPUT_WEIGHTS, RATE_GAIN, MAX_TORQUE = (0.01, 2.0, 2.0, 2.0), 25.0, 0.5
"""Of thrust 1/N^2 and torque 1/(N m)^2; 1/s of the inner rate loop; N m, as the laws' own limits."""


class Memory(NamedTuple):
    """What a stage remembers stands in the objects below."""

    steps: float = 0.0


def casadi() -> Any:
    """Return the library, installed on demand. Raises CalledProcessError if it cannot be."""
    if not (PLACE / "casadi").is_dir():
        needed = ["--no-deps", "--require-hashes", "-r", str(HERE / "nmpc-requirements.txt")]
        subprocess.run([sys.executable, "-m", "pip", "install", "-q", "--target", str(PLACE), *needed], check=True)
    if str(PLACE) not in sys.path:
        sys.path.append(str(PLACE))
    return importlib.import_module("casadi")


def model(cs: Any, vehicle: Any) -> Any:
    """Return RK4 over one interval as a CasADi function (x, u, d) -> x."""
    x, u, d = cs.SX.sym("x", STATES), cs.SX.sym("u", INPUTS), cs.SX.sym("d", 3)
    inertia = cs.DM([vehicle.inertia_xx, vehicle.inertia_yy, vehicle.inertia_zz])

    def rate(x: Any) -> Any:
        v, q, omega = x[3:6], x[6:10], x[10:13]
        a, b, c, w = q[0], q[1], q[2], q[3]
        z_axis = cs.vertcat(2 * (a * c + b * w), 2 * (b * c - a * w), 1 - 2 * (a * a + b * b))
        drag = vehicle.drag_coefficient / vehicle.mass
        acceleration = u[0] / vehicle.mass * z_axis - cs.vertcat(0, 0, vehicle.gravity) - drag * v + d
        turning = 0.5 * cs.vertcat(w * omega + cs.cross(q[:3], omega), -cs.dot(q[:3], omega))
        return cs.vertcat(v, acceleration, turning, (u[1:] - cs.cross(omega, inertia * omega)) / inertia)

    k1 = rate(x)
    k2 = rate(x + 0.5 * INTERVAL * k1)
    k3 = rate(x + 0.5 * INTERVAL * k2)
    k4 = rate(x + INTERVAL * k3)
    return cs.Function("ahead", [x, u, d], [x + INTERVAL / 6 * (k1 + 2 * k2 + 2 * k3 + k4)])


class Problem:
    """The optimal control problem of one vehicle, and its last solution."""

    def __init__(self, vehicle: Any) -> None:
        """State the problem once; each solve only changes its parameters."""
        cs = casadi()
        ahead = model(cs, vehicle)
        start, d = cs.SX.sym("start", STATES), cs.SX.sym("d", 3)
        goal = cs.SX.sym("goal", STATES + INPUTS, NODES + 1)
        variables, constraints, cost = [], [], 0
        low, high = [], []
        x = cs.SX.sym("x0", STATES)
        first = x
        free, unlimited = [-math.inf] * STATES, [math.inf] * STATES
        for i in range(NODES):
            u = cs.SX.sym(f"u{i}", INPUTS)
            following = cs.SX.sym(f"x{i + 1}", STATES)
            variables += [x, u]
            low += [*free, 0.02 * max_thrust(vehicle), *[-MAX_TORQUE] * 3]
            high += [*unlimited, max_thrust(vehicle), *[MAX_TORQUE] * 3]
            constraints.append(following - ahead(x, u, d))
            if i == 0:
                constraints.append(first - start)
            cost += _square(cs, x - goal[:STATES, i], WEIGHTS)
            cost += _square(cs, u - goal[STATES:, i], INPUT_WEIGHTS)
            x = following
        cost += 3.0 * _square(cs, x - goal[:STATES, NODES], WEIGHTS)
        variables.append(x)
        count = sum(int(one.numel()) for one in constraints)
        options = {
            "structure_detection": "auto",
            "equality": [True] * count,
            "expand": True,
            "print_time": False,
            "fatrop": {"print_level": 0, "tol": 1e-4, "mu_init": 1e-3, "max_iter": 50},
        }
        what = {
            "x": cs.vertcat(*variables),
            "f": cost,
            "g": cs.vertcat(*constraints),
            "p": cs.vertcat(start, d, cs.vec(goal)),
        }
        self.solver = cs.nlpsol("nmpc", "fatrop", what, options)
        self.low, self.high = [*low, *free], [*high, *unlimited]
        self.solution: Any = None
        self.seconds: list[float] = []
        self.failures = 0

    def solve(self, start: Any, d: Any, goal: Any) -> tuple[Any, Any]:
        """Return the first input and the body rates now, of the plan from ``start`` along ``goal`` (17 x 21)."""
        guess = self.solution
        if guess is None:
            guess = np.concatenate([goal[:, :NODES].T.ravel(), goal[:STATES, NODES]])
        began = time.perf_counter()
        found = self.solver(
            x0=guess, p=np.concatenate([start, d, goal.T.ravel()]), lbx=self.low, ubx=self.high, lbg=0.0, ubg=0.0
        )
        self.seconds.append(time.perf_counter() - began)
        if not self.solver.stats()["success"]:
            self.failures += 1
        self.solution = np.asarray(found["x"]).ravel()
        return self.solution[STATES : STATES + INPUTS], self.solution[10:13]


def _square(cs: Any, error: Any, weights: Any) -> Any:
    return cs.dot(error, cs.DM(list(weights)) * error)


class Ahead:
    """The reference of a whole flight as states and inputs, on a grid of ``TICK`` s from take-off."""

    def __init__(self, flight: Any) -> None:
        """Sample the trajectory of ``flight`` and turn it into states by flatness.

        It goes on for a horizon beyond the flight, which would else be planned to stop where the flight ends.
        """
        setup, trajectory = flight.setup, flight.modules.trajectory
        longer = setup.trajectory._replace(duration=setup.trajectory.duration + 1.1 * NODES * INTERVAL)
        setup = setup._replace(trajectory=longer)
        truth = flight.modules.plant.observe(
            setup.plant, setup.vehicle, flight.modules.plant.init(setup.plant, setup.vehicle)
        )
        plan = trajectory.plan(setup.trajectory, setup.vehicle, truth)
        end = trajectory.duration(setup.trajectory, plan)
        count = round(end / TICK) + 1
        points = [trajectory.sample(setup.trajectory, plan, i * TICK) for i in range(count)]
        self.begin = points[0].trajectory_time
        v = setup.vehicle
        lift = np.array([one.a_w for one in points]) + np.array([0.0, 0.0, v.gravity])
        thrust = v.mass * np.linalg.norm(lift, axis=1)
        q = attitudes(lift / np.linalg.norm(lift, axis=1)[:, None])
        omega = 2.0 / TICK * turn(q[:-1], q[1:])
        omega = np.vstack([omega, omega[-1]])
        inertia = np.array([v.inertia_xx, v.inertia_yy, v.inertia_zz])
        torque = inertia * np.gradient(omega, TICK, axis=0)
        position = np.array([one.p_w for one in points])
        velocity = np.array([one.v_w for one in points])
        self.table = np.column_stack([position, velocity, q, omega, thrust, torque])

    def goal(self, trajectory_time: float) -> Any:
        """Return reference states and inputs of the nodes from this time on, 17 x 21."""
        now = round((trajectory_time - self.begin) / TICK)
        steps = now + round(INTERVAL / TICK) * np.arange(NODES + 1)
        return self.table[np.minimum(steps, len(self.table) - 1)].T


def attitudes(axis: Any) -> Any:
    """Return the quaternions xyzw with heading 0 whose z axis is each row of ``axis`` (world, unit)."""
    y = np.cross(axis, [1.0, 0.0, 0.0])
    y /= np.linalg.norm(y, axis=1)[:, None]
    x = np.cross(y, axis)
    w = 0.5 * np.sqrt(np.maximum(1.0 + x[:, 0] + y[:, 1] + axis[:, 2], 1e-9))
    vector = np.column_stack([y[:, 2] - axis[:, 1], axis[:, 0] - x[:, 2], x[:, 1] - y[:, 0]])
    return np.column_stack([vector / (4.0 * w[:, None]), w])


def turn(before: Any, after: Any) -> Any:
    """Return the vector part of before^-1 after, which is half the angle in rad for small turns."""
    a, b = before[:, :3], after[:, :3]
    return before[:, 3:] * b - after[:, 3:] * a - np.cross(a, b)


class Controller:
    """Both stages of a flight under NMPC; ``observed``: with the estimate of d that AIBS uses."""

    def __init__(self, flight: Any, problem: Problem, observed: bool) -> None:
        """Prepare for ``flight``; the problem's last solution is forgotten."""
        self.problem, self.ahead, self.observed = problem, Ahead(flight), observed
        problem.solution = None
        self.estimate, self.drag = Vec3(), 0.0
        self.before: tuple[Vec3, Vec3] | None = None
        self.setpoint, self.age = None, 0.0

    def position(self, _: Any, vehicle: Any, memory: Any, inputs: Any, dt: float) -> Any:
        """Stand in for the position law: the setpoint carries thrust, body rates and their derivatives."""
        state = inputs.state
        if self.observed and self.before is not None:
            velocity, axis = self.before
            step = ObservedStep(velocity, state.v_w, axis, body_z(state.q_wb), inputs.actuation.thrust)
            drag = -vehicle.drag_coefficient / vehicle.mass
            self.estimate = estimate(Observer(), vehicle, self.estimate, step, drag, dt)
        goal = self.ahead.goal(inputs.reference.trajectory_time)
        q = np.array(state.q_wb)
        start = np.concatenate([state.p_w, state.v_w, q if q @ goal[6:10, 0] >= 0.0 else -q, state.omega_b])
        u, rates = self.problem.solve(start, self.estimate, goal)
        self.before = (state.v_w, body_z(state.q_wb))
        omega = Vec3(*map(float, rates))
        momentum = Vec3(vehicle.inertia_xx * omega.x, vehicle.inertia_yy * omega.y, vehicle.inertia_zz * omega.z)
        gyroscopic = cross(omega, momentum)
        accelerations = Vec3(
            (float(u[1]) - gyroscopic.x) / vehicle.inertia_xx,
            (float(u[2]) - gyroscopic.y) / vehicle.inertia_yy,
            (float(u[3]) - gyroscopic.z) / vehicle.inertia_zz,
        )
        setpoint = AttitudeThrust(
            Vec3(), omega, accelerations, Quat(*state.q_wb), float(u[0]), float(u[0]) / max_thrust(vehicle)
        )
        return setpoint, memory, PositionInternals()

    def attitude(self, _: Any, vehicle: Any, memory: Any, inputs: Any, dt: float) -> Any:
        """Stand in for the attitude law: follow the predicted body rates until the next solution."""
        setpoint, omega = inputs.setpoint, inputs.state.omega_b
        self.age = 0.0 if setpoint is not self.setpoint else self.age + dt
        self.setpoint = setpoint
        inertia = (vehicle.inertia_xx, vehicle.inertia_yy, vehicle.inertia_zz)
        gyroscopic = cross(omega, Vec3(*(j * w for j, w in zip(inertia, omega, strict=True))))
        torque = [
            clamp(j * (a + RATE_GAIN * (w + a * self.age - now)) + g, -MAX_TORQUE, MAX_TORQUE)
            for j, a, w, now, g in zip(inertia, setpoint.accelerations, setpoint.rates, omega, gyroscopic, strict=True)
        ]
        return Wrench(setpoint.thrust, Vec3(*torque)), memory, AttitudeInternals()


def under_nmpc(flight: Any, problem: Problem, observed: bool) -> Any:
    """Return ``flight`` with both laws replaced; only CPython can fly it."""
    controller = Controller(flight, problem, observed)
    stages = []
    for name, step, internals in (
        ("position", controller.position, PositionInternals),
        ("attitude", controller.attitude, AttitudeInternals),
    ):
        module = ModuleType(f"nmpc_{name}")
        vars(module).update(Memory=Memory, Internals=internals, init=lambda *_: Memory(), step=step)
        stages.append(module)
    return flight._replace(modules=flight.modules._replace(stages=PerStage(*stages)))
