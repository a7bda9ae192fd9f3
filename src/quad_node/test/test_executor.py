"""The process of a node ends when it is asked to, hides no exception, and asks the system for its scheduling."""

import gc
import os
import signal
import subprocess
import sys
import time
from functools import partial
from types import SimpleNamespace

import pytest
import rclpy
from rclpy.task import Future

from quad_node import executor, main
from quad_node.flight_node import FlightNode


@pytest.fixture
def signals(own_domain):
    """Give the handlers of signals back afterwards; a node has a domain meanwhile."""
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    signal.signal(signal.SIGHUP, signal.SIG_DFL)  # whatever started the tests
    yield
    for number, handler in handlers.items():
        signal.signal(number, handler)


@pytest.fixture
def thawed():
    yield
    gc.unfreeze()


def test_a_hang_up_that_is_ignored_from_the_start_ends_nothing(signals):
    """nohup has it ignored."""
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    done, stop = Future(), []
    executor.on_signals(stop, done)
    os.kill(os.getpid(), signal.SIGHUP)
    assert not done.done()
    os.kill(os.getpid(), signal.SIGTERM)
    assert stop == ["SIGTERM"]


def test_the_first_signal_may_be_asked_to_wait_but_not_one_that_comes_later(signals, monkeypatch):
    """Of one Ctrl-C come two signals, of a terminal that goes three: none of them asks for motors off."""
    now = [100.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    done, stop = Future(), []
    executor.on_signals(stop, done, lambda _: True)
    for number, wait in ((signal.SIGINT, 0.4), (signal.SIGTERM, 0.4), (signal.SIGHUP, 0.4)):
        os.kill(os.getpid(), number)
        now[0] += wait
    assert (stop, done.done()) == (["SIGINT"], False)
    os.kill(os.getpid(), signal.SIGTERM)
    assert (stop, done.done()) == (["SIGINT", "SIGTERM"], True)


SAID = []


def opened():
    """Return a node that opens a file while it is made, and is interrupted then."""
    node = FlightNode("position_controller", shut_down=lambda: SAID.append("closed"))
    node.interrupt, node.drain = SAID.append, lambda patience: SAID.append("drained")
    os.kill(os.getpid(), signal.SIGINT)
    return SimpleNamespace(node=node)


def slow():
    """Return such a node: the first ends at once, but its last messages arrive after the others' deadline."""
    made = opened()
    made.node.interrupt = lambda name: (SAID.append(name), made.node.finish(0, ""))
    made.node.drain = lambda patience: (time.sleep(0.3), SAID.append("drained"))
    return made


@pytest.mark.parametrize(("kind", "count"), [(opened, 1), (opened, 2), (slow, 2)])
def test_a_signal_while_the_nodes_are_made_still_closes_what_they_opened(monkeypatch, signals, thawed, kind, count):
    monkeypatch.setattr(main, "_AMONG_THEMSELVES", 0.2)
    SAID.clear()
    assert main.run_all("position_controller", [kind] * count, ["position_controller"]) == 1
    assert ["SIGINT", *["drained", "closed"] * count] == SAID


def ticking(act):
    """Run a node that does ``act`` 20 times a second; it notes the signal that ends it."""

    def make():
        node = FlightNode("position_controller", watch=act)
        node.interrupt = lambda name: SAID.append((name, rclpy.ok()))
        return SimpleNamespace(node=node)

    return main.run_all("position_controller", [make], ["position_controller"])


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_a_signal_ends_a_node_that_still_can_publish_why(signals, thawed, name):
    SAID.clear()
    assert ticking(lambda: os.kill(os.getpid(), getattr(signal, name))) == 1
    assert [(name, True)] == SAID


def test_an_exception_in_a_callback_ends_a_node_and_propagates(signals, thawed):
    def broken():
        raise RuntimeError("broken callback")

    with pytest.raises(RuntimeError, match="broken callback"):
        ticking(broken)


def test_nodes_in_one_process_name_the_file_of_a_bad_value(signals, thawed, tmp_path, capsys):
    file = tmp_path / "flight.yaml"
    file.write_text("/**/position_controller:\n  ros__parameters:\n    vehicle.mass: -1.0\n")
    words = ["one_process", "--ros-args", "--params-file", str(file)]
    make = partial(FlightNode, "position_controller")
    assert main.run_all("one_process", [make, make], words) == 2
    assert f"{file}: vehicle.mass" in capsys.readouterr().err


ALL_THREADS = """
import os, threading
from pathlib import Path
from types import SimpleNamespace
from quad_node.executor import settle
waiting = threading.Event()
threading.Thread(target=waiting.wait, daemon=True).start()
refused = settle({priority}, {aside})
found = {{os.sched_getscheduler(int(task.name)) for task in Path("/proc/self/task").iterdir()}}
print(refused or sorted(found))
waiting.set()
"""


@pytest.mark.parametrize(
    ("priority", "aside", "policy"),
    [(0, False, os.SCHED_OTHER), (7, False, os.SCHED_FIFO), (0, True, os.SCHED_BATCH), (7, True, os.SCHED_FIFO)],
)
def test_all_threads_are_scheduled_alike(priority, aside, policy):
    text = ALL_THREADS.format(priority=priority, aside=aside)
    printed = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True).stdout.strip()
    assert printed == str([int(policy)]) or (policy == os.SCHED_FIFO and "not permitted" in printed)


def test_a_refusal_is_reported_and_a_background_node_stands_back(monkeypatch, thawed):
    asked = []

    def refuse_fifo(_pid, policy, _parameters):
        asked.append(policy)
        if policy == os.SCHED_FIFO:
            raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(executor.os, "sched_setscheduler", refuse_fifo)
    assert executor.settle(40) == "SCHED_FIFO 40: not permitted, see ulimit -r"
    assert executor.settle(0) == ""
    assert asked == [os.SCHED_FIFO]
    assert executor.settle(1, aside=True) == ""
    assert set(asked[2:]) == {os.SCHED_BATCH}


HANG = """
import ctypes
from quad_node.executor import limited
with limited({code}, 1):
    ctypes.PyDLL(None).sleep({seconds})
print("left", flush=True)
import time
time.sleep(1.5)
raise SystemExit(7)
"""


@pytest.mark.parametrize(("code", "seconds", "ended"), [(0, 30, (0, "")), (1, 30, (1, "")), (0, 0, (7, "left\n"))])
def test_a_process_that_hangs_in_its_shutdown_ends_with_its_exit_code_and_another_one_goes_on(code, seconds, ended):
    words = [sys.executable, "-c", HANG.format(code=code, seconds=seconds)]
    done = subprocess.run(words, timeout=15, check=False, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == ended
