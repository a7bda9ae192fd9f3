"""Which settings a node of a flight chooses for the middleware, and what they contain."""

import os

import pytest
import rclpy

from quad_core.parameters import ParameterError
from quad_node import executor
from quad_node.middleware import CLOSED, OPEN, PROFILES, RANGE, SETTINGS, SKIP, TRANSPORTS, close, close_unless_asked

pytestmark = pytest.mark.unit

THEIRS = "FASTDDS_DEFAULT_PROFILES_FILE"
OURS = {PROFILES: SETTINGS, SKIP: "1"}


@pytest.mark.parametrize("chosen", [
    {},
    {TRANSPORTS: "SHM"},
    {RANGE: "LOCALHOST", TRANSPORTS: "SHM"},
    {RANGE: "OFF"},
    {"ROS_LOCALHOST_ONLY": "1"},
    {TRANSPORTS: "SHM", PROFILES: "/another/quad_node/fastdds.xml"},
])  # fmt: skip
def test_a_shell_that_asks_for_no_more_than_this_machine_gets_our_settings_alone(chosen):
    shell = dict(chosen)
    assert close_unless_asked(shell) == f"{CLOSED}: export ROS_DOMAIN_ID=0; unset {TRANSPORTS}"
    assert shell == OURS


@pytest.mark.parametrize("chosen", [
    {TRANSPORTS: "DEFAULT"},
    {TRANSPORTS: "UDPv4", RANGE: "LOCALHOST"},
    {RANGE: "SUBNET"},
    {"ROS_STATIC_PEERS": "10.0.0.2"},
    {"ROS_DISCOVERY_SERVER": "10.0.0.2:11811"},
    {PROFILES: "/home/fastdds.xml"},
    {THEIRS: "x.xml"},
    {"RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp"},
])  # fmt: skip
def test_a_choice_that_may_reach_other_hosts_stays_and_is_named(chosen):
    shell = {**OURS, **chosen}  # ours, of scripts/env.sh, gives way
    said = close_unless_asked(shell)
    assert said.startswith(OPEN)
    assert next(iter(chosen.values())) in said
    ours = OURS if {"RMW_IMPLEMENTATION", PROFILES} & set(chosen) else {}
    assert shell == {**ours, **chosen}


def test_visible_overrides_every_choice():
    shell = {TRANSPORTS: "UDPv4", RANGE: "SUBNET", PROFILES: "x.xml", THEIRS: "y.xml", "ROS_DOMAIN_ID": "57"}
    assert close(shell) == f"{CLOSED}: export ROS_DOMAIN_ID=57; unset {TRANSPORTS}"
    assert shell == {**OURS, "ROS_DOMAIN_ID": "57"}


def test_a_node_has_the_settings_before_rclpy_starts(monkeypatch):
    for name in (TRANSPORTS, RANGE, PROFILES):
        monkeypatch.setenv(name, "")
    found = []
    monkeypatch.setattr(rclpy, "init", lambda **_: found.append(os.environ[PROFILES]))
    executor.init([])
    assert found == [SETTINGS]


@pytest.mark.parametrize("domain", ["abc", "-1", "233"])
def test_a_domain_that_would_end_the_process_is_refused_by_name(domain):
    with pytest.raises(ParameterError, match=f"ROS_DOMAIN_ID: found {domain}, expected 0 to 232"):
        close_unless_asked({"ROS_DOMAIN_ID": domain})
