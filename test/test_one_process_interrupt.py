"""All nodes in one process, interrupted at any moment: a closed bag that names the signal, and the exit code."""

import random
import signal
import time

import pytest
from flying import PATIENT, finish, start, wait_until

from quad_flight_log.bag.reader import open_flight

pytestmark = pytest.mark.flight

REALTIME = ("--realtime", *PATIENT)


@pytest.mark.parametrize(("number", "mode"), [(1, ()), (2, REALTIME), (3, ()), (4, REALTIME)])
def test_a_signal_at_any_moment_closes_the_bag_with_its_name(tmp_path, number, mode):
    out = tmp_path / "bag"
    flying = start("hover", "--duration", "60", "--one-process", *mode, "--out", out)
    wait_until(lambda: any(path.stat().st_size > 20_000 for path in out.glob("*.mcap*")), 60.0, "the bag grows")
    time.sleep(random.Random(number).uniform(0.0, 1.5))
    flying.send_signal(signal.SIGINT)
    done = finish(flying)
    assert done.returncode == 1, done.stdout + done.stderr
    assert "Traceback" not in done.stderr
    bag = open_flight(out)
    assert not bag.truncated
    assert bag.metadata["outcome"] == "failed"
    assert "SIGINT" in bag.metadata["reason"]
