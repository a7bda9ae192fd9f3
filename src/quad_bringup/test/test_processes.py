"""Node processes: started, watched, and stopped whatever they do about it."""

import os
import signal
import sys
import time

import pytest

from quad_bringup import processes
from quad_bringup.processes import Processes, describe_exit

DEAF = """
import signal, time
for number in (signal.SIGINT, signal.SIGTERM, *{ignored}):
    signal.signal(number, signal.SIG_IGN)
print("deaf", flush=True)
time.sleep(60)
"""
HUNG = DEAF.format(ignored=[]).replace("import signal", "import faulthandler; faulthandler.enable(); import signal")
POLITE = """
import signal, sys, time
signal.signal(signal.SIGINT, lambda *_: (print("asked", flush=True), sys.exit(1)))
print("ready", flush=True)
time.sleep(60)
"""
LANDING = """
import os, signal, time
asked = []
signal.signal(signal.SIGINT, lambda *_: asked.append(0) if not asked else os._exit(9))
print("ready", flush=True)
while not asked:
    time.sleep(0.01)
time.sleep(2.0)
"""


@pytest.fixture
def started(tmp_path, monkeypatch):
    monkeypatch.setattr(processes, "_SIMULATOR_FIRST", 0.5)
    monkeypatch.setattr(processes, "_STOPS", tuple((number, 0.5) for number, _ in processes._STOPS))
    found = Processes(tmp_path, {"PATH": ""})
    yield found
    found.stop()


def start(started, role, text):
    """Start ``text`` as Python and wait for its first line."""
    started.start(role, [sys.executable, "-S", "-c", text])
    wait_for_a_line(started, role)


def wait_for_a_line(started, role):
    deadline = time.monotonic() + 30.0
    while not started.last_lines(role) and time.monotonic() < deadline:
        time.sleep(0.01)


@pytest.mark.parametrize(
    ("code", "text"),
    [(0, "ended with exit code 0"), (2, "with exit code 2"), (-9, "was killed by SIGKILL"), (-99, "by signal 99")],
)
def test_exits_are_named(code, text):
    assert text in describe_exit(code)


def test_exit_codes_are_told_once(started):
    start(started, "trajectory", "print('x', flush=True); import sys; sys.exit(3)")
    deadline = time.monotonic() + 30.0
    ended = {}
    while not ended and time.monotonic() < deadline:
        ended = started.reap()
    assert ended == {"trajectory": 3}
    assert started.reap() == {}
    assert started.codes == {"trajectory": 3}
    assert not started.running()


def test_stop_asks_first_and_kills_at_last(started):
    start(started, "simulator", POLITE)
    start(started, "recorder", DEAF.format(ignored=[int(signal.SIGABRT)]))
    assert set(started.pids()) == {"simulator", "recorder"}
    started.stop()
    assert not started.running()
    assert started.codes == {"simulator": 1, "recorder": -9}
    assert started.last_lines("simulator") == ["ready", "asked"]


def test_a_process_that_is_made_to_stand_still_is_told_once(started):
    start(started, "simulator", POLITE)
    assert started.newly_stopped() == {}
    os.kill(started.pids()["simulator"], signal.SIGSTOP)
    found, deadline = {}, time.monotonic() + 30.0
    while not found and time.monotonic() < deadline:
        found = started.newly_stopped()
    assert found == {"simulator": signal.SIGSTOP}
    assert started.newly_stopped() == {}
    os.kill(started.pids()["simulator"], signal.SIGCONT)
    assert started.reap() == {}


def test_a_node_behind_a_script_is_asked_too(started):
    started.start("simulator", ["/bin/bash", "-c", f'{sys.executable} -S -c "$0"; exit $?', POLITE])
    wait_for_a_line(started, "simulator")
    started.stop()
    assert (started.codes, started.last_lines("simulator")) == ({"simulator": 1}, ["ready", "asked"])


def test_who_lands_a_vehicle_has_the_time_for_it(started):
    start(started, "simulator", LANDING)
    started.stop(landing=30.0)
    assert started.codes == {"simulator": 0}
    start(started, "simulator", LANDING)
    started.codes.clear()
    started.stop()
    assert started.codes == {"simulator": 9}


def test_what_has_the_vehicle_is_the_process_that_was_started_first_and_none_once_it_has_left(started):
    start(started, "one_process", "print('x', flush=True)")
    start(started, "commander", POLITE)
    deadline = time.monotonic() + 30.0
    while "one_process" not in started.codes and time.monotonic() < deadline:
        assert started.vehicle_interface().pid == started.pids()["one_process"]
        started.reap()
    assert started.vehicle_interface() is None
    assert list(started.pids()) == ["commander"]


def test_a_process_that_hangs_tells_where(started):
    start(started, "recorder", HUNG)
    started.stop()
    assert started.codes == {"recorder": -6}
    assert any("line" in line for line in started.last_lines("recorder", 10))
