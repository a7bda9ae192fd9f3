"""Every enumeration has the numbers of the message that carries it."""

import re
from pathlib import Path

import pytest

from quad_core.enumerations import Answer, FlightPhase, GuardMode, Mode, NodeState, Request

MESSAGES = Path(__file__).resolve().parents[2] / "quad_msgs" / "msg"


@pytest.mark.parametrize(("message", "kinds"), [
    ("FlightMode", (Mode, Answer)),
    ("FlightRequest", (Request,)),
    ("FlightState", (FlightPhase,)),
    ("GuardStatus", (GuardMode,)),
    ("NodeStatus", (NodeState,)),
])  # fmt: skip
def test_the_constants_of_a_message_are_those_of_its_enumerations(message, kinds):
    text = (MESSAGES / f"{message}.msg").read_text(encoding="utf-8")
    constants = {name: int(number) for name, number in re.findall(r"^uint8 ([A-Z_]+)=(\d+)", text, re.MULTILINE)}
    assert constants == {member.name: member.value for kind in kinds for member in kind}
