"""Equal flights have equal hashes, whatever the recorder did around them; one other bit has another."""

import copy
import dataclasses
import hashlib

import flight_samples
import numpy as np
import pytest

from quad_flight_log.errors import CorruptError
from quad_flight_log.payload_hash import payload_hash, topic_hashes
from quad_flight_log.reader import open_flight


@pytest.fixture(scope="module")
def flown():
    return [(topic, sample) for topic, sample in flight_samples.samples(20) if topic != "/flight/events"]


def hashed(directory, flown, **options):
    return payload_hash(open_flight(flight_samples.write_bag(directory, flown, **options)))


@pytest.fixture(scope="module")
def reference(flown, tmp_path_factory):
    return hashed(tmp_path_factory.mktemp("hash") / "bag", flown)


def test_a_topic_hash_is_sha_256_over_the_payloads_in_step_order(flown, tmp_path):
    flight = open_flight(flight_samples.write_bag(tmp_path / "bag", flown))
    payloads = [flight_samples.encoded(sample) for topic, sample in flown if topic == "/state"]
    assert topic_hashes(flight)["state"] == hashlib.sha256(b"".join(payloads)).hexdigest()


def test_order_of_arrival_repeats_and_times_of_recording_do_not_count(flown, reference, tmp_path):
    shuffled = [flown[i] for i in np.random.default_rng(1).permutation(len(flown))]
    assert hashed(tmp_path / "a", shuffled) == reference
    assert hashed(tmp_path / "b", [*flown, *flown[5:20]]) == reference
    assert hashed(tmp_path / "c", flown, log_ns=lambda index, _: index * 77 + 3) == reference


def test_the_number_of_the_run_does_not_count_and_nothing_beside_it(flown, reference, tmp_path):
    def changed(**values):
        return [(topic, dataclasses.replace(one, **values) if topic == "/state" else one) for topic, one in flown]

    assert hashed(tmp_path / "run", changed(run=7)) == reference
    assert hashed(tmp_path / "step", changed(step=7)) != reference
    assert hashed(tmp_path / "place", changed(p_w=np.zeros(3))) != reference


def test_other_topics_and_other_namespaces_do_not_count(flown, reference, tmp_path):
    assert hashed(tmp_path / "a", [*flown, ("/flight/events", flight_samples.event(1, "text"))]) == reference
    assert hashed(tmp_path / "b", [(f"/second{topic}", sample) for topic, sample in flown]) == reference
    shadow = [(f"/shadow{topic}", sample) for topic, sample in flown if topic != "/state"]
    assert hashed(tmp_path / "c", flown + shadow) == reference
    second = [(f"/second{topic}", sample) for topic, sample in flown + shadow]
    assert hashed(tmp_path / "d", second) == reference


def test_one_bit_or_one_missing_step_counts(flown, reference, tmp_path):
    index = next(at for at, (topic, _) in enumerate(flown) if topic == "/wrench_setpoint")
    other = copy.deepcopy(flown[index][1])
    other.wrench.force.z = float(np.nextafter(other.wrench.force.z, 10.0))
    changed = list(flown)
    changed[index] = ("/wrench_setpoint", other)
    assert hashed(tmp_path / "a", changed) != reference
    assert hashed(tmp_path / "b", flown[:index] + flown[index + 1 :]) != reference
    with pytest.raises(CorruptError, match="wrench_setpoint"):
        hashed(tmp_path / "c", [*flown, changed[index]])
