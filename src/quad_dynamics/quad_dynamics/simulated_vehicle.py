"""What the simulated vehicle does in a plant step, in this order: sensors, command link, guard, plant.

    state[k]     = sensing(truth[k])                              ``sense``
    received[k]  = link(command[k])                               ``receive``
    wrench[k]    = guard(received[k], state[k])                   ``quad_guard.guard.step``
    truth[k + 1] = plant(wrench[k])                               ``move``

A command that overtakes an older one on the link makes it void: what the plant applies is the newest that has arrived.

The loop without ROS and the simulator's node call these functions, so both give the same bits. ``vehicle_functions``
makes them of the chosen plug-ins.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_core.cycle import seconds
from quad_core.lift_off import LiftOff, airborne, lifted_off
from quad_core.types import (
    Actuation,
    Conditions,
    LinkFault,
    Rotors,
    Vec3,
    VehicleState,
    Wrench,
    fresh,
    is_faulty,
    with_ground,
)
from quad_core.vehicle import Vehicle
from quad_guard.checks import WrenchCommand

SLOTS = 512  # commands under way at most; an older one never arrives
THRUST, ROLL, PITCH, YAW, ARRIVAL, ANSWERED = range(6)
NEVER = 1e18
EARLY = 1e-9


class LinkMemory(NamedTuple):
    """The last step at which the link was not perfect, and the step at which what the plant has was sent.

    ``wrench`` is what the plant has; it answers the state of step ``answered``, -1 before the first one.
    """

    last: int
    applied: int
    answered: int
    wrench: Wrench


def link_init() -> tuple[NDArray[np.float64], LinkMemory]:
    """Return the line of commands under way and the memory of a link that was perfect so far.

    A row of the line is a plant step: thrust N, torque N m, arrival in steps, step of the state that it answers.
    """
    return np.zeros((SLOTS, 6)), LinkMemory(-2, -1, -1, Wrench(0.0, Vec3(0.0, 0.0, 0.0)))


def link_step(
    line: NDArray[np.float64], memory: LinkMemory, fault: LinkFault, sent: Wrench, answers: int, k: int, dt: float
) -> LinkMemory:
    """Return what the plant has over step ``k`` of ``dt`` s. Writes to ``line``.

    ``sent`` is the command at step ``k``; it answers the state of step ``answers``.
    """
    if fault.delay <= 0.0 and not fault.lost:
        return LinkMemory(memory.last, memory.applied, answers, sent)
    newest = memory.applied if memory.last == k - 1 else k - 1
    slot = k % SLOTS
    line[slot, THRUST] = sent.thrust
    line[slot, ROLL], line[slot, PITCH], line[slot, YAW] = sent.torque_b.x, sent.torque_b.y, sent.torque_b.z
    line[slot, ARRIVAL] = NEVER if fault.lost else k + fault.delay / dt
    line[slot, ANSWERED] = answers
    oldest = newest if newest > k - SLOTS else k - SLOTS
    for j in range(k, oldest, -1):
        if float(line[j % SLOTS, ARRIVAL]) <= k + EARLY:
            row = j % SLOTS
            torque = Vec3(float(line[row, ROLL]), float(line[row, PITCH]), float(line[row, YAW]))
            return LinkMemory(k, j, int(line[row, ANSWERED]), Wrench(float(line[row, THRUST]), torque))
    return LinkMemory(k, newest, memory.answered, memory.wrench)


class SimulatedVehicle(NamedTuple):
    """What does not change over a flight: vehicle, plant period in ns, parameters of the plug-ins."""

    vehicle: Vehicle
    period: int
    plant: Any
    disturbance: Any
    sensing: Any


class RandomStreams(NamedTuple):
    """The 2-D arrays of one flight: what disturbance and sensing drew, and the delay lines of sensors and command link.

    They stand apart from what a step hands to the next, because Numba counts references to an array at every hand-over.
    """

    weather: Any
    noise: Any
    sensing_line: Any
    link_line: Any


class Memory(NamedTuple):
    """What one step hands to the next: state of the plant, memories of sensors and link.

    ``lift``: whether the vehicle has left the ground. ``actuation``: what the rotors made of the last wrench.
    """

    plant: Any
    sensing: Any
    link: LinkMemory
    lift: LiftOff
    actuation: Actuation


def receive(
    side: SimulatedVehicle,
    drawn: RandomStreams,
    memory: Memory,
    conditions: Conditions,
    sent: Wrench,
    command_step: int,
    k: int,
) -> tuple[WrenchCommand, Memory]:
    """Return what has come through the command link at step ``k``, and the memory. Writes to the link's delay line.

    ``sent`` is the newest command; it answers the state of ``command_step``.
    """
    before = memory.link.answered
    linked = link_step(drawn.link_line, memory.link, conditions.link, sent, command_step, k, seconds(1, side.period))
    command = WrenchCommand(linked.wrench, linked.answered, linked.answered > before)
    return command, Memory(memory.plant, memory.sensing, linked, memory.lift, memory.actuation)


def sensing_is_active(memory: Memory, conditions: Conditions) -> bool:
    """Return whether armed controllers see anything but the truth: errors or a fault of the sensors, or a ground."""
    sensing, lift = memory.sensing, memory.lift
    return sensing.active or sensing.frozen or is_faulty(conditions.sensor) or lift.on_ground or lift.ground_z != 0.0


class VehicleFunctions(NamedTuple):
    """The functions of a plant step that depend on plug-ins; what each returns stands in ``vehicle_functions``."""

    begin: Callable[..., Any]
    observe: Callable[..., Any]
    sense: Callable[..., Any]
    move: Callable[..., Any]


def vehicle_functions(plant: Any, sensing: Any) -> VehicleFunctions:
    """Return the functions of two plug-in modules."""
    plant_init, plant_step, plant_observe, sensing_step = plant.init, plant.step, plant.observe, sensing.step

    def begin(side: SimulatedVehicle, sensing: Any, linked: LinkMemory) -> Memory:
        """Return the memory before step 0; ``sensing``, ``linked``: memories of plug-in and link."""
        zero, none = Vec3(0.0, 0.0, 0.0), Rotors(0.0, 0.0, 0.0, 0.0)
        state = plant_init(side.plant, side.vehicle)
        actuation = Actuation(none, none, 0.0, zero, False, False, False, False, False)
        return Memory(state, sensing, linked, airborne(0.0), actuation)

    def observe(side: SimulatedVehicle, memory: Memory) -> VehicleState:
        """Return the true state; fields after the body rates are new, which a plant that is compiled may leave out."""
        motion = plant_observe(side.plant, side.vehicle, memory.plant)
        return fresh(motion.p_w, motion.v_w, motion.q_wb, motion.omega_b)

    def sense(
        side: SimulatedVehicle,
        drawn: RandomStreams,
        memory: Memory,
        truth: VehicleState,
        conditions: Conditions,
        armed: bool,
        k: int,
    ) -> tuple[VehicleState, Memory]:
        """Return the state that the controllers see of ``truth`` at step ``k``, and the memory.

        ``armed``: the motors may turn. Writes to the delay line of the sensors.
        """
        state, sensing = sensing_step(
            side.sensing, drawn.noise, drawn.sensing_line, memory.sensing, truth, conditions.sensor, k
        )
        lift = lifted_off(memory.lift, state, armed, seconds(1, side.period))
        state = with_ground(state, lift.ground_z, lift.on_ground)
        return state, Memory(memory.plant, sensing, memory.link, lift, memory.actuation)

    def move(side: SimulatedVehicle, memory: Memory, conditions: Conditions, wrench: Wrench) -> Memory:
        """Return the memory one plant period later, under ``wrench`` for the rotors."""
        dt = seconds(1, side.period)
        state, actuation = plant_step(side.plant, side.vehicle, memory.plant, wrench, conditions, dt)
        return Memory(state, memory.sensing, memory.link, memory.lift, actuation)

    return VehicleFunctions(begin, observe, sense, move)
