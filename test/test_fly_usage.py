"""`scripts/fly` before anything flies: its help, and every refusal by name with exit code 2."""

import os
import subprocess
from concurrent.futures import ThreadPoolExecutor

import pytest
from flying import FLY, ROOT

from quad_bringup import fly


def refused(capsys, *arguments):
    """Return the one line that says why ``arguments`` are refused."""
    try:
        code = fly.main(arguments)
    except SystemExit as leave:
        code = leave.code
    captured = capsys.readouterr()
    assert code == 2, captured
    assert len(captured.err.strip().splitlines()) == 1, captured.err
    assert captured.out == ""
    return captured.err


def test_help_shows_every_option_with_examples():
    done = subprocess.run([ROOT / "scripts/fly", "--help"], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    asked = "--plant --start --position --attitude --vehicle --seed --duration --realtime --out --set --preset --limits"
    for option in asked.split():
        assert option in done.stdout
    assert done.stdout.count("\n  scripts/fly") >= 5
    assert "Exit codes: 0" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["orbit"], ["orbit", "case1", "hover"]),
        (["hover", "--plant", "balloon"], ["balloon", "rigid_body"]),
        (["hover", "--position", "magic"], ["magic", "aibs"]),
        (["hover", "--attitude", "magic"], ["magic", "abfnitsm"]),
        (["case1", "--start", "jump"], ["case1.start", "jump", "approach"]),
        (["hover", "--preset", "wild"], ["wild", "minimal"]),
        (["hover", "--vehicle", "zeppelin"], ["zeppelin", "paper"]),
        (["hover", "--vehicle", "none.yaml"], ["none.yaml"]),
        (["hover", "--seed", "one"], ["--seed", "one"]),
        (["hover", "--seed", "-1"], ["flight.seed", "-1"]),
        (["hover", "--duration", "0"], ["hover.duration", "0.0"]),
        (["hover", "--duration", "nan"], ["hover.duration", "nan"]),
        (["hover", "--fast"], ["--fast"]),
        (["--step", "jump"], ["--step", "jump", "hop"]),
        (["--step", "full"], ["--step full", "found no mission"]),
        (["hover", "--domain", "233"], ["233", "0 to 232"]),
        (["hover", "--namespace", "a b"], ["--namespace", "a b"]),
        (["hover", "--namespace", "2uav"], ["--namespace", "2uav"]),
        (["hover", "--limits", "happiness=1"], ["happiness"]),
        (["hover", "--limits", "position_rmse=low"], ["position_rmse", "low"]),
        (["hover", "--set", "vehicle.mass"], ["vehicle.mass", "NODE.PARAM=VALUE"]),
        (["hover", "--set", "pilot.mood=good"], ["pilot", "simulator"]),
        (["hover", "--set", "vehicle.mass=heavy"], ["vehicle.mass", "heavy", "kg"]),
        (["hover", "--set", "vehicle.mass=inf"], ["vehicle.mass", "inf"]),
        (["hover", "--set", "vehicle.mas=1"], ["vehicle.mas", "did you mean vehicle.mass?"]),
        (
            ["hover", "--set", "position_controller.aibs.x.gain=2"],
            ["did you mean aibs.x.max_gain?", "known here: aibs.x.adaptation_dead_zone", "aibs.x.position_gain"],
        ),
        (["hover", "--set", "simulator.widow=40"], ["widow", "did you mean window?"]),
        (["hover", "--set", "simulater.window=40"], ["simulater", "did you mean simulator?"]),
        (["hover", "--set", "commander.nonsense=2"], ["commander.nonsense=2", "no part in this flight", "--mission"]),
        (["--mission", "takeoff,land", "--set", "commander.nonsense=2"], ["nonsense", "no such parameter"]),
        (["hover", "--set", "px4_bridge.mode=xx"], ["px4_bridge.mode=xx", "no part in this flight"]),
        (["hover", "--set", "odometry_relay.stamps=first"], ["odometry_relay", "--relay"]),
        (["hover", "--set", "recorder.finish_timeout=nan"], ["recorder", "finish_timeout", "nan"]),
        (["hover", "--set", "recorder.ack_steps=60"], ["ack_steps", "60", "window"]),
        (["hover", "--set", "trajectory.period_steps=2.5"], ["trajectory", "period_steps", "2.5"]),
        (["hover", "--set", "position_controller.aibs.x.position_gain=-3"], ["aibs.x.position_gain", "-3"]),
        (["hover", "--set", "flight.roles=simulator"], ["flight.roles", "recorder"]),
        (["hover", "--own", "pilot=python3"], ["pilot=python3"]),
        (["hover", "--own", "trajectory="], ["NODE=COMMAND"]),
        (["hover", "--own", "trajectory=python3 'own.py"], ["--own: trajectory", "No closing quotation"]),
        (["hover", "--own", "trajectory=no-such-program"], ["'no-such-program', neither on PATH nor a file"]),
        (["hover", "--own", f"trajectory={ROOT}/README.md"], ["README.md', a file that is not executable"]),
        (["hover", "--own", "trajectory=python3", "--one-process"], ["--one-process"]),
        (["--mission", "takeoff,case9,land"], ["mission: found 'case9' as item 2, expected one of takeoff[:height]"]),
        (["--mission", "case1,land"], ["mission: found item 1 'case1', expected takeoff first"]),
        (
            ["--mission", "takeoff,case1,case2"],
            ["mission: found case1, case2, expected one trajectory: a flight has one such node"],
        ),
        (["--mission", "takeoff", "--plant", "paper"], ["plant paper has no ground"]),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) and value[0] in ("hover", "case1", "orbit") else "",
)
def test_bad_usage_is_refused_by_name(capsys, tmp_path, monkeypatch, arguments, words):
    monkeypatch.chdir(tmp_path)
    line = refused(capsys, *arguments)
    assert all(word in line for word in words), line
    assert not list(tmp_path.iterdir()), "a refused flight leaves nothing behind"


def test_parameter_files_are_refused_by_name(capsys, tmp_path):
    path = tmp_path / "vehicle.yaml"
    path.write_text("/**:\n  ros__parameters: {vehicle: {mass: 0.6, wings: 2}}\n", encoding="utf-8")
    line = refused(capsys, "hover", "--vehicle", str(path), "--out", str(tmp_path / "bag"))
    assert "vehicle.wings" in line
    assert not (tmp_path / "bag").exists()


def test_a_wrong_value_is_refused_with_its_file_unless_the_command_line_gave_it(capsys, tmp_path):
    path = tmp_path / "vehicle.yaml"
    path.write_text("/**:\n  ros__parameters: {vehicle: {mass: -0.6}}\n", encoding="utf-8")
    assert f"{path}: vehicle.mass: found -0.6, expected" in refused(capsys, "hover", "--vehicle", str(path))
    path.write_text("/**:\n  ros__parameters: {vehicle: {mass: 0.6}}\n", encoding="utf-8")
    line = refused(capsys, "hover", "--vehicle", str(path), "--set", "vehicle.mass=-2.0")
    assert "vehicle.mass: found -2.0" in line
    assert str(path) not in line


def test_a_line_of_a_scenario_that_is_no_event_is_refused_with_its_file_and_line(capsys, tmp_path):
    path = tmp_path / "day.yaml"
    lines = [
        "disturbance: timeline",
        "timeline.events: |",
        "  wind velocity=1,0,0",
        "  gust start=1 velocity=1,0,0  # no end",
        "  freeze",
    ]
    path.write_text("/**/simulator:\n  ros__parameters:\n" + "".join(f"    {line}\n" for line in lines))
    assert f"{path}:6: events: 'gust start=1 velocity=1,0,0': a gust needs end=" in refused(
        capsys, "hover", "--scenario", str(path)
    )


def test_an_existing_directory_is_never_overwritten(capsys, tmp_path):
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag" / "precious.txt").write_text("here\n", encoding="utf-8")
    assert "precious" not in refused(capsys, "hover", "--out", str(tmp_path / "bag"))
    (tmp_path / "both" / "case2").mkdir(parents=True)
    (tmp_path / "both" / "case2" / "old.mcap").write_bytes(b"old")
    assert "case2" in refused(capsys, "--out", str(tmp_path / "both"))
    assert [path.name for path in (tmp_path / "both").iterdir()] == ["case2"]


def test_a_link_to_nothing_in_place_of_the_flights_is_named(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "flights").symlink_to("gone")
    assert "flights: found a link to nothing, expected a directory" in refused(capsys, "hover")


def test_a_trajectory_of_which_start_means_something_else_is_held_to_the_usual_limits(tmp_path, monkeypatch):
    options = fly._parser().parse_args(["hover"])
    fly._cases(options)
    usual = fly._planned(options, "hover", tmp_path).limits
    monkeypatch.setattr(fly, "summary", lambda _: {"start": 2.0})
    assert fly._planned(options, "hover", tmp_path).limits == usual != {}


def test_flights_that_start_together_get_numbers_of_their_own(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(lambda _: fly._numbered("case1-1", []), range(40)))
    assert {path.name for path in found} == {f"case1-1-{number}" for number in range(1, 41)}


@pytest.mark.parametrize(("settings", "words"), [
    ({"RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp"}, ["RMW_IMPLEMENTATION", "rmw_cyclonedds_cpp", "rmw_fastrtps_cpp"]),
    ({"RMW_IMPLEMENTATION": "none_cpp"}, ["RMW_IMPLEMENTATION", "none_cpp"]),
    ({"ROS_DISCOVERY_SERVER": "127.0.0.1:11811"}, ["ROS_DISCOVERY_SERVER=127.0.0.1:11811", "did not find each"]),
    ({"PYTHONPATH": "rclpy"}, ["PYTHONPATH", "rclpy in "]),
    ({"PYTHONPATH": "numpy"}, ["PYTHONPATH", "numpy in "]),
    ({"PYTHONPATH": "yaml"}, ["PYTHONPATH", "yaml in "]),
    ({"PYTHONPATH": "rcl_interfaces"}, ["PYTHONPATH", "rcl_interfaces in "]),
    ({"ROS_DOMAIN_ID": "three"}, ["ROS_DOMAIN_ID", "three"]),
])  # fmt: skip
def test_an_environment_that_lets_nothing_fly_is_named_in_one_line(settings, words, tmp_path):
    if "PYTHONPATH" in settings:  # the package of another workspace comes first
        package = tmp_path / "other" / settings["PYTHONPATH"]
        package.mkdir(parents=True)
        (package / "__init__.py").write_text("raise ImportError('of another Python')")
        settings = {"PYTHONPATH": f"{package.parent}:{os.environ['PYTHONPATH']}"}
    done = subprocess.run(
        [FLY, "hover", "--duration", "1"],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
        cwd=tmp_path,
        env={**os.environ, **settings},
    )
    assert done.returncode == 2, done.stderr
    assert len(done.stderr.splitlines()) == 1, done.stderr
    for word in words:
        assert word in done.stderr
