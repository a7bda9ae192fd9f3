"""The five nodes find each other in whatever order they start."""

import random
import subprocess
import time

import pytest
from flying import CONFIG, ROLES, executable, hash_of, in_domain

from quad_bringup.domains import reserved_domain

pytestmark = pytest.mark.flight

ORDERS = [list(reversed(ROLES)), random.Random(4).sample(list(ROLES), len(ROLES))]


def flown_in(order, directory):
    """Fly a short hover with the nodes started in ``order``; returns its payload hash."""
    scenario = ["--params-file", f"{CONFIG}/scenarios/hover.yaml"]
    arguments = ["--ros-args", *scenario, "-p", "trajectory:hover.duration:=0.2", "-p", "flight.seed:=6"]
    with reserved_domain(None) as domain:
        nodes = {}
        for role in order:
            own = ["-p", f"directory:={directory}"] if role == "recorder" else []
            nodes[role] = subprocess.Popen([executable(role), *arguments, *own], env=in_domain(domain))
            time.sleep(0.7)
        try:
            codes = {role: node.wait(timeout=100) for role, node in nodes.items()}
        finally:
            for node in nodes.values():
                node.kill()
    assert codes == dict.fromkeys(order, 0)
    return hash_of(directory)


def test_the_order_of_start_changes_nothing(tmp_path):
    assert ORDERS[0] != ORDERS[1]
    hashes = {flown_in(order, tmp_path / str(number)) for number, order in enumerate(ORDERS)}
    assert len(hashes) == 1
