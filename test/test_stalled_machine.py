"""A test of the wall clock is run again only where a witness saw the machine stand still."""

import os
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import pytest
import stalled_machine

pytestmark = pytest.mark.unit

LINES = ["10.500000 0.031000\n12.000000 0.140000\n", "", "11.000000 0.050000\n"]


@pytest.mark.parametrize(("since", "longest"), [(0.0, 0.14), (10.6, 0.14), (12.0, 0.0)])
def test_the_longest_stall_of_all_processors_since_the_beginning_counts(since, longest):
    assert stalled_machine.longest_stall(LINES, since) == longest
    assert stalled_machine.longest_stall(LINES[2:], 10.9) == 0.05


def test_a_witness_that_was_stopped_says_for_how_long_and_leaves_with_its_parent(tmp_path):
    file = tmp_path / "0"
    processor = str(min(os.sched_getaffinity(0)))
    script = textwrap.dedent(f"""
        import os, subprocess, sys, time
        words = [sys.executable, {stalled_machine.__file__!r}, {str(file)!r}, {processor!r}, str(os.getpid())]
        print(subprocess.Popen(words).pid, flush=True)
        time.sleep(60)
    """)
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True) as parent:
        witness = int(parent.stdout.readline())
        deadline = time.monotonic() + 20.0
        while not file.exists():
            assert time.monotonic() < deadline
            time.sleep(0.01)
        began = time.monotonic()
        os.kill(witness, signal.SIGSTOP)
        time.sleep(0.3)
        os.kill(witness, signal.SIGCONT)
        while stalled_machine.longest_stall([file.read_text()], began) < 0.3:
            assert time.monotonic() < deadline
            time.sleep(0.01)
        parent.kill()
    while Path(f"/proc/{witness}").exists():
        assert time.monotonic() < deadline
        time.sleep(0.01)


CONFTEST = """
import os, pytest
from stalled_machine import StalledMachine

class Meter:
    begin = lambda self: None
    longest = lambda self: float(os.environ["STALL"])

def pytest_configure(config):
    config.addinivalue_line("markers", "wall_clock: x")
    config.pluginmanager.register(StalledMachine(Meter()))
"""
TESTS = """
import pytest
runs = []

@pytest.mark.wall_clock
def test_late():
    runs.append(1)
    assert len(runs) == 2

@pytest.mark.wall_clock
def test_never():
    assert False

@pytest.mark.wall_clock
def test_punctual():
    pass

def test_wrong():
    runs.clear()
    assert runs
"""


@pytest.mark.parametrize(
    ("stall", "ends"), [("0.0", ("1 passed", "3 failed")), ("0.14", ("2 passed", "1 failed", "1 skipped", "4 rerun"))]
)
def test_only_the_wall_clock_and_only_a_stall_excuse_a_failure(tmp_path, stall, ends):
    (tmp_path / "conftest.py").write_text(CONFTEST)
    (tmp_path / "test_of_time.py").write_text(TESTS)
    library = str(Path(stalled_machine.__file__).parent)
    found = {**os.environ, "STALL": stall, "PYTHONPATH": library, "PYTEST_ADDOPTS": ""}
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-q", "-rs", str(tmp_path)]
    done = subprocess.run(command, cwd=tmp_path, env=found, capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 1
    for end in ends:
        assert end in done.stdout, done.stdout
    again = [
        name for name in ("test_late", "test_never", "test_punctual", "test_wrong") if f"{name}: the" in done.stdout
    ]
    assert again == (["test_late", "test_never"] if stall != "0.0" else [])
    not_judged = "not judged: the machine stood still in each of 4 tries, at last for 140 ms"
    assert (not_judged in done.stdout) == (stall != "0.0")
