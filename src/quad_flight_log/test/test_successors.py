"""A second, different answer to one step: a fault, unless somebody has just taken over from who gave the first."""

import pytest
from rclpy.serialization import serialize_message

from quad_flight_log.recorder.successors import Successors
from quad_msgs.msg import FlightEvent, Takeover

PERIOD = 2_000_000


def heard(*takeovers):
    """Return what knows of ``takeovers``, (role, run_id, step), and what was passed on."""
    kept = []
    successors = Successors("mine", PERIOD)
    listen = successors.listening(kept.append)
    payloads = [serialize_message(Takeover(role=role, run_id=run, step=step)) for role, run, step in takeovers]
    for payload in payloads:
        listen(payload)
    assert kept == payloads
    return successors


@pytest.mark.parametrize("role", ["position_controller", "shadow_position_controller"])
@pytest.mark.parametrize(
    ("topic", "step", "kind"),
    [
        ("attitude_setpoint", 7670, "answered_twice"),
        ("attitude_setpoint", 7665, "answered_twice"),
        ("position_controller/internals", 7665, "answered_twice"),
        ("attitude_setpoint", 7675, "conflict"),  # who took over answers that step alone
        ("attitude_setpoint", 7170, "conflict"),  # nobody sends again what is 1 s old
        ("wrench_setpoint", 7665, "conflict"),  # of a stage in which nobody took over
        ("state", 7665, "conflict"),
    ],
)
def test_who_takes_over_may_answer_otherwise_what_the_dead_has_answered_in_part(role, topic, step, kind):
    severity, found, text = heard((role, "mine", 300), (role, "mine", 7670)).judge(topic, step * PERIOD)
    assert found == kind
    assert severity == FlightEvent.WARNING
    assert text.startswith(f"{topic}: ")
    assert f"stamp {step * PERIOD} ns" in text


@pytest.mark.parametrize("takeovers", [[], [("position_controller", "foreign", 7670)]])
def test_without_a_takeover_in_this_flight_it_is_a_fault(takeovers):
    assert heard(*takeovers).judge("attitude_setpoint", 0)[1] == "conflict"
    assert heard(*takeovers).judge("attitude_setpoint", 7670 * PERIOD)[1] == "conflict"
