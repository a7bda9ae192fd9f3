"""What a flight finds around it: refused in one line if it could not fly, or would not fly alone."""

import subprocess
import sys
from contextlib import ExitStack
from types import SimpleNamespace

import pytest

from quad_bringup import surroundings
from quad_bringup.surroundings import reserved_domain
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


@pytest.fixture(autouse=True)
def no_wish(monkeypatch):
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)


def test_flights_that_do_not_ask_get_domains_of_their_own():
    with reserved_domain(None) as one, reserved_domain(None) as two, reserved_domain(None) as three:
        assert len({one, two, three}) == 3
        assert {one, two, three} <= set(range(1, 102))


def test_a_domain_may_be_shared_by_flights_that_ask_for_it():
    with reserved_domain(7) as one, reserved_domain(7) as two:
        assert one == two == 7


def test_the_environment_s_domain_is_taken_unless_another_is_asked_for(monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", "150")
    with reserved_domain(None) as first, reserved_domain(None) as second, reserved_domain(7) as third:
        assert (first, second, third) == (150, 150, 7)


def test_a_domain_is_free_again_after_the_flight(monkeypatch):
    monkeypatch.setattr(surroundings, "_candidates", lambda: [151])
    for _ in range(2):
        with pytest.raises(OSError, match="of the flight"), reserved_domain(None) as found:
            assert found == 151
            raise OSError("an error of the flight itself")


def test_a_machine_without_a_free_domain_is_refused(monkeypatch):
    monkeypatch.setattr(surroundings, "_candidates", lambda: [152] * 200)
    with ExitStack() as held:
        held.enter_context(reserved_domain(None))
        with pytest.raises(ParameterError, match="every domain reserved"):
            held.enter_context(reserved_domain(None))


def test_domains_with_ports_of_others_come_last(tmp_path, monkeypatch):
    table = tmp_path / "udp"
    ports = [7400 + 250 * domain + 11 for domain in range(1, 101)]
    lines = [f"  12: 0100007F:{port:04X} 00000000:0000 07" for port in ports]
    table.write_text("\n".join(["  sl  local_address rem_address   st", *lines]) + "\n")
    monkeypatch.setattr(surroundings, "_UDP_SOCKETS", table)
    assert surroundings._candidates()[0] == 101
