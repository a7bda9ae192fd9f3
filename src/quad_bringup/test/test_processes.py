"""Node processes: started, watched, and stopped whatever they do about it."""

import errno
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from quad_bringup import processes
from quad_bringup.processes import Processes, describe_exit, log_folder

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
    deadline = time.monotonic() + 30.0
    while not started.last_lines(role) and time.monotonic() < deadline:
        time.sleep(0.01)


@pytest.mark.parametrize(
    ("code", "text"),
    [
        (0, "ended with exit code 0"),
        (2, "ended with exit code 2"),
        (-9, "was killed by SIGKILL"),
        (-99, "by signal 99"),
    ],
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


def test_who_lands_a_vehicle_has_the_time_for_it(started):
    start(started, "simulator", LANDING)
    started.stop(landing=30.0)
    assert started.codes == {"simulator": 0}
    start(started, "simulator", LANDING)
    started.codes.clear()
    started.stop()
    assert started.codes == {"simulator": 9}


def test_a_process_that_hangs_tells_where(started):
    start(started, "recorder", HUNG)
    started.stop()
    assert started.codes == {"recorder": -6}
    assert any("line" in line for line in started.last_lines("recorder", 10))


def test_logs_move_with_all_that_lies_beside_them(tmp_path):
    logs = tmp_path / "logs"
    logs.mkdir()
    (logs / "parameters.yaml").write_text("a: 1\n", encoding="utf-8")
    found = Processes(logs, {})
    (logs / "recorder.log").write_text("one\n\ntwo\nthree\nfour\n", encoding="utf-8")
    assert found.move_logs(tmp_path / "bag") == ""
    assert not logs.exists()
    assert found.log("recorder") == tmp_path / "bag" / "recorder.log"
    assert found.last_lines("recorder") == ["two", "three", "four"]
    assert found.last_lines("simulator") == []
    assert (tmp_path / "bag" / "parameters.yaml").exists()


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (shutil.Error([("a", "b", "[Errno 28] No space left on device: 'b'")]), "No space left on device"),
        (OSError(errno.ENOSPC, "No space left on device"), "No space left on device"),
    ],
)
def test_logs_that_a_full_disk_does_not_take_are_a_plain_text(error, message, tmp_path, monkeypatch):
    def fail(*_args):
        raise error

    logs = tmp_path / "logs"
    logs.mkdir()
    processes = Processes(logs, {})
    processes.log("simulator").write_text("last words\n")
    monkeypatch.setattr(shutil, "move", fail)
    lost = processes.move_logs(tmp_path / "bag")
    assert message in lost
    assert "[(" not in lost
    assert processes.last_lines("simulator") == ["last words"]


def test_a_folder_of_logs_is_swept_once_no_process_of_its_flight_runs(tmp_path, monkeypatch):
    """As after ``kill -9`` of ``fly``: its nodes still land, and print into the folder."""
    monkeypatch.setattr(processes.tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(processes, "_YOUNG", -1.0)
    text = "import sys, time; print('ready', flush=True); time.sleep(60)"
    made = f"""
import os, sys, time
from quad_bringup.processes import Processes, log_folder
with log_folder() as (folder, used):
    nodes = Processes(folder, dict(os.environ), [used])
    nodes.start("simulator", [sys.executable, "-S", "-c", {text!r}])
    print(folder, nodes.pids()["simulator"], flush=True)
    time.sleep(60)
"""
    fly = subprocess.Popen(
        [sys.executable, "-c", made], env={**os.environ, "TMPDIR": str(tmp_path)}, stdout=subprocess.PIPE, text=True
    )
    folder, node = fly.stdout.readline().split()
    fly.kill()
    fly.wait()
    with log_folder() as (other, _):
        assert Path(folder).is_dir(), "a node of it still runs"
        assert other != Path(folder)
    os.kill(int(node), signal.SIGKILL)
    deadline = time.monotonic() + 10.0
    while Path(folder).is_dir() and time.monotonic() < deadline:
        with log_folder():
            time.sleep(0.02)
    assert list(tmp_path.iterdir()) == []
