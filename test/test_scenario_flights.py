"""Scenarios over real processes: the bits of the flight without ROS, events reported when they act, lines refused."""

import numpy as np
import pytest
from flying import CONFIG, flown
from test_same_bits import assert_same

from quad_bringup.fly import main
from quad_flight.flight import flight_from_files, fly

FILES = [CONFIG / f"{name}.yaml" for name in ("vehicles/x500", "controllers/x500", "scenarios/flight")]
TROUBLE = """\
# Trouble for a short hover.
/**/simulator:
  ros__parameters:
    disturbance: timeline
    timeline:
      events: |
        # what comes
        push start=0.4 end=0.5 force=1,0,0
        payload start=0.6 mass=0.05 offset=0.02,0,-0.05
        rotor start=0.8 number=2 effectiveness=0.999
        link start=0.3 end=1.5 delay=0.002 jitter=0.004 drop=0.05
        freeze start=1.0 end=1.02
        gust start=0.2 end=1.2 velocity=2,1,0
"""


@pytest.mark.flight
def test_the_outdoor_flight_has_the_bits_of_the_flight_without_ros(tmp_path):
    choices = ("flight", "--vehicle", "x500", "--preset", "x500", "--duration", "0.5", "--seed", "3")
    bag = flown(*choices, "--out", tmp_path / "bag")
    changes = {"/**": {"flight.seed": 3}, "trajectory": {"case2.duration": 0.5}}
    result = fly(flight_from_files(FILES, changes))
    assert_same(bag, result)
    error = np.abs(result.topics["state"]["p_w"] - result.topics["truth"]["p_w"])
    assert error.max() > 0.02
    assert np.ptp(result.topics["disturbance"]["wind_w"], axis=0).min() > 0.1


@pytest.mark.flight
def test_a_scenario_of_one_s_own_acts_and_is_reported(tmp_path):
    file = tmp_path / "trouble.yaml"
    file.write_text(TROUBLE)
    bag = flown(
        "hover", "--scenario", file, "--duration", "0.1", "--out", tmp_path / "bag", "--limits", "position_max=5"
    )
    assert_same(bag, fly(flight_from_files([*paper(), file], {"trajectory": {"hover.duration": 0.1}})))
    acting = bag.array("disturbance")
    assert (acting["payload_mass"] > 0.0).sum() == len(acting) - 300
    assert (acting["force_w"][:, 0] == 1.0).sum() == 50
    assert acting["sensor_frozen"].sum() == 10
    assert acting["link_lost"].any()
    reported = bag.array("flight/events")
    when = dict(zip(reported["text"].tolist(), reported["stamp_ns"] // 2_000_000, strict=True))
    assert when["begins: push start=0.4 end=0.5 force=1,0,0"] == 200
    assert when["ends: push start=0.4 end=0.5 force=1,0,0"] == 250
    assert when["begins: payload start=0.6 mass=0.05 offset=0.02,0,-0.05"] == 300
    state = bag.array("state")["p_w"]
    assert (state[500:510] == state[500]).all()


def paper():
    return [CONFIG / f"{name}.yaml" for name in ("vehicles/paper", "controllers/tuned", "scenarios/hover")]


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("typhoon start=1", ["bad.yaml:6:", "typhoon", "held_gaussian"]),
        ("push start=5 end=4 force=1,0,0", ["bad.yaml:6:", "end", "more than start"]),
    ],
)
def test_a_line_that_is_no_event_is_refused_before_take_off(capsys, tmp_path, monkeypatch, line, words):
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "bad.yaml"
    head = "/**/simulator:\n  ros__parameters:\n    disturbance: timeline\n    timeline:\n      events: |\n"
    file.write_text(f"{head}        {line}\n")
    assert main(["hover", "--scenario", str(file)]) == 2
    said = capsys.readouterr().err
    assert all(word in said for word in words), said
    assert not (tmp_path / "flights").exists()
