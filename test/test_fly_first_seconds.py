"""`scripts/fly` interrupted before, while and after it flies: one line, exit code 1, nothing left behind."""

import os
import signal
import subprocess
import time
from pathlib import Path

import pytest
from flying import ROOT, finish

pytestmark = pytest.mark.flight


def begin(tmp_path, *arguments):
    """Start the very script, with a folder of its own for what is temporary."""
    (tmp_path / "tmp").mkdir()
    command = [ROOT / "scripts/fly", "hover", *arguments, "--out", str(tmp_path / "bag")]
    environment = {**os.environ, "TMPDIR": str(tmp_path / "tmp")}
    pipe = subprocess.PIPE
    return subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True, env=environment, start_new_session=True)


def left_behind(tmp_path):
    """Return what lies in the folder for temporary files, our folder of locks aside."""
    return [path.name for path in (tmp_path / "tmp").iterdir() if path.name != f"quad-{os.geteuid()}"]


@pytest.mark.parametrize("delay", [0.4, pytest.param(1.0, marks=pytest.mark.long), 3.0])
def test_ctrl_c_in_the_first_seconds(tmp_path, delay):
    flight = begin(tmp_path, "--duration", "60")
    time.sleep(delay)
    os.killpg(flight.pid, signal.SIGINT)
    done = finish(flight)
    assert done.returncode == 1, (done.returncode, done.stderr)
    assert "Traceback" not in done.stderr
    assert "not available" not in done.stderr
    said = [line for line in done.stderr.splitlines() if "interrupted" in line]
    assert len(said) == 1, done.stderr
    assert left_behind(tmp_path) == []
    bag = tmp_path / "bag"
    assert not bag.exists() or list(bag.glob("*.mcap")), list(bag.iterdir())


def test_ctrl_c_while_the_script_becomes_the_program(tmp_path):
    """The shell gives up what it does about a signal before the program has its own."""
    flight = begin(tmp_path, "--duration", "60")
    words = Path(f"/proc/{flight.pid}/cmdline")
    while b"/lib/quad_bringup/fly" not in words.read_bytes():
        assert flight.poll() is None
    flight.send_signal(signal.SIGINT)
    done = finish(flight)
    assert (done.returncode, done.stderr) == (1, "fly: interrupted by SIGINT before the flight\n")


def test_signals_that_come_again_change_nothing(tmp_path):
    flight = begin(tmp_path, "--duration", "60")
    time.sleep(4.0)
    while flight.poll() is None:
        flight.send_signal(signal.SIGINT)
        time.sleep(0.02)
    assert flight.returncode == 1, flight.communicate()
    assert left_behind(tmp_path) == []
