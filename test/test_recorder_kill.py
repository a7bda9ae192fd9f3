"""A recorder that is killed or whose disk is full: what it had stays, and the flight reports it."""

import os
import random
import resource
import signal

import flying
import pytest
import recorder_kills

from quad_flight_log.bag.reader import open_flight


@pytest.mark.parametrize("number", range(3))
def test_what_is_older_than_300_ms_survives_kill_9(number, tmp_path):
    loss = recorder_kills.killed_writer(tmp_path / "bag", random.Random(number).uniform(0.3, 1.2))
    assert loss.wall < recorder_kills.LIMIT
    assert loss.flown.truncated
    assert loss.flown.metadata["seed"] == "7"
    assert not list((tmp_path / "bag").glob("*.mcap"))


@pytest.mark.flight
def test_a_flight_goes_on_when_the_disk_is_full(tmp_path):
    directory = tmp_path / "bag"
    process = flying.start("hover", "--duration", "2", "--out", directory)
    part = directory / "bag_0.mcap.part"
    flying.wait_until(lambda: part.exists() and part.stat().st_size > 60_000, 90.0, "the recording began")
    limit = part.stat().st_size + 100_000
    resource.prlimit(recorder_kills.pid_of(process.pid, "recorder"), resource.RLIMIT_FSIZE, (limit, limit))
    done = flying.finish(process)
    assert done.returncode == 1
    flight = open_flight(directory)
    assert flight.truncated
    recorded = flight.topics["/truth"].messages
    assert recorded > 0
    simulator, recorder = ((directory / "logs" / f"{role}.log").read_text() for role in ("simulator", "recorder"))
    assert recorder.count("recording_stopped: ") == 1
    assert "File too large" in recorder
    assert "flight_failed" not in simulator
    assert "recorder ended with exit code 1" in done.stderr or "the bag is cut" in done.stderr


@pytest.mark.flight
@pytest.mark.parametrize(
    "clock",
    [pytest.param((), id="lockstep"), pytest.param(("--realtime",), id="realtime", marks=pytest.mark.long)],
)
def test_a_flight_of_a_commander_goes_on_without_its_recorder_and_the_verdict_says_where_the_bag_ends(tmp_path, clock):
    out = tmp_path / "bag"
    process = flying.start("--mission", "takeoff:1,hold:10,land", *clock, "--out", out)
    pids = flying.wait_until_flying(process, out)
    flying.wait_until(lambda: flying.bag_file(out).stat().st_size > 1_000_000, 90.0, "the vehicle is in the air")
    os.kill(pids["recorder"], signal.SIGKILL)
    done = flying.finish(process)
    assert done.returncode == 1, done.stdout + done.stderr
    assert "recorder was killed by SIGKILL: the flight goes on, and what is flown from now on is" in done.stderr
    assert "the bag ends at " in done.stderr
    assert "the flight itself went on to " in done.stderr
    assert "s: ended" in done.stderr
    assert "motors stopped" not in done.stderr
    assert "hung" not in done.stderr
    log = (out / "logs" / "commander.log").read_text()
    assert "HOLD to LAND: asked for by mission" in log
    assert "HOLD to LAND: asked for by mission" in done.stderr, "the terminal shows changes of mode"
    assert "LAND to DISARMED" in log
