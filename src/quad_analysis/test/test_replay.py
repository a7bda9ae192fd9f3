"""Recorded inputs through the laws again: equal bits, and every difference is found."""

import copy
from typing import get_type_hints

import flight_samples
import numpy as np
import pytest
from flight_samples import TYPES
from loop_flight import FlownFlight, write_flight

from quad_analysis.replay import replay
from quad_analysis.tables import recorded_parameters
from quad_core.cascade import STAGE
from quad_core.types import Actuation, PositionInputs, TrajectoryPoint, VehicleState
from quad_core.vehicle import hold_position
from quad_flight_log.errors import TopicError
from quad_flight_log.reader import open_flight
from quad_position_ctrl import aibs
from quad_report import cli


@pytest.mark.parametrize("role", STAGE)
def test_the_recorded_law_gives_the_recorded_bits(role, flown, flown_bag):
    found = replay(open_flight(flown_bag), role)
    assert found.equal
    assert found.missing == 0
    period = flown.flight.resolved[role].node.period_steps
    assert found.steps.tolist() == list(range(0, flown.result.steps, period))
    output, internals = STAGE[role].output, f"{role}/internals"
    assert {name.split()[0] for name in found.recorded} == {output, internals}
    quantity = "thrust" if role == "attitude_controller" else "angles"
    values = flown.result.topics[output][quantity]
    np.testing.assert_array_equal(
        found.replayed[f"{output} thrust" if values.ndim == 1 else f"{output} angles.x"],
        values if values.ndim == 1 else values[:, 0],
    )


def test_one_bit_in_one_recorded_answer_is_seen(flown, tmp_path):
    index = next(
        at
        for at, (topic, sample) in enumerate(flown.messages)
        if topic == "wrench_setpoint" and sample.header.stamp.nanosec == 300 * 2_000_000
    )
    other = copy.deepcopy(flown.messages[index][1])
    other.wrench.torque.y = float(np.nextafter(other.wrench.torque.y, 1.0))
    found = replay(open_flight(write_flight(tmp_path / "bag", flown, replace={index: other})), "attitude_controller")
    assert not found.equal
    (seen,) = [item for item in found.differences() if item.differing]
    assert (seen.name, seen.differing, seen.first_step) == ("wrench_setpoint torque_b.y", 1, 300)
    assert 0.0 < seen.largest < 1e-15


def test_a_bag_without_inputs_or_parameters_is_named(flown, tmp_path):
    def without(name: str, *topics: str):
        rest = flown._replace(messages=[item for item in flown.messages if item[0] not in topics])
        return open_flight(write_flight(tmp_path / name, rest))

    with pytest.raises(TopicError, match="no topic 'actuation'"):
        replay(without("a", "actuation"), "attitude_controller")
    with pytest.raises(TopicError, match="no topic 'flight/parameters'"):
        replay(without("b", "flight/parameters"), "position_controller")
    with pytest.raises(TopicError, match="no topic 'position_controller/internals'"):
        replay(without("c", "position_controller/internals"), "position_controller")


def said_later(flown, tmp_path, step):
    """Return the flight whose attitude controller says another gain later, from ``step`` on."""
    later = flight_samples.message("quad_msgs/msg/NodeParameters", role="attitude_controller", step=step)
    text = next(s.parameters for t, s in flown.messages if t == "flight/parameters" and s.role == later.role)
    gain = "abfnitsm.roll.linear_gain: 20.0"
    assert gain in text
    later.parameters = text.replace(gain, "abfnitsm.roll.linear_gain: 19.0")
    messages = [(f"/{topic}", sample) for topic, sample in flown.messages] + [("/flight/parameters", later)]
    directory = tmp_path / "bag"
    flight_samples.write_bag(directory, messages, log_ns=lambda index, _: 1_500_000_000 if index else 0)
    return open_flight(directory)


def test_a_change_in_flight_is_replayed_from_its_step_on(flown, tmp_path):
    found = replay(said_later(flown, tmp_path, step=100), "attitude_controller")
    assert any("changes them at step 100" in note for note in found.notes)
    # the flight itself kept its gain, so a replay with the change must differ from that step on, and not before
    assert not found.equal
    assert min(item.first_step for item in found.differences() if item.differing) == 100


def test_what_a_process_says_that_was_started_again_is_no_change_in_flight(flown, tmp_path):
    assert recorded_parameters(said_later(flown, tmp_path, step=0))["attitude_controller"].changes == ()


def test_the_command_proves(flown_bag, capsys):
    assert cli.main(["replay", str(flown_bag)]) == 0
    assert capsys.readouterr().out.count("every bit is equal") == 2


def test_a_replay_that_differs_fails(flown, tmp_path, capsys):
    at = next(i for i, (topic, _) in enumerate(flown.messages) if topic == "attitude_setpoint")
    other = copy.deepcopy(flown.messages[at][1])
    other.thrust += 0.25
    directory = write_flight(tmp_path / "bag", FlownFlight(*flown), replace={at: other})
    assert cli.main(["replay", str(directory)]) == 1
    assert "attitude_setpoint thrust" in capsys.readouterr().out


def test_a_flight_in_a_namespace_is_replayed_alike(flown, tmp_path):
    def said(sample):
        other = copy.deepcopy(sample)
        other.parameters = other.parameters.replace(f"/{sample.role}:", f"/uav1/{sample.role}:")
        return other

    messages = [
        (f"/uav1/{topic}", said(sample) if topic == "flight/parameters" else sample)
        for topic, sample in flown.messages
        if not topic.startswith("/")
    ]
    shadow = [(f"/uav1/shadow/{topic}", sample) for topic, sample in flown.messages if topic == "wrench_setpoint"]
    path = flight_samples.write_bag(tmp_path / "bag", messages + shadow)
    assert replay(open_flight(path), "attitude_controller").equal
    assert replay(open_flight(path, namespace="uav1"), "position_controller").equal


ROLE = "position_controller"
STALE = 40  # which of the answers is made from a held position


def tuple_of(kind, sample):
    """Return a message as its law takes it."""
    forms, values = get_type_hints(kind), {name: getattr(sample, name) for name in kind._fields}
    return kind(
        **{
            name: forms[name](*value.tolist()) if isinstance(value, np.ndarray) else value
            for name, value in values.items()
        }
    )


def answered(flown, seed):
    """Run the law as a busy machine would: steps are missed, setpoints and actuations come late."""
    rng = np.random.default_rng(seed)
    by_topic = {topic: [sample for name, sample in flown.messages if name == topic] for topic in TYPES}
    law = flown.flight.resolved[ROLE].plugins["law"].parameters
    vehicle = flown.flight.resolved[ROLE].vehicle
    memory, before, found = aibs.init(law, vehicle), None, []
    step = 5
    while step < len(by_topic["state"]):
        late, later = int(rng.integers(0, 4)), int(rng.integers(1, 6))
        given = max(step // 5 - late, 0)
        seen = tuple_of(TrajectoryPoint, by_topic["reference"][given])
        if len(found) == STALE:
            seen = hold_position(seen)
        inputs = PositionInputs(
            tuple_of(VehicleState, by_topic["state"][step]),
            seen,
            tuple_of(Actuation, by_topic["actuation"][step - later]),
        )
        dt = 0.01 if before is None else min(max((step - before) * 2_000_000, 5_000_000), 20_000_000) / 1e9
        output, memory, inside = aibs.step(law, vehicle, memory, inputs, dt)
        taken = [int(by_topic["reference"][given].step), step - later, -1, -1]
        record = {"dt": dt, "input_steps": np.array(taken), "replaced_inputs": int(len(found) == STALE)}
        found.append((step, output, inside, record))
        before, step = step, step + 5 + int(rng.choice([0, 0, 0, 1, 7, 20]))
    return found


def message_of(topic, step, values):
    """Return an output or internals of a law as a message; what it has no field for is left out."""
    fields = {name for name, _ in flight_samples.typestore().fielddefs[TYPES[topic]][1]}
    given = {name: np.array(value) if isinstance(value, tuple) else value for name, value in values.items()}
    given = {name: value for name, value in given.items() if name in fields}
    return flight_samples.message(TYPES[topic], stamp=flight_samples.stamp(step), step=step, **given)


@pytest.fixture(scope="module")
def answers(flown):
    return answered(flown, seed=3)


def bag(flown, answers, directory, without=None):
    others = []
    for topic, sample in flown.messages:
        if topic == "flight/parameters":
            text = sample.parameters.replace("flight.mode: lockstep", "flight.mode: realtime")
            said = flight_samples.message("quad_msgs/msg/NodeParameters", role=sample.role, parameters=text)
            others.append((f"/{topic}", said))
        elif topic in ("state", "reference", "actuation") and (topic, getattr(sample, "step", 0)) != without:
            others.append((f"/{topic}", sample))
    for step, output, inside, record in answers:
        others.append(
            ("/attitude_setpoint", message_of("attitude_setpoint", step, {"next_step": step + 5, **output._asdict()}))
        )
        others.append((f"/{ROLE}/internals", message_of(f"{ROLE}/internals", step, {**inside._asdict(), **record})))
    return open_flight(flight_samples.write_bag(directory, others, log_ns=lambda *_: 0))


def test_late_and_replaced_inputs_give_every_bit_again(flown, answers, tmp_path):
    assert len(answers) > STALE + 5
    found = replay(bag(flown, answers, tmp_path / "bag"), ROLE)
    assert found.notes == []
    assert found.equal
    assert found.steps.tolist() == [step for step, *_ in answers]


def test_an_input_that_was_not_recorded_is_said(flown, answers, tmp_path):
    lost = int(answers[-1][3]["input_steps"][1])
    found = replay(bag(flown, answers, tmp_path / "bag", without=("actuation", lost)), ROLE)
    assert len(found.notes) == 1
    assert "an input that the law had was not recorded" in found.notes[0]


def test_a_bag_that_does_not_say_which_inputs_the_steps_had_is_refused(flown, answers, tmp_path):
    silent = [(step, output, inside, {}) for step, output, inside, _ in answers]
    with pytest.raises(TopicError, match="does not say which inputs"):
        replay(bag(flown, silent, tmp_path / "bag"), ROLE)
