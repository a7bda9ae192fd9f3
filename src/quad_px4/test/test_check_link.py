"""What the relay of the link check passes on, and what it judges, without ROS."""

import struct
from types import SimpleNamespace
from unittest.mock import Mock

import pytest
import yaml

from quad_px4 import check_link
from quad_px4.check_link import LIMIT, Check, Relay, Row, _code, _limit, _parser, _stayed, _wanted, _words

NAN = float("nan")


def odometry(stamp, place):
    return b"\x00\x01\x00\x00" + struct.pack("<QQ", stamp, stamp - 5) + struct.pack("<f", place)


@pytest.fixture
def relay():
    made = Relay.__new__(Relay)
    made.cut, made._frozen, made._last = False, b"", b""
    made.passed = []
    made.publish = made.passed.append
    return made


def test_a_frozen_state_stands_still_under_fresh_stamps_until_it_is_healed(relay):
    relay._odometry(relay, odometry(1000, 1.0))
    relay.freeze()
    relay._odometry(relay, odometry(9000, 2.0))
    relay.heal()
    relay._odometry(relay, odometry(17000, 3.0))
    assert relay.passed == [odometry(1000, 1.0), odometry(9000, 1.0), odometry(17000, 3.0)]
    assert relay.now() == pytest.approx(0.017, abs=0.5)


def test_a_cut_link_passes_nothing(relay):
    relay.cut = True
    relay._pass(relay, b"one")
    relay._odometry(relay, odometry(1000, 1.0))
    relay.heal()
    relay._pass(relay, b"two")
    assert relay.passed == [b"two"]


@pytest.mark.parametrize(
    ("took", "into", "code"),
    [
        (0.2, "AUTO_LAND", 0),
        (0.3, "AUTO_LAND", 1),
        (NAN, "the same", 1),
        (NAN, "disarmed", 0),
        (NAN, "refused", 0),
        (NAN, "ARMED", 1),
        (NAN, "not armed", 2),
        (NAN, "ended before", 2),
        (NAN, "not heard", 2),
        (-0.1, "AUTO_LAND", 2),
    ],
)
def test_a_loss_that_lasts_too_long_and_a_limit_that_is_not_refused_are_bad(took, into, code, monkeypatch, capsys):
    row = Row("offboard", "link cut", took, into, NAN, "")
    assert _code(row, 0.25) == code
    for name in ("rclpy.init", "Relay", "Check.lose"):
        monkeypatch.setattr(f"quad_px4.check_link.{name}", Mock(return_value=row))
    monkeypatch.setenv("ROS_DOMAIN_ID", "0")
    options = _parser().parse_args(["air.yaml"])
    options.bridge = {}
    assert check_link._fly(options, Mock(), "offboard", "link cut") == code
    assert into in capsys.readouterr().out


@pytest.mark.parametrize(
    ("mode", "own", "watches", "limit"),
    [
        ("offboard", {}, False, 0.25),
        ("offboard", {"loss_limit": 0.5}, False, 0.5),
        ("offboard", {"loss_limit": 1}, True, 1.0),
        ("offboard", {"loss_limit": 0.0}, False, 0.25),
        ("external", {"loss_limit": 0.5}, False, 1.5),
        ("external", {"loss_limit": 0.25}, True, 0.4),
        ("external", {}, True, 0.4),
        ("external", {"loss_limit": 0.0}, True, 1.5),
    ],
)
def test_the_limit_is_that_of_the_bridge_or_four_arming_checks(mode, own, watches, limit):
    assert _limit(mode, own, watches) == pytest.approx(limit)


def status(armed, timestamp=12_000_000):
    return SimpleNamespace(arming_state=2 if armed else 1, timestamp=timestamp)


@pytest.mark.parametrize(
    ("first", "last", "into"),
    [
        (status(True), status(True), "the same"),
        (status(True), status(False), "the same"),
        (status(False), status(False), "disarmed"),
        (None, None, "not heard"),
        (status(True, 9_900_000), status(True, 9_900_000), "not heard"),
    ],
)
def test_a_vehicle_that_is_first_heard_disarmed_has_ended_its_loss_and_one_that_is_disarmed_later_has_not(
    first, last, into
):
    assert _stayed(first, last, began=10.0) == into


@pytest.mark.parametrize(
    ("own", "mode", "watches", "killed"),
    [
        ({"mode": "wrench"}, "offboard", False, "attitude_controller"),
        ({}, "offboard", False, "attitude_controller"),
        ({"mode": "attitude"}, "offboard", False, "position_controller"),
        ({"mode": "wrench"}, "external", False, "position_controller"),
        ({"mode": "wrench"}, "external", True, "attitude_controller"),
    ],
)
def test_the_controller_that_is_killed_is_the_one_that_flies(own, mode, watches, killed, monkeypatch):
    options = _parser().parse_args(["air.yaml"])
    options.bridge = own
    check, asked = Check(options, None, watches), []
    monkeypatch.setattr(check, "_processes", lambda fly, name: asked.append(name) or [1])
    check._loss(None, mode, "controller killed")
    assert asked == [killed]


@pytest.mark.parametrize(
    ("mode", "asked", "why"),
    [
        ("offboard", {"mode": "wrench", "external_mode": "", "loss_limit": 0.01}, "hover: arming refused: PX4 noticed"),
        ("external", {"mode": "wrench", "external_mode": "Link check"}, "px4_bridge: external_mode: found"),
    ],
)
def test_what_the_bridge_must_refuse_is_asked_of_it(mode, asked, why, monkeypatch, tmp_path):
    root = tmp_path / "root"
    (root / "scripts").mkdir(parents=True)
    (root / "scripts/fly").write_text(f"#!/bin/sh\necho 'fly: {why}'\n")
    (root / "scripts/fly").chmod(0o755)
    options = _parser().parse_args(["air.yaml", "--out", str(tmp_path / "out")])
    options.bridge, options.root = {"mode": "wrench"}, root
    row = Check(options, Mock(is_ours=False), False).refuse(mode)
    (given,) = yaml.safe_load((tmp_path / f"out/{mode}-refused/airframe.yaml").read_text()).values()
    assert asked.items() <= given["ros__parameters"].items()
    assert (row.into, row.said) == ("refused", why)


def test_what_fly_said_is_its_verdict_not_what_nodes_logged(tmp_path):
    (tmp_path / "fly.txt").write_text(
        "fly: to look on from another shell: source env.sh\nhover: 0.0 s\nfly: simulator: [WARN] loud\n"
        "fly: hover: px4_bridge was killed by SIGKILL\nfly: hover: recorder stopped\nhover: failed\n"
    )
    assert _words(tmp_path / "fly.txt") == "hover: px4_bridge was killed by SIGKILL"


def test_each_loss_is_flown_in_its_mode_and_the_limit_once():
    options = _parser().parse_args(
        ["air.yaml", "--only", "link cut", "--only", "agent killed", "--only", LIMIT, "--times", "2"]
    )
    options.bridge = {}
    cut, limit = [("link cut", 1), ("link cut", 2)], [(LIMIT, 1)]
    assert _wanted(options, False) == [(mode, *each) for mode in ("offboard", "external") for each in cut + limit]
    assert len(_wanted(options, True)) == 5, "PX4 itself watches the setpoints of an external mode"


def test_by_attitude_no_limit_is_asked_of_offboard_for_none_is_refused():
    options = _parser().parse_args(["air.yaml", "--only", LIMIT])
    options.bridge = {"mode": "attitude"}
    assert _wanted(options, False) == [("external", LIMIT, 1)]


@pytest.mark.parametrize(("codes", "found", "flown"), [([0], 0, 1), ([1], 1, 1), ([2, 0], 0, 2), ([-9, -9], 2, 2)])
def test_a_flight_that_measured_nothing_or_hung_is_flown_once_more(codes, found, flown, monkeypatch, capsys, tmp_path):
    left, outs = list(codes), []

    class Process:
        def __init__(self, words, **_):
            self.returncode = left.pop(0)
            outs.append(words[-1])

        def communicate(self, timeout=None):
            if self.returncode < 0 and timeout:
                raise check_link.subprocess.TimeoutExpired("check_link", timeout)
            return f"mode\n{self.returncode}\n", None

        def kill(self):
            pass

    monkeypatch.setattr(check_link.subprocess, "Popen", Process)
    options = _parser().parse_args(["air.yaml", "--out", str(tmp_path)])
    assert check_link._fly_apart(options, "offboard", "link cut", 3) == found
    assert outs == [str(tmp_path / "3"), str(tmp_path / "3-again")][:flown]
    assert capsys.readouterr().out == ("offboard  link cut           hung\n" if codes[-1] < 0 else f"{codes[-1]}\n")


@pytest.mark.parametrize(
    "error", [OSError("no such agent"), check_link.subprocess.CalledProcessError(1, "false"), FileExistsError("out")]
)
def test_what_keeps_a_flight_from_beginning_is_one_line_and_nothing_measured(error, monkeypatch, capsys):
    monkeypatch.setattr(check_link.rclpy, "init", lambda **_: None)
    monkeypatch.setattr(check_link, "Relay", Mock())
    monkeypatch.setattr(Check, "lose", Mock(side_effect=error))
    options = _parser().parse_args(["air.yaml"])
    options.bridge = {}
    monkeypatch.setenv("ROS_DOMAIN_ID", "0")
    assert check_link._fly(options, Mock(), "offboard", "link cut") == 2
    monkeypatch.setattr(Check, "_agent", Mock(side_effect=error))
    assert check_link._fly(options, Mock(), "offboard", "link cut") == 2
    assert capsys.readouterr().err == f"check_link: {error}\n" * 2


def test_files_are_those_of_the_folder_in_which_the_command_is_given(monkeypatch, tmp_path, capsys):
    (tmp_path / "mine.yaml").write_text("/**/simulator: {ros__parameters: {}}\n")
    flown = Mock(return_value=0)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("QUAD_ROOT", "/elsewhere")
    monkeypatch.setattr(check_link.messages, "load", Mock)
    monkeypatch.setattr(check_link, "_fly_apart", flown)
    assert check_link.main(["mine.yaml", "--vehicle", "mine.yaml", "--preset", "x500"]) == 0
    options = flown.call_args.args[0]
    assert (options.vehicle, options.preset) == (str(tmp_path / "mine.yaml"), "x500")
