"""A vehicle owner on paper: feeds the guard step by step."""

import math

from quad_core.enumerations import GuardRequest
from quad_core.geometry import quaternion_from_euler
from quad_core.node_parameters import GuardParameters
from quad_core.types import Vec3, VehicleState, Wrench
from quad_core.vehicle import Vehicle
from quad_guard import guard
from quad_guard.checks import StateSample, WrenchCommand
from quad_guard.guard import Inputs

PERIOD = 2_000_000
DT = 0.002
VEHICLE = Vehicle()
HOVER = Wrench(VEHICLE.mass * VEHICLE.gravity, Vec3(0.0, 0.0, 0.0))


def flying(height=5.0, x=0.0, roll=0.0, rates=(0.0, 0.0, 0.0)):
    """Return a state that drifts at 1 m/s, so that it is never taken for frozen."""
    q = quaternion_from_euler(Vec3(roll, 0.0, 0.0))
    return VehicleState(Vec3(x, 0.0, height), Vec3(1.0, 0.0, 0.0), q, Vec3(*rates))


class Owner:
    """Owns a vehicle on paper; ``run`` flies steps. Of the last one: ``report``, ``refusals`` of command and sample.

    ``events``: the changes of mode.
    """

    def __init__(self, vehicle=VEHICLE, period=PERIOD, **changes):
        self.parameters = GuardParameters(**changes)
        self.vehicle, self.period, self.dt = vehicle, period, period / 1e9
        self.memory = guard.FRESH_MEMORY
        self.step = 0
        self.report = self.refusals = None
        self.wrench = None
        self.events = []

    def good_command(self, wrench=HOVER):
        return WrenchCommand(wrench, self.step, True)

    def good_sample(self, **state):
        return self.sample(flying(x=self.step * self.dt, **state))

    def sample(self, state):
        return StateSample(state, self.step, True)

    def once(self, command=None, sample=None, request=GuardRequest.NONE):
        command = self.good_command() if command is None else command
        sample = self.good_sample() if sample is None else sample
        inputs = Inputs(self.step, self.period, command, sample, request)
        before = self.memory.mode
        self.wrench, self.memory, found = guard.step(self.parameters, self.vehicle, self.memory, inputs, self.dt)
        self.report, self.refusals = found.status, found[1:]
        if self.report.mode != before:
            self.events.append((self.step, self.report.mode, self.report.reason))
        self.step += 1
        return self.report

    def run(self, seconds, command=None, sample=None, request=GuardRequest.NONE):
        """Fly for ``seconds``; ``command`` and ``sample`` are called at every step with this owner."""
        for _ in range(round(seconds / self.dt)):
            self.once(command(self) if command else None, sample(self) if sample else None, request)
        return self.report


def silent(owner):
    """Return what an owner has of a controller that no longer speaks."""
    return owner.good_command()._replace(arrived=False)


def no_state(owner):
    """Return what an owner has of an estimator that no longer speaks."""
    return owner.good_sample()._replace(arrived=False)


def leaning(degrees, height=5.0):
    """Return a source of samples that lean."""
    return lambda owner: owner.good_sample(roll=math.radians(degrees), height=height)
