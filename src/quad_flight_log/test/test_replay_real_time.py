"""In real time a node takes what came last, late or replaced: the internals say what that was."""

from typing import get_type_hints

import flight_samples
import numpy as np
import pytest
from flight_samples import TYPES

from quad_core.types import Actuation, PositionInputs, TrajectoryPoint, VehicleState
from quad_core.vehicle import hold_position
from quad_flight_log.analysis.replay import replay
from quad_flight_log.bag.reader import open_flight
from quad_flight_log.errors import TopicError
from quad_position_ctrl import aibs

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
