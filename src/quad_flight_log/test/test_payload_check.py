"""What enters a bag can be decoded by others: held against rosbags, which shares no code with us."""

import struct
import time

import flight_samples
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rosbags.serde.errors import SerdeError

from quad_flight_log.payload_check import message_class, payload_check

RNG = np.random.default_rng(3)
SAMPLES = {
    "state": flight_samples.state(7, RNG),
    "wrench": flight_samples.wrench(7, RNG),
    "internals": flight_samples.internals(7, RNG),
    "nothing extra": flight_samples.message("quad_msgs/msg/AttitudeInternals"),
    "no messages": flight_samples.message("sensor_msgs/msg/JointState", name=["a"]),
    "event": flight_samples.event(7, "größer"),
    "parameters": flight_samples.message(
        "quad_msgs/msg/NodeParameters", node="/a", parameters="a: 1", internals_names=["x", "yy", ""]
    ),
    "diagnostics": flight_samples.message(
        "diagnostic_msgs/msg/DiagnosticArray",
        status=[
            flight_samples.message(
                "diagnostic_msgs/msg/DiagnosticStatus",
                name="a",
                values=[flight_samples.message("diagnostic_msgs/msg/KeyValue", key="k", value="v")] * 3,
            )
        ],
    ),
    "odometry": flight_samples.message("nav_msgs/msg/Odometry", child_frame_id="base_link"),
}


def check_of(sample):
    return payload_check(message_class(sample.__msgtype__.replace("/msg/", "/")))


def by_rosbags(sample, payload):
    """Return whether rosbags decodes ``payload``."""
    try:
        flight_samples.typestore().deserialize_cdr(payload, sample.__msgtype__)
    except (AssertionError, SerdeError, ValueError, IndexError, struct.error):
        return False
    return True


@pytest.mark.parametrize("name", SAMPLES)
def test_a_message_cut_anywhere_is_refused(name):
    check, payload = check_of(SAMPLES[name]), flight_samples.encoded(SAMPLES[name])
    whole = next(size for size in range(len(payload) + 1) if by_rosbags(SAMPLES[name], payload[:size]))
    assert all(check(payload[:size]) for size in range(whole))
    assert check(payload) == ""


@pytest.mark.parametrize("name", SAMPLES)
def test_big_endian_is_refused_and_said(name):
    check, sample = check_of(SAMPLES[name]), SAMPLES[name]
    check(flight_samples.encoded(sample))
    swapped = bytes(flight_samples.typestore().serialize_cdr(sample, sample.__msgtype__, little_endian=False))
    assert "found 0000, expected 0001" in check(swapped)


def test_what_is_wrong_is_named():
    sample = SAMPLES["event"]
    check, payload = check_of(sample), flight_samples.encoded(sample)
    assert "quad_msgs/msg/FlightEvent" in check(payload[:-20])
    assert check(payload.replace(b"\xc3\xb6", b"\xff\xff")).startswith("text: 'utf-8' codec can't decode byte 0xff")
    assert "bytes behind" in check(payload + bytes(8))
    assert "zero byte" in check(payload.replace(b"/test\0", b"/test!"))


def test_a_message_of_a_million_little_ones_is_refused_at_once():
    sample = SAMPLES["parameters"]
    payload = flight_samples.encoded(sample)
    names = payload.rindex(struct.pack("<I", 3), 0, payload.index(b"x\0"))
    many = payload[:names] + struct.pack("<I", 200_000) + struct.pack("<I4s", 1, b"\0\0\0\0") * 200_000
    assert "more than 10000 items" in check_of(sample)(many)


def test_a_short_message_that_claims_thousands_of_texts_costs_no_time():
    sample = SAMPLES["parameters"]
    check, payload = check_of(sample), flight_samples.encoded(sample)
    names = payload.rindex(struct.pack("<I", 3), 0, payload.index(b"x\0"))
    short = payload[:names] + struct.pack("<I", 10_000)
    check(short)
    began = time.process_time()
    assert all("internals_names: it ends early" in check(short) for _ in range(100))
    assert time.process_time() - began < 0.1


@settings(max_examples=400, deadline=None)
@given(data=st.data())
def test_what_passes_is_decoded_by_rosbags(data):
    name = data.draw(st.sampled_from(sorted(SAMPLES)))
    sample = SAMPLES[name]
    payload = bytearray(flight_samples.encoded(sample))
    check = check_of(sample)
    check(bytes(payload))
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(payload) - 1))
        payload[at] = data.draw(st.integers(0, 255))
    cut = bytes(payload[: data.draw(st.integers(0, len(payload)))]) if data.draw(st.booleans()) else bytes(payload)
    if check(cut) == "":
        assert by_rosbags(sample, cut)
