"""What a flight finds around it: refused in one line if it could not fly, or would not fly alone."""

import subprocess
import sys
from types import SimpleNamespace

import pytest

from quad_bringup import surroundings
from quad_core.parameters import ParameterError
from quad_node.topics import TOPICS


@pytest.fixture
def clean(tmp_path, monkeypatch):
    fast_dds = ("FASTDDS_BUILTIN_TRANSPORTS", "FASTRTPS_DEFAULT_PROFILES_FILE")
    for name in (*fast_dds, "ROS_AUTOMATIC_DISCOVERY_RANGE", "QUAD_ROOT"):
        monkeypatch.setenv(name, "")
        monkeypatch.delenv(name)
    return tmp_path


def test_a_full_disk_is_refused_and_known(clean, monkeypatch):
    surroundings.check_disk(clean)
    assert not surroundings.is_full(clean)
    assert not surroundings.is_full(clean / "nowhere")
    monkeypatch.setattr(surroundings.shutil, "disk_usage", lambda _: SimpleNamespace(free=20_000))
    with pytest.raises(ParameterError, match=r"found 0\.0 MB free, expected at least 8 MB"):
        surroundings.check_disk(clean)
    assert surroundings.is_full(clean)
    monkeypatch.setattr(surroundings.shutil, "disk_usage", lambda _: SimpleNamespace(free=900_000_000))
    surroundings.check_disk(clean)
    with pytest.raises(ParameterError, match="expected at least 1000 MB"):
        surroundings.check_disk(clean, surroundings.MISSION_DISK)


def test_a_machine_without_a_loopback_interface_is_refused():
    """In a network namespace of its own, whose lo is down until somebody sets it up."""
    surroundings.check_loopback()
    code = "from quad_bringup.surroundings import check_loopback; check_loopback()"
    done = subprocess.run(
        ["unshare", "-rn", sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False
    )
    if "unshare" in done.stderr:
        pytest.skip("no namespace may be made here")
    assert "127.0.0.1 cannot be used (" in done.stderr
    assert "ip link set lo up" in done.stderr


def test_what_keeps_ros_from_starting_is_named(clean, monkeypatch):
    monkeypatch.setenv("ROS_SECURITY_ENABLE", "true")
    monkeypatch.setenv("ROS_STATIC_PEERS", "10.0.0.2")
    said = str(surroundings.refusal_of_ros(47, RuntimeError("failed to initialize rcl:\n error not set")))
    for part in ("domain 47: failed to initialize rcl: error not set", "ROS_SECURITY_ENABLE=true", "ROS_STATIC_PEERS="):
        assert part in said


def test_the_line_that_lets_another_shell_look_on(clean, monkeypatch):
    assert how_to_look_on() == "unset FASTDDS_BUILTIN_TRANSPORTS ROS_AUTOMATIC_DISCOVERY_RANGE; export ROS_DOMAIN_ID=57"
    monkeypatch.setenv("QUAD_ROOT", "/here it is")
    assert how_to_look_on() == "source '/here it is/scripts/env.sh'; export ROS_DOMAIN_ID=57"
    monkeypatch.setenv("FASTDDS_BUILTIN_TRANSPORTS", "UDPv4")
    expected = "unset ROS_AUTOMATIC_DISCOVERY_RANGE; export ROS_DOMAIN_ID=57 FASTDDS_BUILTIN_TRANSPORTS=UDPv4"
    assert how_to_look_on() == expected


def how_to_look_on():
    start, _, command = surroundings.how_to_look_on(57).partition(": ")
    assert start == "to look on from another shell"
    return command


def test_whoever_publishes_our_topics_is_named(clean, monkeypatch):
    found = {"/uav1/simulator": ["state", "actuation"]}
    monkeypatch.setattr(surroundings, "occupied", lambda: {57})
    monkeypatch.setattr(surroundings, "publishers", lambda domain, namespace: found if namespace == "uav1" else {})
    with pytest.raises(ParameterError, match=r"domain 57 is not empty: /uav1/simulator publishes state and 1 more"):
        surroundings.check_domain(57, "uav1")
    surroundings.check_domain(57, "uav2")


@pytest.mark.ros
def test_what_others_may_publish_before_a_flight_is_left_out():
    with surroundings._probe(88) as driver:
        for topic in ("battery_state", "flight/request", "clock", "state"):
            entry = TOPICS[topic]
            driver.create_publisher(entry.type, topic, entry.qos())
        found = surroundings.publishers(88, "", 10.0)
    assert list(found.values()) == [["state"]]


def test_a_closed_flight_does_not_search_a_domain_without_ports(clean, monkeypatch):
    searched = []
    monkeypatch.setattr(surroundings, "occupied", lambda: {57})
    monkeypatch.setattr(surroundings, "publishers", lambda domain, _: searched.append(domain))
    surroundings.check_domain(57, "")
    surroundings.check_domain(58, "")
    assert searched == [57]
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET")
    surroundings.check_domain(58, "")
    assert searched == [57, 58]
