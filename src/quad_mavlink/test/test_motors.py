"""Motor outputs in PX4's order against force times arm and on the plant's rotors; lockstep without a network."""

import math
import time
from types import SimpleNamespace

import numpy as np
import pytest

from quad_core.parameters import ParameterError
from quad_core.types import ALL_ROTORS, Conditions, Vec3, VehicleState
from quad_core.vehicle import Layout, Vehicle
from quad_dynamics import rigid_body
from quad_dynamics.rotors import allocate_within, rotor_limit
from quad_mavlink import motors
from quad_mavlink.motors import Exchange, RefusedError
from quad_mavlink.sensors import Sensors, Suite
from quad_px4 import mapping

VEHICLE = Vehicle(
    mass=2.0, gravity=9.81, arm_length=0.25, lift_coefficient=8e-6, torque_coefficient=1.6e-7,
    thrust_to_weight=2.0, layout=Layout.X.value,
)  # fmt: skip
LARGEST = 2.0 * 2.0 * 9.81 / 4.0
SIDE = 0.25 / math.sqrt(2.0)
# PX4's quad-x: front right, rear left, front left, rear right; x forward, y left; + turns the body to the left
PLACES = [(SIDE, -SIDE, -1.0), (-SIDE, SIDE, -1.0), (SIDE, SIDE, 1.0), (-SIDE, -SIDE, 1.0)]
NAMES = ["r2", "r4", "r3", "r1"]  # 1 rear right, 2 front right, 3 front left, 4 rear left


def answer(controls, mode=129, flags=1, time_usec=4000):
    return motors.Answer(time_usec, tuple(controls), mode, flags)


def wrench(controls, curve=0.0, **fields):
    return motors.wrench(mapping.build(motors.airframe(VEHICLE, curve)), answer(controls, **fields))


@pytest.mark.parametrize("seed", range(5))
def test_the_wrench_is_that_of_forces_at_their_places(seed):
    controls = np.random.default_rng(seed).random(4)
    torque = np.zeros(3)
    for control, (x, y, turn) in zip(controls, PLACES, strict=True):
        force = LARGEST * control
        torque += np.cross([x, y, 0.0], [0.0, 0.0, force])
        torque[2] += turn * 0.02 * force
    found = wrench(controls)
    assert found.thrust == pytest.approx(LARGEST * controls.sum())
    assert found.torque_b == pytest.approx(torque)


@pytest.mark.parametrize("motor", range(4))
def test_each_output_drives_the_rotor_in_its_place(motor):
    controls = [0.5] * 4
    controls[motor] = 0.6
    thrusts = allocate_within(VEHICLE, wrench(controls), rotor_limit(VEHICLE)).rotor_thrust._asdict()
    expected = {name: LARGEST * control for name, control in zip(NAMES, controls, strict=True)}
    assert thrusts == pytest.approx(expected)


def test_a_weak_front_right_rotor_rolls_right_and_pitches_down():
    parameters = rigid_body.Parameters()
    weak = Conditions(rotor_effectiveness=ALL_ROTORS._replace(r2=0.8))
    state = rigid_body.init(parameters, VEHICLE)
    state, _ = rigid_body.step(parameters, VEHICLE, state, wrench([0.5] * 4), weak, 0.01)
    p, q, r = state.motion.omega_b
    assert p > 1e-3  # FLU: right side down is positive roll
    assert q > 1e-3  # nose down is positive pitch
    assert r > 0.0  # it lacks the torque of a rotor that turns the body to the right


def test_the_thrust_curve_is_between_linear_and_square():
    assert wrench([0.5] * 4, curve=1.0).thrust == pytest.approx(LARGEST)
    assert wrench([0.5] * 4, curve=0.3).thrust == pytest.approx(4.0 * LARGEST * (0.3 * 0.25 + 0.7 * 0.5))
    assert wrench([1.0] * 4, curve=0.3).thrust == pytest.approx(4.0 * LARGEST)


def test_disarmed_motors_do_nothing():
    assert wrench([0.5] * 4, mode=1) == (0.0, Vec3(0.0, 0.0, 0.0))


@pytest.mark.parametrize(("answer", "words"), [
    (answer([0.5, math.nan, 0.5, 0.5]), "controls[1]: found nan, expected 0 to 1"),
    (answer([0.5, 0.5, 0.5, 1.1]), "controls[3]: found 1.1"),
    (answer([-0.1, 0.5, 0.5, 0.5]), "controls[0]: found -0.1"),
    (answer([0.5] * 4, flags=0), "lockstep"),
    (answer([0.5] * 4, time_usec=4001), "time_usec: found 4001, expected at most our clock's 4000"),
])  # fmt: skip
def test_answers_that_cannot_be_flown_are_refused_with_the_field(answer, words):
    assert words in motors.refusal(answer, 4000)


def test_good_and_late_answers_are_not_refused():
    assert motors.refusal(answer([0.0, 1.0, 0.5, 1.0000001]), 4000) == ""
    assert motors.refusal(answer([0.5] * 4, time_usec=0), 4000) == ""


def test_rotors_on_the_axes_are_refused():
    with pytest.raises(ParameterError, match=r"vehicle\.layout: found plus"):
        motors.airframe(VEHICLE._replace(layout=Layout.PLUS.value), 0.0)


def test_what_px4_must_be_told_is_said_in_its_own_words():
    words = motors.described(motors.airframe(VEHICLE, 0.3))
    assert "CA_ROTOR0_PX 0.1768 _PY 0.1768 _KM 0.02" in words
    assert "CA_ROTOR3_PX -0.1768 _PY 0.1768 _KM -0.02" in words
    assert "THR_MDL_FAC 0.3" in words


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
    return Exchange(Words(), Peer(), Suite(Sensors(), 1, 4_000_000, 9.81))


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
    assert exchange.answer(0.0) is None


def test_an_answer_that_cannot_be_flown_is_refused(exchange):
    exchange.send(VehicleState(), CALM)
    exchange.server.inbox = [controls(4000, first=math.nan)]
    with pytest.raises(RefusedError, match="nan"):
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
