"""A gain set while the vehicle flies: the bag holds what the law ran with, and the replay gives every bit again."""

import numpy as np
import pytest
from flying import PATIENT, finish, start, stranger, wait_until_flying
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.executors import SingleThreadedExecutor

from quad_analysis.replay import replay
from quad_analysis.tables import recorded_parameters
from quad_flight_log.reader import open_flight

pytestmark = pytest.mark.flight
DOMAIN = 158  # none that flights choose for themselves


def set_parameter(node_name, name, value):
    """Do what `ros2 param set` does; returns whether the node accepted it."""
    with stranger(DOMAIN, "param_set") as node:
        executor = SingleThreadedExecutor(context=node.context)
        executor.add_node(node)
        client = node.create_client(SetParameters, f"{node_name}/set_parameters")
        assert client.wait_for_service(20.0)
        request = ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=value)
        future = client.call_async(SetParameters.Request(parameters=[Parameter(name=name, value=request)]))
        executor.spin_until_future_complete(future, timeout_sec=20.0)
        executor.shutdown()
        return future.result().results[0].successful


@pytest.mark.parametrize("mode", [
    pytest.param((), id="lockstep"),
    pytest.param(("--realtime", *PATIENT), id="realtime", marks=pytest.mark.wall_clock),
])  # fmt: skip
def test_a_live_change_is_recorded_as_it_was_flown(tmp_path, mode, monkeypatch):
    out = tmp_path / "bag"
    flying = start("hover", "--duration", "2", *mode, "--domain", str(DOMAIN), "--out", out)
    wait_until_flying(flying, out)
    assert set_parameter("/position_controller", "aibs.x.position_gain", 2.25)
    # what is out of range, or protects the vehicle, is nobody's to change in flight
    assert not set_parameter("/position_controller", "aibs.x.position_gain", -1.0)
    assert not set_parameter("/simulator", "guard.command.lost_age", 9.0)
    done = finish(flying, 180.0)
    assert done.returncode == 0, done.stdout + done.stderr
    bag = open_flight(out)
    parameters = recorded_parameters(bag)
    assert not parameters["simulator"].changes
    (change,) = parameters["position_controller"].changes
    assert change.values["aibs.x.position_gain"] == 2.25
    assert change.step > 0
    found = replay(bag, "position_controller")
    assert found.equal, found.differences()
    # in real time, too, a step has the reference of its own step
    rows = bag.array("position_controller/internals")
    assert np.mean(rows["step"] == rows["input_steps"][:, 0]) > 0.9
