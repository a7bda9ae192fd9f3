"""The command link: which wrench the plant has at a step when commands come late or never (``LinkFault``).

A command that overtakes an older one makes it void: what the plant applies is the newest command that has arrived.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_core.types import LinkFault, Vec3, Wrench

SLOTS = 512  # commands under way at most; an older one never arrives
THRUST, ROLL, PITCH, YAW, ARRIVAL, ANSWERED = range(6)
NEVER = 1e18
EARLY = 1e-9


class Memory(NamedTuple):
    """The last step at which the link was not perfect, and the step at which what the plant has was sent.

    ``wrench`` is what the plant has; it answers the state of step ``answered``, -1 before the first one.
    """

    last: int
    applied: int
    answered: int
    wrench: Wrench


def init() -> tuple[NDArray[np.float64], Memory]:
    """Return the line of commands under way and the memory of a link that was perfect so far.

    A row of the line is a plant step: thrust N, torque N m, arrival in steps, step of the state that it answers.
    """
    return np.zeros((SLOTS, 6)), Memory(-2, -1, -1, Wrench(0.0, Vec3(0.0, 0.0, 0.0)))


def step(
    line: NDArray[np.float64], memory: Memory, fault: LinkFault, sent: Wrench, answers: int, k: int, dt: float
) -> Memory:
    """Return what the plant has over step ``k`` of ``dt`` s. Writes to ``line``.

    ``sent`` is the command at step ``k``; it answers the state of step ``answers``.
    """
    if fault.delay <= 0.0 and not fault.lost:
        return Memory(memory.last, memory.applied, answers, sent)
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
            return Memory(k, j, int(line[row, ANSWERED]), Wrench(float(line[row, THRUST]), torque))
    return Memory(k, newest, memory.answered, memory.wrench)
