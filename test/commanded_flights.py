"""Flights of the commander, the paper's laws, the guard and a plant with a ground, without ROS.

All that a flight remembers is immutable but the commander, so ``Flight.fork`` costs nothing and one hover serves for
many faults.
"""

import copy
import math

from guard_flights import ATTITUDE, POSITION

from quad_attitude_ctrl import abfnitsm
from quad_commander.commander_core import CommanderCore, Inputs
from quad_commander.missions import parse
from quad_commander.parameters import CommanderParameters
from quad_commander.request_queue import PendingRequest
from quad_core.cycle import seconds
from quad_core.enumerations import Mode, Request
from quad_core.geometry import norm
from quad_core.node_parameters import GuardParameters
from quad_core.types import (
    CALM,
    Actuation,
    AttitudeInputs,
    AttitudeThrust,
    GuardStatus,
    PositionInputs,
    SensorFault,
    TrajectoryPoint,
    Wrench,
)
from quad_core.vehicle import Vehicle
from quad_dynamics import rigid_body, sensor
from quad_dynamics.ground import SINK
from quad_dynamics.parameters import Ground, PlantParameters
from quad_guard import guard
from quad_guard.checks import StateSample, WrenchCommand
from quad_position_ctrl import aibs

PERIOD = 2_000_000
STEPS = 5  # of the commander and the position controller
VEHICLE = Vehicle()
GROUND = Ground(enabled=True, height=SINK - Ground().foot_depth)
QUIET = (Mode.DISARMED, Mode.ARMING, Mode.PILOT)
PERFECT = SensorFault()


class Flight:
    """A mission from the ground on; ``truth`` and ``mode`` are those of the next plant step ``k``.

    ``acts(k)`` gives the ``Conditions`` and ``fault(k)`` the ``SensorFault`` of a step. ``disarmed`` is (height m,
    speed m/s, tilt rad) of the truth at each step at which the motors were stopped by a mode.
    """

    def __init__(self, mission, acts=lambda k: CALM, fault=lambda k: PERFECT, plant=rigid_body, vehicle=VEHICLE):
        self.vehicle, self.acts, self.fault, self.plant = vehicle, acts, fault, plant
        self.parameters = PlantParameters(ground=GROUND)
        self.guard_parameters = GuardParameters(has_commander=True)
        self.state = plant.init(self.parameters, vehicle)
        self.truth = plant.observe(self.parameters, vehicle, self.state)
        self.sensing = sensor.Parameters()
        self.line, self.seen = sensor.init(self.sensing, PERIOD)
        self.noise = sensor.draw(self.sensing, 1, 2)
        self.core = CommanderCore(CommanderParameters(), parse(mission, []), self.truth)
        self.memory = guard.FRESH_MEMORY
        self.report = None
        self.position, self.attitude = aibs.init(POSITION, vehicle), abfnitsm.init(ATTITUDE, vehicle)
        self.reference, self.setpoint, self.actuation = TrajectoryPoint(), AttitudeThrust(), Actuation()
        self.k, self.said, self.disarmed, self.news = 0, None, [], []
        self.largest_tilt = 0.0

    @property
    def mode(self):
        return self.core.mode

    @property
    def is_over(self):
        return self.said is not None and self.said.mode.is_over

    def fork(self, **changes):
        """Return a copy that flies on by itself, with other ``acts`` or ``fault``."""
        twin = copy.copy(self)
        twin.core = copy.deepcopy(self.core)
        twin.line = self.line.copy()
        twin.disarmed, twin.news = list(self.disarmed), list(self.news)
        for name, value in changes.items():
            setattr(twin, name, value)
        return twin

    def go(self, duration, *asked, until=lambda flight: flight.is_over):
        """Fly ``duration`` s, sooner at ``until``; ``asked`` are requests of an operator at the first decision."""
        asked = [PendingRequest(request, "operator") for request in asked]
        for _ in range(round(duration * 1e9 / PERIOD)):
            if until(self):
                break
            asked = self.step(asked)
        return self

    def step(self, asked=()):
        k, dt, vehicle = self.k, seconds(1, PERIOD), self.vehicle
        conditions = self.acts(k)
        state, self.seen = sensor.step(self.sensing, self.noise, self.line, self.seen, self.truth, self.fault(k), k)
        self.read = state
        if k % STEPS == 0:
            self.decide(state, asked)
            asked = ()
            inputs = PositionInputs(state, self.reference, self.actuation)
            self.setpoint, self.position, _ = aibs.step(POSITION, vehicle, self.position, inputs, STEPS * dt)
        inputs = AttitudeInputs(state, self.setpoint, self.actuation)
        wrench, self.attitude, _ = abfnitsm.step(ATTITUDE, vehicle, self.attitude, inputs, dt)
        flown = Wrench()
        if self.mode in QUIET:
            self.memory, self.report = guard.FRESH_MEMORY, None
        else:
            command = WrenchCommand(wrench, k, True)
            sample = StateSample(state, k, True)
            given = guard.Inputs(k, PERIOD, command, sample, self.said.mode.guard_request)
            flown, self.memory, self.report = guard.step(self.guard_parameters, vehicle, self.memory, given, dt)
        self.state, self.actuation = self.plant.step(self.parameters, vehicle, self.state, flown, conditions, dt)
        self.truth = self.plant.observe(self.parameters, vehicle, self.state)
        self.largest_tilt = max(self.largest_tilt, tilt(self.truth))
        self.k += 1
        return asked

    def decide(self, state, asked):
        report, before = self.report, self.mode
        seen = GuardStatus() if report is None else report.status
        self.said = self.core.step(
            Inputs(
                step=self.k,
                dt=seconds(STEPS, PERIOD),
                state=state,
                mission=None,
                mission_lag=0.0,
                guard=seen,
                refusals=[] if before == Mode.ARMING else None,
            ),
            asked,
        )
        self.reference = self.said.reference
        self.news += [(self.k, *found) for found in self.said.news]
        if before not in QUIET and self.mode in QUIET:
            self.disarmed.append((self.truth.p_w.z, norm(self.truth.v_w), tilt(self.truth)))


def tilt(state):
    """Return the angle in rad between body z and the vertical."""
    x, y = state.q_wb.x, state.q_wb.y
    return math.acos(max(-1.0, min(1.0, 1.0 - 2.0 * (x * x + y * y))))


def hovering(height=5.0, settled=6.0, **how):
    """Return a flight in HOLD at ``height`` m, ``settled`` s after its take-off; nobody asks for a landing."""
    flight = Flight(f"takeoff:{height:g},hold:3600,land", **how)
    flight.go(60.0, until=lambda it: it.mode == Mode.HOLD)
    return flight.go(settled)


def landed(flight, longest=120.0):
    """Ask for a landing and return ``flight`` at its end."""
    return flight.go(longest, Request.LAND)
