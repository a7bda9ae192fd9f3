"""Bags that other tools recorded: topics missing, topics extra, types and encodings that we do not know."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import flight_samples
import numpy as np
import other_recorders
import pytest

from quad_analysis.flight_checks import judgement
from quad_analysis.tables import measured, measured_between
from quad_flight_log.errors import TopicError
from quad_flight_log.reader import open_flight
from quad_report import cli

RUN = 20
"""Where flight/state has its run: after the head, a stamp of 8 bytes and a step of 8."""


def recorded(directory: Path, messages, only=()) -> Path:
    """Write what ``ros2 bag record -s mcap`` would, ``only`` these topics."""
    every = [other_recorders.sent(topic, sample) for topic, sample in messages]
    return other_recorders.rosbag(directory, [one for one in every if not only or one.topic in only])


def extras():
    log = flight_samples.message("rcl_interfaces/msg/Log", name="someone", msg="hello")
    laser = flight_samples.message("sensor_msgs/msg/LaserScan", ranges=np.arange(5, dtype=np.float32))
    return [("/rosout", log), ("/scan", laser)]


def test_a_recording_with_extra_topics_gives_the_metrics_of_our_own(flown, flown_bag, tmp_path):
    theirs = open_flight(recorded(tmp_path / "bag", extras() + flown.messages))
    assert measured(theirs) == measured(open_flight(flown_bag))
    np.testing.assert_array_equal(theirs.array("scan")["ranges"][0], [0.0, 1.0, 2.0, 3.0, 4.0])
    assert theirs.array("rosout")["msg"].tolist() == ["hello"]
    assert theirs.metadata == {}


def test_missing_topics_give_what_is_left(flown, flown_bag, tmp_path, capsys):
    bag = recorded(tmp_path / "bag", flown.messages, only={"/truth", "/reference"})
    found, whole = measured(open_flight(bag)), measured(open_flight(flown_bag))
    assert found.position_rmse == whole.position_rmse
    assert found.torque_effort is None
    assert cli.main(["check", str(bag), "--limits", "torque_effort=100"]) == 1
    out = capsys.readouterr().out
    assert "torque_effort: found not available" in out
    assert "unknown bag.mcap: not recorded: actuation, flight/guard, flight/parameters" in out
    assert "FAIL" not in out
    assert cli.main(["metrics", str(bag)]) == 1
    assert cli.main(["info", str(bag)]) == 0
    with pytest.raises(TopicError, match=r"no topic 'state' in namespace /; the bag has /reference, /truth"):
        open_flight(bag).array("state")
    assert cli.main(["replay", str(bag)]) == 2


def merged(path, change):
    """Write a topic with two definitions: ours, and for its second half what ``change`` makes of it."""
    messages = other_recorders.poses()
    changed = [one._replace(text=change(one.text.decode()).encode()) for one in messages[10:]]
    assert changed[0].text != messages[0].text
    return other_recorders.in_one_file(path, [*messages[:10], *changed])


@pytest.mark.parametrize(
    "change",
    [
        lambda text: f"# other words\n{text}",
        lambda text: text.replace("Pose pose", "Pose pose  # where it is"),
        lambda text: text.replace("\n", "\n\n", 3),
    ],
    ids=["a comment before", "a comment after a field", "blank lines"],
)
def test_two_definitions_of_a_topic_that_agree_in_their_fields_are_read(change, tmp_path):
    flight = open_flight(merged(tmp_path / "merged.mcap", change))
    assert len(flight.array("pose")) == 20
    assert flight.unreadable == {}


def test_two_definitions_that_differ_in_a_field_are_named_and_the_rest_is_read(tmp_path, capsys):
    path = merged(tmp_path / "merged.mcap", lambda _: "float64 x\n")
    assert cli.main(["info", str(path)]) == 0
    capsys.readouterr()
    assert cli.main(["export", str(path), "--out", str(tmp_path)]) == 1
    assert "/pose: two definitions of one topic, whose fields differ" in capsys.readouterr().out


def test_an_export_writes_what_can_be_read_and_names_the_rest(tmp_path, capsys):
    path = other_recorders.encodings(tmp_path / "odd.mcap")
    assert cli.main(["export", str(path), "--out", str(tmp_path / "out")]) == 1
    out = capsys.readouterr().out
    for topic in ("/json", "/protobuf", "/idl", "/incomplete", "/short", "/undefined"):
        assert f"left out: {path}: {topic}: " in out
    assert [each.name for each in (tmp_path / "out").iterdir()] == ["pose.csv"]
    assert cli.main(["export", str(path), "--topic", "/pose", "--out", str(tmp_path / "alone")]) == 0


def test_names_that_differ_in_a_stroke_or_in_capitals_are_files_of_their_own(tmp_path, capsys):
    topics = ("/a/b/c", "/a_b/c", "/a_b_c", "/a/b_c", "/A/b/c", "/../x")
    path = other_recorders.named(tmp_path / "names.mcap", topics)
    assert cli.main(["export", str(path), "--out", str(tmp_path / "out")]) == 0
    files = capsys.readouterr().out.split()
    assert len(set(files)) == len(topics)
    assert all(Path(name).parent == tmp_path / "out" for name in files)
    assert all(len(Path(name).read_text().splitlines()) == 6 for name in files)


@pytest.mark.parametrize("command", [["hash"], ["metrics"], ["check", "--limits", "position_rmse=1"], ["report"]])
def test_a_bag_without_a_topic_of_a_flight_is_named(command, tmp_path, capsys):
    empty = other_recorders.named(tmp_path / "empty.mcap", ())
    poses = other_recorders.named(tmp_path / "poses.mcap", ("/pose",))
    for path in (empty, poses):
        assert cli.main([*command[:1], str(path), *command[1:]]) == 2
        assert "holds no topic of a flight in namespace /; --namespace names another" in capsys.readouterr().err


def vehicles(*namespaces):
    """Return a change that makes a flight one of several vehicles."""
    return lambda sent: [one._replace(topic=f"/{name}{one.topic}") for one in sent for name in namespaces]


@pytest.mark.parametrize("names", [("uav1", "uav2"), ("a/left", "a/right", "b")])
@pytest.mark.parametrize(
    "command", [["metrics"], ["hash"], ["check", "--limits", "position_rmse=9"], ["replay"], ["report"]]
)
def test_a_bag_of_several_vehicles_asks_for_a_namespace(command, names, flown_bag, tmp_path, capsys):
    path = other_recorders.recorded_again(flown_bag, tmp_path / "two.mcap", vehicles(*names))
    words = [command[0], str(path), *command[1:]]
    assert cli.main(words) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert f"of several vehicles: name a namespace: {', '.join(names)}" in line
    assert cli.main([*words, "--namespace", names[1]]) in (0, 1)


def test_a_vehicle_of_several_has_the_metrics_of_its_flight(flown_bag, tmp_path):
    path = other_recorders.recorded_again(flown_bag, tmp_path / "two.mcap", vehicles("uav1", "uav2"))
    assert measured(open_flight(path, namespace="uav2")) == measured(open_flight(flown_bag))
    assert open_flight(path).vehicles == ["/uav1", "/uav2"]


COMMANDS = [["check", "--limits", "position_rmse=100"], ["metrics"], ["hash"], ["replay"], ["report"]]


@pytest.mark.parametrize("form", ["ours", *other_recorders.FORMS])
def test_a_recording_that_stops_in_flight_is_never_good_and_a_whole_one_is_what_the_original_is(
    form, flown_bag, tmp_path, capsys
):
    sent, limits = other_recorders.received(flown_bag), {"position_rmse": 100.0}
    original = open_flight(flown_bag)
    whole, cut = flown_bag, tmp_path / "cut_0.mcap"
    if form == "ours":
        data = next(flown_bag.glob("*.mcap")).read_bytes()
        cut.write_bytes(data[: len(data) * 4 // 5])
    else:
        whole = other_recorders.FORMS[form](tmp_path / "whole", sent)
        cut = other_recorders.FORMS[form](tmp_path / "cut", sent[: len(sent) * 4 // 5])
    verdict = judgement(open_flight(whole), measured(open_flight(whole)), limits)
    assert verdict == judgement(original, measured(original), limits)
    assert verdict.verdict == "good"
    assert judgement(open_flight(cut), measured(open_flight(cut)), limits).verdict == "unknown"
    for command, *more in COMMANDS:
        found = cli.main([command, str(cut), *more])
        assert found == (2 if (form, command) == ("some topics", "replay") else 1), capsys.readouterr()
    assert 'class="verdict unknown"' in (open_flight(cut).path.parent / "report.html").read_text()


@pytest.mark.parametrize(("state", "verdict"), [(1, "unknown"), (2, "good"), (3, "failed")])
def test_how_a_flight_ended_is_what_its_last_state_says_whoever_recorded_it(state, verdict, flown_bag, tmp_path):
    sent = [one for one in other_recorders.received(flown_bag) if one.topic != "/flight/state"]
    step = int(open_flight(flown_bag).array("truth")["step"][-1])
    sent.insert(0, other_recorders.sent(*flight_samples.over(step, state, reason="it fell" * (state == 3))))
    flight = open_flight(other_recorders.in_one_file(tmp_path / "bag.mcap", sent))
    judged = judgement(flight, measured(flight), {})
    assert judged.verdict == verdict
    assert judged.problems[:1] == (("it fell",) if state == 3 else ())


def test_two_flights_in_one_bag_are_measured_and_replayed_by_nobody(flown_bag, tmp_path, capsys):
    """``ros2 bag record`` over two flights in one domain: each topic goes on with the second one."""
    sent = other_recorders.received(flown_bag)
    states = [one for one in sent if one.topic == "/flight/state"]
    runs = [
        one._replace(data=one.data[:RUN] + mark + one.data[RUN + 4 :]) for mark in (b"1111", b"2222") for one in states
    ]
    sent = [one for one in sent if one.topic != "/flight/state"]
    path = other_recorders.in_one_file(tmp_path / "two.mcap", [*sent, *runs])
    for command in ("metrics", "replay", "check", "hash", "report"):
        assert cli.main([command, str(path)]) == 1
        shown = capsys.readouterr().out + ((tmp_path / "report.html").read_text() if command == "report" else "")
        assert "messages of 2 runs: " in shown
        assert "steps that differ" not in shown


def test_log_times_that_rolled_over_change_nothing(flown_bag, tmp_path):
    sent = other_recorders.received(flown_bag)
    path = other_recorders.in_one_file(tmp_path / "bag.mcap", sent, {len(sent) // 2: 2**64 - 1})
    assert measured(open_flight(path)) == measured(open_flight(flown_bag))


def test_a_lockstep_flight_with_a_missing_step_is_refused_whoever_recorded_it(flown_bag, tmp_path, capsys):
    def without_one(sent):
        place = [place for place, one in enumerate(sent) if one.topic == "/truth"][100]
        return sent[:place] + sent[place + 1 :]

    lossy = other_recorders.recorded_again(flown_bag, tmp_path / "lossy.mcap", without_one)
    assert cli.main(["check", str(lossy), "--limits", "position_rmse=100"]) == 1
    assert "missing messages (truth: 1)" in capsys.readouterr().out


@pytest.mark.parametrize("share", [0.6, 0.8])
def test_a_recording_that_begins_in_flight_says_so(share, flown_bag, tmp_path, capsys):
    def late(sent):
        """Return what comes later, after the latched topics, which a recorder gets at once."""
        first = round(share * len(sent))
        return [one for one in sent[:first] if one.topic.startswith("/flight")] + sent[first:]

    path = other_recorders.recorded_again(flown_bag, tmp_path / "late.mcap", late)
    begin = open_flight(path).array("truth")["stamp_ns"].min() * 1e-9
    assert cli.main(["check", str(path), "--limits", "position_rmse=100"]) == 1
    assert f"the bag begins at {begin:.2f} s of the flight" in capsys.readouterr().out


@pytest.mark.parametrize("encoding", ["ascii", "latin-1"])
def test_a_terminal_that_lacks_letters_gets_what_it_has(encoding, flown_bag, tmp_path):
    bag = tmp_path / "Fl\u00fcge (1)" / "erster Flug \u2460"
    shutil.copytree(flown_bag, bag)
    next(bag.glob("*.mcap")).rename(bag / f"{bag.name}_0.mcap")
    environment = {**os.environ, "PYTHONIOENCODING": encoding, "LC_ALL": "C"}
    words = [sys.executable, "-m", "quad_report.cli", "info", str(bag)]
    done = subprocess.run(words, env=environment, capture_output=True, check=False, timeout=60)
    assert done.returncode == 0, done.stderr
    assert b"erster Flug" in done.stdout
    assert done.stderr == b""


def test_any_two_topics_with_positions_are_compared(tmp_path, capsys):
    def place(topic, time, x):
        header = {"stamp": flight_samples.time_of(round(1e9 * time)), "frame_id": "map"}
        return topic, flight_samples.message("geometry_msgs/msg/PointStamped", header=header, point={"x": x, "z": 1.0})

    flown = [place("vicon", 0.01 * step, 0.01 * step + 0.3) for step in range(101)]
    led = [place("wish", 0.25 * step, 0.25 * step) for step in range(5)]
    bag = recorded(tmp_path / "bag", [*flown, *led])
    found = measured_between(open_flight(bag), "/vicon", "/wish")
    assert (found.position_rmse, found.duration) == pytest.approx((0.3, 1.0))
    assert cli.main(["metrics", str(bag), "--state", "/vicon", "--reference", "/wish"]) == 1
    assert "0.3" in capsys.readouterr().out
    assert cli.main(["metrics", str(bag), "--state", "/vicon"]) == 2
    assert "expected both" in capsys.readouterr().err
