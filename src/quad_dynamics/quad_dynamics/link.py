"""The command link: which wrench the plant has at a step when commands come late or never (``LinkFault``).

A command that overtakes an older one makes it void: what the plant applies is the newest command that has arrived.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_core.types import LinkFault, Vec3, Wrench

SLOTS = 512
"""Commands under way at most; an older one never arrives."""
THRUST, ROLL, PITCH, YAW, ARRIVAL = range(5)
NEVER = 1e18
EARLY = 1e-9


class Memory(NamedTuple):
    """The last step at which the link was not perfect, and the step whose command the plant has."""

    last: int
    applied: int


def init() -> tuple[NDArray[np.float64], Memory]:
    """Return the line of commands under way and the memory of a link that was perfect so far.

    A row of the line is a plant step: thrust N, torque N m, arrival in steps.
    """
    return np.zeros((SLOTS, 5)), Memory(-2, -1)


def step(
    line: NDArray[np.float64], memory: Memory, fault: LinkFault, sent: Wrench, applied: Wrench, k: int, dt: float
) -> tuple[Wrench, Memory]:
    """Return the wrench that the plant has over step ``k`` of ``dt`` s, and the memory. Writes to ``line``.

    ``sent`` is the command of step ``k``, ``applied`` what the plant had over the step before.
    """
    if fault.delay <= 0.0 and not fault.lost:
        return sent, memory
    newest = memory.applied if memory.last == k - 1 else k - 1
    slot = k % SLOTS
    line[slot, THRUST] = sent.thrust
    line[slot, ROLL], line[slot, PITCH], line[slot, YAW] = sent.torque_b.x, sent.torque_b.y, sent.torque_b.z
    line[slot, ARRIVAL] = NEVER if fault.lost else k + fault.delay / dt
    oldest = newest if newest > k - SLOTS else k - SLOTS
    for j in range(k, oldest, -1):
        if float(line[j % SLOTS, ARRIVAL]) <= k + EARLY:
            row = j % SLOTS
            torque = Vec3(float(line[row, ROLL]), float(line[row, PITCH]), float(line[row, YAW]))
            return Wrench(float(line[row, THRUST]), torque), Memory(k, j)
    return applied, Memory(k, newest)
