"""A mode of ours in PX4's list, by the protocol of 1.18: setpoints are configured with a reply."""

from types import SimpleNamespace

import pytest

from quad_px4.external_mode import NEEDED, ExternalMode
from quad_px4.parameters import Mode

NUMBER, CHECK = 24, 3


class Message(SimpleNamespace):
    LATEST_PX4_ROS2_API_VERSION = 1

    @classmethod
    def get_fields_and_field_types(cls):
        return {field for fields in NEEDED.values() for field in fields}


NAMES = (
    "RegisterExtComponentRequest", "RegisterExtComponentReply", "ArmingCheckRequest", "ArmingCheckReply",
    "UnregisterExtComponent", "VehicleControlMode", "SetpointConfig", "SetpointConfigReply",
)  # fmt: skip


@pytest.fixture
def mode():
    """Return a mode in torque; ``sent`` {topic: messages}, ``hear`` {topic: callback}."""
    px4 = SimpleNamespace(**{name: type(name, (Message,), {}) for name in NAMES})
    sent, hear = {}, {}
    node = SimpleNamespace(
        create_publisher=lambda _, topic, __: SimpleNamespace(publish=sent.setdefault(topic, []).append),
        create_subscription=lambda _, topic, callback, __: hear.update({topic: callback}),
    )
    made = ExternalMode(node, px4, "", "Case flight", Mode.WRENCH, lambda: "", 0.25)
    made.sent, made.hear = sent, hear
    made.ask(1)
    (request,) = sent["/fmu/in/register_ext_component_request"]
    hear["/fmu/out/register_ext_component_reply"](
        Message(request_id=request.request_id, px4_ros2_api_version=1, success=True, mode_id=NUMBER,
                arming_check_id=CHECK, timestamp=2)
    )  # fmt: skip
    return made


def configured(mode, result=0):
    mode.hear["/fmu/out/setpoint_config_reply"](Message(type=15, source_id=NUMBER, result=result))


def test_it_is_registered_once_px4_can_take_its_setpoints_and_misses_them_in_time(mode):
    (asked,) = mode.sent["/fmu/in/setpoint_config"]
    assert (asked.type, asked.source_id, asked.should_apply, asked.timeout_ms) == (15, NUMBER, False, 250)
    assert mode.is_open
    configured(mode)
    assert (mode.nav_state, mode.failure, mode.watches) == (NUMBER, "", True)


def test_its_setpoints_are_applied_once_it_is_selected(mode):
    configured(mode)
    mode.selected(False, 3)
    assert len(mode.sent["/fmu/in/setpoint_config"]) == 1
    mode.selected(True, 4)
    mode.selected(True, 5)
    assert [each.should_apply for each in mode.sent["/fmu/in/setpoint_config"]] == [False, True, True]
    configured(mode)
    mode.selected(True, 6)
    assert len(mode.sent["/fmu/in/setpoint_config"]) == 3
    mode.selected(False, 7)
    mode.selected(True, 8)
    assert mode.sent["/fmu/in/setpoint_config"][-1].timestamp == 8


@pytest.mark.parametrize(("result", "words"), [(2, "unsupported for this vehicle"), (9, "result 9")])
def test_setpoints_that_px4_refuses_are_a_failure_by_name(mode, result, words):
    configured(mode, result)
    assert mode.failure == f"PX4 refused its setpoints: {words}"
    assert not mode.is_open
    mode.close()
    assert [each.mode_id for each in mode.sent["/fmu/in/unregister_ext_component"]] == [NUMBER]


def test_a_selected_mode_whose_setpoints_are_never_applied_is_a_failure(mode):
    configured(mode)
    for _ in range(60):
        mode.selected(True, 3)
    assert mode.failure == "PX4 did not apply its setpoints"
