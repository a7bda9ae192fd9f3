"""First flights in steps over ROS: the bench opens the hop, and beyond a limit the guard flies within 0.1 s."""

import numpy as np
import pytest
from flying import flown, fly

from quad_bringup.fly import main
from quad_core.enumerations import GuardMode
from quad_flight_log.reader import open_flight

pytestmark = pytest.mark.flight


def refusal(capsys, *arguments):
    """Return the line in which a step is refused."""
    assert main(list(map(str, arguments))) == 2
    return capsys.readouterr().err


def test_a_step_opens_the_next_and_a_limit_hands_back(tmp_path, capsys):
    assert "no bag of step bench" in refusal(capsys, "--step", "hop", "--out", tmp_path / "early")
    bench = flown("--step", "bench", "--mission", "takeoff:0.3,hold:18,land", "--out", tmp_path / "bench")
    assert bench.metadata["step"] == "bench"
    for other, why in ((("--vehicle", "x500"), "another vehicle"), (("--preset", "minimal"), "other gains")):
        assert f"bench: {why}" in refusal(capsys, "--step", "hop", *other, "--out", tmp_path / "other")

    windy = fly("--step", "hop", "--set", "simulator.disturbance=held_gaussian", "--out", tmp_path / "windy")
    assert windy.returncode == 1, windy.stderr
    assert f"opened by {tmp_path / 'bench'}" in windy.stdout
    assert "beyond the speed of the step" in windy.stderr
    flight = open_flight(tmp_path / "windy")
    truth, guard = flight.array("truth"), flight.array("flight/guard")
    beyond = truth["stamp_ns"][np.linalg.norm(truth["v_w"], axis=1) > 0.5][0]
    taken = guard["stamp_ns"][guard["mode"] == GuardMode.DESCEND][0]
    assert 0 <= taken - beyond <= 100_000_000
    assert np.abs(truth["p_w"][:, :2]).max() < 1.0
    assert "windy: Failed: mission not finished" in refusal(capsys, "--step", "hover", "--out", tmp_path / "hover")

    flown("--step", "hop", "--out", tmp_path / "hop")
