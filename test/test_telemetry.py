"""What an autopilot says over MAVLink becomes a bag in our frames, and nothing is ever said to it."""

import signal
import socket
import struct
import subprocess
import sys
import time

import numpy as np
import pytest
from flying import in_domain, stranger
from scipy.spatial.transform import Rotation
from sockets import free_port, udp_addresses
from vehicle_packages import vehicle_packages

from quad_flight_log.reader import open_flight
from quad_log_import.maps import read_recording
from quad_report.cli import main

TO_NED = Rotation.from_matrix([[0, 1, 0], [1, 0, 0], [0, 0, -1]])
TURN = Rotation.from_euler("X", np.pi)  # FRD to FLU and back
VEHICLE = "/**:\n  ros__parameters:\n    vehicle: {mass: 0.56, layout: x}\n"


@pytest.fixture(scope="module", autouse=True)
def _library():
    sys.path.append(str(vehicle_packages()))


def place(t):
    return np.array([np.sin(t), 0.5 * np.cos(2.0 * t), 2.0 + 0.2 * np.sin(3.0 * t)])


def flight(seconds=12.0, start=4290.0, system=1):
    """Return (s, packet) of a made-up flight, 100 Hz; without a set point from 5 to 7 s, in the air from 1 to 11 s."""
    from pymavlink.dialects.v20 import common

    mav, out = common.MAVLink(None, srcSystem=system, srcComponent=1), []
    for index in range(round(100 * seconds)):
        t = 0.01 * index
        ms, us = round(1e3 * (start + t)), round(1e6 * (start + t))
        here, ahead, before = ((place(t + s))[[1, 0, 2]] * [1, 1, -1] for s in (0.0, 1e-4, -1e-4))
        v = (ahead - before) / 2e-4
        x, y, z, w = (TO_NED * Rotation.from_euler("ZYX", [0.3, 0.1 * np.sin(t), 0.2]) * TURN).as_quat()
        asked = [np.nan] * 3 if 5.0 <= t < 7.0 else here
        landed = 2 if 1.0 <= t < 11.0 else 1
        messages = [
            common.MAVLink_attitude_quaternion_message(ms, w, x, y, z, 0.1, -0.2, 0.3),
            common.MAVLink_local_position_ned_message(ms, *here, *v),
            common.MAVLink_position_target_local_ned_message(ms, 1, 0, *asked, 9.0, 9.0, 9.0, 9.0, 9.0, 9.0, 0.2, 0.0),
            common.MAVLink_attitude_target_message(ms, 0, [w, x, y, z], 0.0, 0.0, 0.0, 0.5),
            common.MAVLink_servo_output_raw_message(us % 2**32, 0, *[1600 + 10 * n for n in range(4)], *[900] * 4),
        ]
        if index % 20 == 0:
            messages.insert(0, common.MAVLink_heartbeat_message(2, 12, 128, 3 << 16, 4, 3))
            messages.append(common.MAVLink_extended_sys_state_message(0, landed))
        out += [(t, message.pack(mav)) for message in messages]
    return out


def written(path, said):
    path.write_bytes(b"".join(struct.pack(">Q", 10**15 + round(1e6 * t)) + packet for t, packet in said))
    return path


def test_telemetry_becomes_a_recording_in_our_frames(tmp_path):
    said = flight()
    damaged = [(t, packet if index % 500 != 252 else b"\xfd\x09xx") for index, (t, packet) in enumerate(said)]
    others = [(t, packet) for t, packet in flight(1.0, system=7)]
    restarted = flight(0.5, start=0.0)
    recording, name = read_recording(written(tmp_path / "one.tlog", damaged + others + restarted))
    signals, notes = recording.signals, recording.notes
    assert (name, recording.rotors, recording.curve) == ("mavlink", "px4", 0.0)
    assert {"the autopilot started 2 times: its longest run is here", "at 1.0 s: took off"} <= set(notes)
    assert any(note.startswith("damaged at") for note in notes)
    t = signals["position"].t
    assert t[-1] == pytest.approx(11.99, abs=0.02)
    assert signals["position"].values == pytest.approx(place(t).T, abs=1e-3)
    speed = np.stack([np.cos(t), -np.sin(2.0 * t), 0.6 * np.cos(3.0 * t)], axis=1)
    assert signals["velocity"].values == pytest.approx(speed, abs=2e-3)
    assert signals["body_rates"].values[0] == pytest.approx([0.1, 0.2, -0.3])
    turned = Rotation.from_quat(signals["attitude"].values[0]).as_euler("ZYX")
    assert turned == pytest.approx([0.3, 0.0, 0.2], abs=1e-6)
    assert signals["motors"].values[0] == pytest.approx([0.6, 0.61, 0.62, 0.63])
    assert np.ptp(signals["motors"].t) > 11.9  # its clock of 32 bit began anew on the way
    assert signals["reference_yaw"].values[0] == pytest.approx([np.pi / 2 - 0.2])


def test_feed_forward_is_the_change_of_the_set_point_and_none_where_there_is_no_set_point(tmp_path):
    assert main(["import", str(written(tmp_path / "one.tlog", flight())), "--out", str(tmp_path / "bag")]) == 0
    bag = open_flight(tmp_path / "bag")
    reference = bag.array("reference")
    t = reference["stamp_ns"] * 1e-9
    assert not ((t > 5.0) & (t < 6.99)).any()
    inner = (t > 0.2) & (t < 11.8) & ~((t > 4.8) & (t < 7.2))
    t, reference = t[inner], reference[inner]
    speed = np.stack([np.cos(t), -np.sin(2.0 * t), 0.6 * np.cos(3.0 * t)], axis=1)
    gain = np.stack([-np.sin(t), -2.0 * np.cos(2.0 * t), -1.8 * np.sin(3.0 * t)], axis=1)
    assert reference["v_w"] == pytest.approx(speed, abs=0.01)
    assert reference["a_w"] == pytest.approx(gain, abs=0.05)
    assert {"at 1.0 s: took off", "at 11.0 s: landed"} <= set(bag.metadata.values())


@pytest.mark.parametrize("until", [signal.SIGINT, signal.SIGTERM])
def test_observing_records_and_sends_nothing(tmp_path, until):
    """Looks at the wire (packets that come to the autopilot) and at DDS (nodes, publishers, sockets of the process)."""
    (tmp_path / "vehicle.yaml").write_text(VEHICLE)
    port, domain = free_port(), 77
    command = [sys.executable, "-m", "quad_report.cli", "observe", "--listen", f"127.0.0.1:{port}"]
    command += ["--vehicle", str(tmp_path / "vehicle.yaml"), "--out", str(tmp_path / "bag")]
    environment = in_domain(domain) | {"PYTHONPATH": f"{vehicle_packages()}:{in_domain(domain)['PYTHONPATH']}"}
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as autopilot, stranger(domain) as onlooker:
        autopilot.bind(("127.0.0.1", 0))
        autopilot.setblocking(False)
        observer = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True)
        while ("127.0.0.1", port) not in udp_addresses(observer.pid):
            assert observer.poll() is None
            time.sleep(0.05)
        for index, (_, packet) in enumerate(flight(4.0)[1000:]):  # joins in flight
            autopilot.sendto(packet, ("127.0.0.1", port))
            if index % 100 == 99:
                time.sleep(0.02)
        sockets = udp_addresses(observer.pid)
        mine = onlooker.get_name()
        nodes = [name for name in onlooker.get_node_names() if not name.startswith("_")]
        topics = [
            name for name, _ in onlooker.get_topic_names_and_types() if onlooker.get_publishers_info_by_topic(name)
        ]
        observer.send_signal(until)
        said, _ = observer.communicate(timeout=120)
        with pytest.raises(BlockingIOError):
            autopilot.recvfrom(1)
    assert sockets == [("127.0.0.1", port)]
    assert nodes == [mine]
    assert {name for name in topics if not name.startswith(("/rosout", "/parameter_events"))} == set()
    assert observer.returncode in (0, 1), said
    assert "note at 0.0 s: in the air already" in said
    shadow = (tmp_path / "bag/shadow.txt").read_text()
    assert "are the autopilot's set points, and the attitude law has them" in shadow
    assert "memory begun anew every second" in shadow
    assert (tmp_path / "bag/report.html").is_file()
    assert len(open_flight(tmp_path / "bag").array("state")) > 100
