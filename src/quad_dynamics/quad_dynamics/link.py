"""The command link: which wrench the plant has at a step when commands come late or never (``LinkFault``).

A command that overtakes an older one makes it void: what the plant applies is the newest command that has arrived.
"""

from typing import Any, NamedTuple

import numpy as np

from quad_core.types import LinkFault, Vec3, Wrench

SLOTS = 512
"""Commands under way at most; an older one never arrives."""
THRUST, ROLL, PITCH, YAW, ARRIVAL = range(5)
NEVER = 1e18
EARLY = 1e-9


class Memory(NamedTuple):
    """Commands under way: a row per plant step (thrust N, torque N m, arrival in steps), written in place.

    ``last`` is the last step at which the link was not perfect, ``applied`` the step whose command the plant has.
    """

    line: Any
    last: int
    applied: int


def init() -> Memory:
    """Return the memory of a link that was perfect so far."""
    return Memory(np.zeros((SLOTS, 5)), -2, -1)


def step(memory: Memory, fault: LinkFault, sent: Wrench, applied: Wrench, k: int, dt: float) -> tuple[Wrench, Memory]:
    """Return the wrench that the plant has over step ``k`` of ``dt`` s, and the memory, which is used up.

    ``sent`` is the command of step ``k``, ``applied`` what the plant had over the step before.
    """
    if fault.delay <= 0.0 and not fault.lost:
        return sent, memory
    newest = memory.applied if memory.last == k - 1 else k - 1
    line, slot = memory.line, k % SLOTS
    line[slot, THRUST] = sent.thrust
    line[slot, ROLL], line[slot, PITCH], line[slot, YAW] = sent.torque_b.x, sent.torque_b.y, sent.torque_b.z
    line[slot, ARRIVAL] = NEVER if fault.lost else k + fault.delay / dt
    oldest = newest if newest > k - SLOTS else k - SLOTS
    for j in range(k, oldest, -1):
        if float(line[j % SLOTS, ARRIVAL]) <= k + EARLY:
            row = j % SLOTS
            torque = Vec3(float(line[row, ROLL]), float(line[row, PITCH]), float(line[row, YAW]))
            return Wrench(float(line[row, THRUST]), torque), Memory(line, k, j)
    return applied, Memory(line, k, newest)
