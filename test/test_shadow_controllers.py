"""A shadow controller is recorded and not obeyed: the flight has the same bits with it, and survives it."""

import os
import signal
import time

import flying
import pytest
from test_same_bits import assert_same

from quad_analysis.arrays import by_stamp
from quad_analysis.metrics import thrust_and_torque
from quad_analysis.replay import replay
from quad_core.parameters import ParameterError
from quad_flight.flight import fly, from_names
from quad_flight.set_up import Request, resolve_flight, shadow_laws
from quad_flight_log.payload_hash import payload_hash, topic_hashes
from quad_flight_log.reader import open_flight


@pytest.mark.flight
def test_the_flight_has_the_same_bits_and_the_shadow_those_of_its_law(tmp_path):
    shadows = ("--shadow", "position=pid", "--shadow", "attitude=pid")
    words = ("hover", *flying.AT_ONCE, "--duration", "1", "--seed", "21")
    bag = flying.flown(*words, *shadows, "--out", tmp_path / "bag")
    assert_same(bag, fly(from_names("hover", start="printed", duration=1.0, seed=21)))
    assert not any(topic.startswith("shadow") for topic in topic_hashes(bag))
    assert len(payload_hash(bag)) == 64
    steps = bag.topics["/state"].messages
    wrench, setpoint = by_stamp(bag.array("shadow/wrench_setpoint")), by_stamp(bag.array("shadow/attitude_setpoint"))
    assert (len(wrench), len(setpoint)) == (steps, -(-steps // 5))
    attitude = replay(bag, "attitude_controller", law="pid").replayed
    thrust, torque = thrust_and_torque(wrench)
    assert thrust.tobytes() == attitude["wrench_setpoint thrust"].tobytes()
    assert torque[:, 0].tobytes() == attitude["wrench_setpoint torque_b.x"].tobytes()
    assert torque.any()
    position = replay(bag, "position_controller", law="pid").replayed
    assert setpoint["angles"][:, 1].tobytes() == position["attitude_setpoint angles.y"].tobytes()


@pytest.mark.flight
def test_a_shadow_that_stood_still_has_all_its_steps_and_a_flight_survives_one_that_is_killed(tmp_path):
    words = ("--shadow", "itsm", "--shadow", "position=pid")
    process = flying.start("hover", "--duration", "2", *words, "--out", tmp_path / "bag")
    pids = flying.wait_until_flying(process, tmp_path / "bag", 60_000)
    os.kill(pids["shadow_position_controller"], signal.SIGKILL)
    os.kill(pids["shadow_attitude_controller"], signal.SIGSTOP)
    time.sleep(1.0)
    os.kill(pids["shadow_attitude_controller"], signal.SIGCONT)
    done = flying.finish(process)
    assert done.returncode == 0, done.stderr
    assert "shadow_position_controller was killed by SIGKILL; the flight does not depend on it" in done.stderr
    bag = open_flight(tmp_path / "bag")
    assert bag.topics["/state"].messages == 2500
    for topic in ("shadow/wrench_setpoint", "shadow/attitude_controller/internals"):
        assert len(by_stamp(bag.array(topic))) == 2500


@pytest.mark.unit
def test_a_shadow_is_told_apart_by_its_law():
    assert shadow_laws(["itsm", "position=pid"]) == {
        "shadow_attitude_controller": "itsm",
        "shadow_position_controller": "pid",
    }
    for laws, word in ((["pid"], "'pid'"), (["lqr"], "'lqr'"), (["itsm", "attitude=pid"], "one attitude law")):
        with pytest.raises(ParameterError, match=word):
            shadow_laws(laws)


@pytest.mark.unit
def test_a_shadow_has_its_own_parameters():
    settings = ("flight.seed=9", "shadow_position_controller.aibs.x.position_gain=3.25")
    nodes = resolve_flight(Request("hover", shadows=["aibs"], settings=settings), {})
    assert nodes["shadow_position_controller"].plugins["law"].parameters.x.position_gain == 3.25
    assert nodes["position_controller"].plugins["law"].parameters.x.position_gain != 3.25
    assert nodes["shadow_position_controller"].flight == nodes["simulator"].flight
    assert "shadow_position_controller" in nodes["simulator"].flight.roles
