"""Real time asks the system for SCHED_FIFO, takes a refusal, and leaves lockstep alone."""

import gc
import os
import subprocess
import sys

import pytest

from quad_node import scheduling

ALL_THREADS = """
import os, threading
from pathlib import Path
from quad_node.scheduling import settle
waiting = threading.Event()
threading.Thread(target=waiting.wait, daemon=True).start()
refused = settle({priority}, {aside})
found = {{os.sched_getscheduler(int(task.name)) for task in Path("/proc/self/task").iterdir()}}
print(refused or sorted(found))
waiting.set()
"""


@pytest.fixture
def thawed():
    yield
    gc.unfreeze()


@pytest.mark.parametrize(
    ("priority", "aside", "policy"),
    [(0, False, os.SCHED_OTHER), (7, False, os.SCHED_FIFO), (0, True, os.SCHED_BATCH), (7, True, os.SCHED_FIFO)],
)
def test_all_threads_are_scheduled_alike(priority, aside, policy):
    text = ALL_THREADS.format(priority=priority, aside=aside)
    printed = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True).stdout.strip()
    assert printed == str([int(policy)]) or (policy == os.SCHED_FIFO and "not permitted" in printed)


def test_a_refusal_is_told(monkeypatch, thawed):
    def refuse(*_):
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(scheduling.os, "sched_setscheduler", refuse)
    assert scheduling.settle(40) == "SCHED_FIFO 40: not permitted, see ulimit -r"
    assert scheduling.settle(0) == ""


def test_who_is_waited_for_by_nobody_stands_back_where_a_priority_is_refused(monkeypatch, thawed):
    asked = []

    def refuse_fifo(_pid, policy, _parameters):
        asked.append(policy)
        if policy == os.SCHED_FIFO:
            raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(scheduling.os, "sched_setscheduler", refuse_fifo)
    assert scheduling.settle(1, aside=True) == ""
    assert asked[0] == os.SCHED_FIFO
    assert set(asked[1:]) == {os.SCHED_BATCH}


def test_what_was_made_before_the_flight_is_not_collected_again(thawed):
    before = gc.get_freeze_count()
    assert scheduling.settle(0) == ""
    assert gc.get_freeze_count() > before
