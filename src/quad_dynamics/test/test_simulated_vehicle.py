"""The command link: which command the plant has when commands come late, out of order or never."""

import numpy as np
import pytest

from quad_core.types import LinkFault, Vec3, Wrench
from quad_dynamics.simulated_vehicle import link_init, link_step

DT = 0.002


def sent(k):
    return Wrench(float(k), Vec3(0.1 * k, -0.1 * k, 0.01 * k))


def flown(faults, step=link_step):
    (line, memory), seen = link_init(), []
    memory = memory._replace(wrench=Wrench(-1.0, Vec3(0.0, 0.0, 0.0)))
    for k, fault in enumerate(faults):
        memory = step(line, memory, fault, sent(k), k - k % 3, k, DT)
        assert memory.answered == memory.wrench.thrust // 3 * 3 or memory.wrench.thrust < 0.0
        seen.append(memory.wrench)
    return seen


def newest_arrived(faults):
    """The definition, searched from scratch at every step."""
    seen = []
    for k in range(len(faults)):
        arrived = [j for j in range(k + 1) if not faults[j].lost and j + faults[j].delay / DT <= k + 1e-9]
        seen.append(max(arrived, default=-1))
    return seen


def test_a_perfect_link_passes_the_command_itself():
    command = sent(3)
    memory = link_step(*link_init(), LinkFault(), command, 3, 3, DT)
    assert memory.wrench is command
    assert (memory.last, memory.answered) == (-2, 3)


@pytest.mark.parametrize("steps", [1, 5, 200])
def test_a_constant_delay_is_that_many_steps(steps):
    seen = flown([LinkFault(delay=steps * DT)] * 300)
    assert [w.thrust for w in seen] == [float(max(k - steps, -1)) for k in range(300)]


def test_what_is_lost_is_never_applied_and_the_last_command_stays():
    faults = [LinkFault(lost=k in (4, 5, 6, 9)) for k in range(12)]
    assert [w.thrust for w in flown(faults)] == [0, 1, 2, 3, 3, 3, 3, 7, 8, 8, 10, 11]


@pytest.mark.parametrize("seed", range(5))
def test_random_faults_give_the_newest_command_that_has_arrived(seed):
    rng = np.random.default_rng(seed)
    faults = []
    for _ in range(400):
        good = rng.random() < 0.3
        faults.append(LinkFault() if good else LinkFault(float(rng.integers(0, 30)) * DT, bool(rng.random() < 0.2)))
    expected = newest_arrived(faults)
    seen = flown(faults)
    assert [w.thrust for w in seen] == [float(k) for k in expected]
    assert all(w == sent(k) for w, k in zip(seen, expected, strict=True) if k >= 0)
