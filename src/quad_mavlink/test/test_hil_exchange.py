"""Lockstep without a network: which answers count, and the clock of an autopilot that boots."""

import math
import time
from types import SimpleNamespace

import pytest

from quad_core.types import Vec3, VehicleState
from quad_mavlink.hil.exchange import Exchange, RefusedError
from quad_mavlink.hil.parameters import JoinedPlantParameters
from quad_mavlink.hil.suite import Suite

CALM = Vec3(0.0, 0.0, 0.0)


class Words:
    """Stands for pymavlink: each message is its name and its fields."""

    def __getattr__(self, name):
        return lambda *fields: (name.removeprefix("MAVLink_").removesuffix("_message"), *fields)


class Peer:
    """Stands for the server: keeps what is sent, hands out what is put in."""

    def __init__(self):
        self.sent, self.inbox, self.is_closed = [], [], False

    def send(self, messages):
        self.sent.append(messages)

    def next(self, kind, patience):
        assert kind == "HIL_ACTUATOR_CONTROLS"
        if self.inbox:
            return self.inbox.pop(0)
        time.sleep(patience)
        return None


def controls(time_usec, first=0.5, mode=129, flags=1):
    return SimpleNamespace(time_usec=time_usec, controls=[first, 0.5, 0.5, 0.5] + [0.0] * 12, mode=mode, flags=flags)


@pytest.fixture
def exchange():
    return Exchange(Words(), Peer(), Suite(JoinedPlantParameters(), 1, 4_000_000, 9.81))


def test_the_sensors_go_out_last_because_they_move_the_clock(exchange):
    for _ in range(25):
        exchange.send(VehicleState(), CALM)
    assert [message[0] for message in exchange.server.sent[0]] == ["hil_sensor"]
    kinds = [message[0] for message in exchange.server.sent[24]]
    assert kinds == ["hil_state_quaternion", "hil_gps", "hil_sensor"]
    assert {message[1] for message in exchange.server.sent[24]} == {100_000}


def test_only_the_answer_to_the_last_reading_counts(exchange):
    exchange.send(VehicleState(), CALM)
    exchange.send(VehicleState(), CALM)
    exchange.server.inbox = [controls(4000), controls(8000, first=0.25)]
    found = exchange.answer(0.0)
    assert (found.time_usec, found.controls[0], found.armed) == (8000, 0.25, True)
    assert exchange.stale == 1
    assert exchange.answer(0.0) is None


@pytest.mark.parametrize(
    ("answer", "words"),
    [(controls(4000, first=math.nan), "nan"), (controls(8000), "8000"), (controls(4000, flags=0), "lockstep")],
)
def test_an_answer_that_cannot_be_flown_is_refused(exchange, answer, words):
    exchange.send(VehicleState(), CALM)
    exchange.server.inbox = [answer]
    with pytest.raises(RefusedError, match=words):
        exchange.answer(0.0)


def test_while_the_autopilot_boots_its_clock_runs_at_the_steady_pace(exchange):
    begun = time.monotonic()
    assert exchange.boot(VehicleState(), CALM, 0.004, begun + 0.1) is None
    elapsed = time.monotonic() - begun
    assert 2 <= len(exchange.server.sent) <= elapsed / 0.004 + 1.0


def test_the_first_answer_ends_the_boot(exchange):
    exchange.server.inbox = [controls(0), controls(4000)]
    found = exchange.boot(VehicleState(), CALM, 0.004, time.monotonic() + 10.0)
    assert found.time_usec == 4000
    assert len(exchange.server.sent) == 1


def test_an_autopilot_that_left_is_not_waited_for(exchange):
    exchange.server.is_closed = True
    assert exchange.boot(VehicleState(), CALM, 0.004, time.monotonic() + 10.0) is None
    assert exchange.server.sent == []
