"""The plant under an autopilot over real TCP: a hover on its sensors, wind and a weak rotor, refusals, exit codes."""

import json
import os
import socket
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from ament_index_python.packages import get_package_prefix
from flying import LONGEST, executable, last_word
from mavlink_flights import HERE, free_port
from px4_flights import VEHICLE
from vehicle_packages import vehicle_packages

from quad_bringup.domains import reserved_domain
from quad_flight_log.bag.reader import open_flight

pytestmark = pytest.mark.flight

PLANT = Path(get_package_prefix("quad_mavlink"), "lib", "quad_mavlink", "hil_plant")
GROUND = ["-p", "rigid_body.ground.enabled:=true", "-p", "rigid_body.initial.p.z:=0.1"]
NORTH = ["-p", "rigid_body.initial.angles.psi:=1.5707963"]
WEATHER = """/**:
  ros__parameters:
    disturbance: timeline
    timeline.events: |
      wind velocity=3,2,0
      rotor start=6 number=2 effectiveness=0.8
"""


def flown(folder, options, *words, bag=None):
    """Return exit code and words of the plant, and what the autopilot reports, None if it never flew.

    ``bag``: where a recorder, that is given the same words, puts the flight.
    """
    folder.mkdir(parents=True, exist_ok=True)
    report, port = folder / "report.json", free_port()
    with reserved_domain(None) as domain:
        environment = {**os.environ, "ROS_DOMAIN_ID": str(domain)}
        environment["PYTHONPATH"] = f"{environment.get('PYTHONPATH', '')}:{vehicle_packages()}"
        command = [PLANT, "--ros-args", "--params-file", VEHICLE, *GROUND, "-p", f"listen:=127.0.0.1:{port}", *words]
        with (folder / "fake.log").open("w") as log:
            fake = subprocess.Popen(
                [sys.executable, HERE / "fake_hil_autopilot.py", str(port), report, json.dumps(options)],
                env=environment, stdout=log, stderr=log,
            )  # fmt: skip
        try:
            if bag is not None:
                given = ["--ros-args", "--params-file", VEHICLE, "-p", f"directory:={bag}", *words]
                recorder = subprocess.Popen([executable("recorder"), *given], env=environment)
            plant = subprocess.run(
                command, env=environment, capture_output=True, text=True, timeout=LONGEST, check=False
            )
            if options.get("silent_at"):
                fake.kill()
            fake.wait(30)
            assert bag is None or recorder.wait(30) == 0
        finally:
            fake.kill()
            if bag is not None:
                recorder.kill()
    return plant.returncode, plant.stderr, json.loads(report.read_text("utf-8")) if report.exists() else None


def test_an_autopilot_hovers_on_what_it_is_told_and_nothing_of_it_is_wrong(tmp_path):
    code, words, report = flown(tmp_path, {"heading": 0.0, "garbage": 1, "late_at": 100}, *NORTH)
    assert code == 0, words
    assert report["wrong"] == []
    assert report["answered"] > 2000
    assert np.abs(np.array(report["heights"][-10:]) - 2.0).max() < 0.4
    assert max(report["errors"]) < 1.5  # the GPS wanders
    assert "x real time, armed" in words


def test_it_hovers_in_wind_on_a_weak_rotor(tmp_path):
    weather = tmp_path / "weather.yaml"
    weather.write_text(WEATHER, "utf-8")
    code, words, report = flown(tmp_path / "flight", {}, "--params-file", weather)
    assert code == 0, words
    assert report["wrong"] == []
    assert "rotor: begins" in words
    assert np.abs(np.array(report["heights"][-5:]) - 2.0).max() < 1.0


def test_a_recorder_with_the_same_words_has_the_whole_flight(tmp_path):
    both = ["-p", "flight.roles:=simulator,recorder", "-p", "flight.plant_period:=4000000"]
    code, words, report = flown(tmp_path, {"hover": 1.0}, *both, bag=tmp_path / "bag")
    assert code == 0, words
    assert report["wrong"] == []
    bag = open_flight(tmp_path / "bag")
    # while the autopilot boots nobody waits for it: a busy one answers some readings too late to count
    steps = report["answered"] - last_word(bag, "hil_plant", "stale_answers") + 1  # and step 0
    for topic in ("state", "truth", "disturbance"):
        assert bag.array(topic)["step"].tolist() == list(range(steps)), topic


@pytest.mark.parametrize(
    ("options", "extra", "words"),
    [
        ({"nan_at": 20}, [], "controls[2]: found nan, expected 0 to 1"),
        ({"ahead_at": 20}, [], "HIL_ACTUATOR_CONTROLS.time_usec: found"),
        ({"lockstep": 0}, [], "expected an autopilot built to run in lockstep"),
        ({"leave_at": 400}, [], "the autopilot closed the connection while armed"),
        ({"silent_at": 20}, ["-p", "answer_timeout:=1.0"], "silent for 1 s"),
        ({"never": 1}, ["-p", "flight.start_timeout:=3.0"], "the autopilot's first HIL_ACTUATOR_CONTROLS"),
    ],
)
def test_what_ends_a_flight_is_said_in_one_line(tmp_path, options, extra, words):
    code, said, _ = flown(tmp_path, options, *extra)
    assert code == 1
    assert words in said


def test_an_autopilot_that_leaves_disarmed_ends_the_flight_well(tmp_path):
    code, said, _ = flown(tmp_path, {"leave_at": 100})
    assert code == 0, said
    assert "recorder" not in said  # there is none


def test_a_taken_port_and_nobody_who_connects_are_said(tmp_path):
    environment = {**os.environ, "PYTHONPATH": f"{os.environ.get('PYTHONPATH', '')}:{vehicle_packages()}"}

    def started(port, *more):
        words = ["--ros-args", "--params-file", VEHICLE, "-p", f"listen:=127.0.0.1:{port}", *more]
        return subprocess.run(
            [PLANT, *words], env=environment, capture_output=True, text=True, timeout=LONGEST, check=False
        )

    with socket.create_server(("127.0.0.1", 0)) as taken:
        found = started(taken.getsockname()[1])
    assert found.returncode == 2
    assert len(found.stderr.splitlines()) == 1
    assert "Address already in use" in found.stderr
    found = started(free_port(), "-p", "flight.start_timeout:=2.0")
    assert found.returncode == 1
    assert "not ready after 2 s: an autopilot on tcp 127.0.0.1:" in found.stderr
