"""Every example flies without ROS."""

import configparser
import re
import runpy
from pathlib import Path

import pytest

from quad_core import plugins
from quad_flight import flight

pytestmark = pytest.mark.unit

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
SHORT = {"duration": 1.0}


@pytest.fixture(autouse=True)
def installed(tmp_path, monkeypatch):
    """Make every example importable and write for it the metadata that pip would write."""
    for example in EXAMPLES.glob("*/setup.cfg"):
        read = configparser.ConfigParser()
        read.read(example)
        if "metadata" not in read:  # a package that colcon builds; its test is test_vehicle_interface
            continue
        name, version = read["metadata"]["name"], read["metadata"]["version"]
        folder = tmp_path / f"{name}-{version}.dist-info"
        folder.mkdir()
        (folder / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n", "utf-8")
        points = read["options.entry_points"].items()
        (folder / "entry_points.txt").write_text("".join(f"[{group}]{lines}\n" for group, lines in points), "utf-8")
        monkeypatch.syspath_prepend(example.parent)
    monkeypatch.syspath_prepend(tmp_path)
    caches = (plugins.installed, plugins.load)
    for kept in caches:
        kept.cache_clear()
    yield
    for kept in caches:
        kept.cache_clear()


def test_a_position_law():
    flown = flight.fly(flight.from_names("hover", position="my_law", **SHORT))
    assert flown.outcome == "ended"
    assert flown.rmse < 0.3
    steps = flown.topics["position_controller/internals"]["steps"]
    assert steps.tolist() == list(range(len(steps)))


def test_an_attitude_law():
    flown = flight.fly(flight.from_names("hover", attitude="my_attitude_law", **SHORT))
    assert flown.outcome == "ended"
    assert flown.rmse < 0.1
    # torque of a step: inertia times 200 angle errors and 25 rates, Table 1's inertia about z
    errors = flown.topics["attitude_controller/internals"]["angle_error"]
    omega, torque = flown.topics["state"]["omega_b"], flown.topics["wrench_setpoint"]["torque_b"]
    expected = -7.0e-3 * (200.0 * errors[:, 2] + 25.0 * omega[:, 2])
    assert abs(torque[:, 2] - expected).max() < 1e-12


def test_a_trajectory():
    settings = ["trajectory.my_trajectory.height=1.5", "trajectory.my_trajectory.duration=5"]
    flown = flight.fly(flight.from_names("my_trajectory", settings=settings))
    assert (flown.outcome, flown.steps) == ("ended", 2500)
    assert flown.rmse < 0.05
    assert flown.topics["reference"]["p_w"][-1].tolist() == [0.0, 0.0, 1.5]
    climb = flown.topics["reference"]
    # velocity is the slope of position, samples every 10 ms
    slope = (climb["p_w"][2:, 2] - climb["p_w"][:-2, 2]) / 0.02
    assert abs(slope - climb["v_w"][1:-1, 2]).max() < 1e-3


def test_a_plant():
    flown = flight.fly(flight.from_names("hover", plant="my_plant", **SHORT))
    assert flown.outcome == "ended"
    assert flown.rmse < 0.1


def test_a_vehicle():
    flown = flight.fly(flight.from_names("hover", vehicle=str(EXAMPLES / "my_vehicle.yaml"), **SHORT))
    assert flown.outcome == "ended"
    assert flown.rmse < 0.05
    assert flown.topics["actuation"]["thrust"].max() <= 2.5 * 0.5 * 9.81 + 1e-9
    # in hover four rotors carry 0.5 kg: 600 rad/s each
    assert abs(flown.topics["actuation"]["rotor_speed"][-500:].mean() - 600.0) < 30.0


@pytest.fixture
def short_flights(monkeypatch):
    """Have every flight take 0.1 s, whatever else is asked of it."""
    given = flight.from_names
    short = {"duration": 0.1, "start": "printed"}
    monkeypatch.setattr(flight, "from_names", lambda *names, **choices: given(*names, **{**choices, **short}))


def test_five_lines_fly_without_ros(short_flights, capsys):
    runpy.run_path(str(EXAMPLES / "fly_without_ros.py"), run_name="__main__")
    assert capsys.readouterr().out.startswith("ended after 50 steps, position error")


def test_the_lines_of_the_readme_fly_without_ros(short_flights, capsys):
    text = (EXAMPLES.parent / "README.md").read_text(encoding="utf-8")
    lines = re.search(r"```python\n(.*?)```", text, re.DOTALL)[1]
    exec(compile(lines, "README.md", "exec"), {})
    assert re.fullmatch(r"ended: RMSE [0-9.]+ mm\n", capsys.readouterr().out)
