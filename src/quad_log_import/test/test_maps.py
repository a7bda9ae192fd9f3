"""Logs of others become bags: each format, each damage, each doubt."""

import gzip
import io
import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from quad_flight_log.errors import FlightLogError
from quad_flight_log.reader import open_flight
from quad_log_import.doubts import doubts, unchecked
from quad_log_import.maps import Recording, Series, load_map, mapped, read_recording
from quad_log_import.tables import read_tables
from quad_report.cli import main

DATA = Path(__file__).parent / "data"
FILES = sorted(DATA.glob("*.gz"))
MAP = """
rotors: px4
time: {column: t}
signals:
  specific_force: {columns: [ax, ay, az], unit: g, frame: frd}
  body_rates: {columns: [gx, gy, gz], unit: deg, frame: frd}
  attitude: {columns: [qw, qx, qy, qz], order: wxyz, frame: frd-ned}
  position: {columns: [n, e, d], frame: ned}
  velocity: {columns: [vn, ve, vd], frame: ned}
  motors: {columns: [m1, m2, m3, m4], unit: pwm_us}
  reference_position: {columns: [rn, re, rd], frame: ned}
"""


def table_of_a_flight(seconds=12.0):
    """Return columns of a made-up flight in NED, FRD, g, degrees and microseconds of PWM, and what it is in ours."""
    t = np.arange(0.0, seconds, 0.01)
    p = np.stack([np.sin(t), 0.5 * np.cos(2.0 * t), 1.0 + 0.2 * np.sin(3.0 * t)], axis=1)
    v = np.stack([np.cos(t), -np.sin(2.0 * t), 0.6 * np.cos(3.0 * t)], axis=1)
    a = np.stack([-np.sin(t), -2.0 * np.cos(2.0 * t), -1.8 * np.sin(3.0 * t)], axis=1)
    q = Rotation.from_euler("ZYX", np.stack([0.8 * np.sin(t), 0.3 * np.sin(2 * t), 0.2 * np.cos(3 * t)], axis=1))
    w = np.gradient(np.unwrap(q.as_rotvec(), axis=0), t, axis=0)
    step = (q[:-1].inv() * q[1:]).as_rotvec() / 0.01
    w = np.vstack([step, step[-1:]])
    force = q.apply(a + np.array([0.0, 0.0, 9.81]), inverse=True)
    ned = Rotation.from_matrix([[0, 1, 0], [1, 0, 0], [0, 0, -1]]) * q * Rotation.from_euler("X", np.pi)
    flip, out = np.array([1.0, -1.0, -1.0]), {"t": t}
    x, y, z, scalar = ned.as_quat().T
    groups = {
        ("ax", "ay", "az"): force * flip / 9.80665,
        ("gx", "gy", "gz"): np.degrees(w * flip),
        ("qw", "qx", "qy", "qz"): np.stack([scalar, x, y, z], axis=1),
        ("n", "e", "d"): p[:, [1, 0, 2]] * [1, 1, -1],
        ("vn", "ve", "vd"): v[:, [1, 0, 2]] * [1, 1, -1],
        ("m1", "m2", "m3", "m4"): 1500.0 + 100.0 * np.sin(np.outer(t, [1.0, 2.0, 3.0, 4.0])),
        ("rn", "re", "rd"): p[:, [1, 0, 2]] * [1, 1, -1],
    }
    for names, values in groups.items():
        out |= dict(zip(names, values.T, strict=True))
    return out, {"position": p, "velocity": v, "specific_force": force, "body_rates": w, "attitude": q.as_quat()}


@pytest.fixture
def csv(tmp_path):
    columns, truth = table_of_a_flight()
    path = tmp_path / "lap.csv"
    np.savetxt(path, np.stack(list(columns.values()), axis=1), delimiter=",", header=",".join(columns), comments="")
    (tmp_path / "map.yaml").write_text(MAP)
    return path, tmp_path / "map.yaml", truth


def test_units_and_frames_of_a_map_become_ours(csv):
    path, chart, truth = csv
    recording, _ = read_recording(path, str(chart))
    for name, expected in truth.items():
        found = recording.signals[name].values
        if name == "attitude":
            found = found * np.sign((found * expected).sum(axis=1))[:, None]
        assert found == pytest.approx(expected, abs=1e-6), name
    assert 0.39 < recording.signals["motors"].values.min() < recording.signals["motors"].values.max() < 0.61
    assert doubts(recording) == []


def test_an_imported_bag_holds_each_sample_and_the_commands_of_log_take_it(csv, tmp_path, capsys):
    path, chart, truth = csv
    bag = tmp_path / "bag"
    assert main(["import", str(path), "--map", str(chart), "--out", str(bag)]) == 0
    flight = open_flight(bag)
    assert len(flight.array("imu")) == len(truth["position"])
    assert flight.array("state")["p_w"] == pytest.approx(truth["position"], abs=1e-6)
    assert flight.metadata["imported_from"] == "lap.csv"
    for command in (["info"], ["export", "--out", str(tmp_path / "csv")]):
        assert main([command[0], str(bag), *command[1:]]) == 0, capsys.readouterr().err
    for command in ("metrics", "check", "report"):  # with what they have, and never green: no flight of ours
        assert main([command, str(bag)]) == 1, capsys.readouterr().err
    assert "position_rmse" in capsys.readouterr().out


def test_a_log_of_poses_alone_has_a_state_whose_velocity_and_rates_are_their_change(csv, tmp_path, capsys):
    path, chart, truth = csv
    content = yaml.safe_load(chart.read_text(encoding="utf-8"))
    content["signals"] = {name: content["signals"][name] for name in ("position", "attitude")}
    chart.write_text(yaml.safe_dump(content), encoding="utf-8")
    bag = tmp_path / "bag"
    assert main(["import", str(path), "--map", str(chart), "--out", str(bag)]) == 0
    assert (
        "state: velocity is the change of position and body_rates is the change of attitude" in capsys.readouterr().out
    )
    state = open_flight(bag).array("state")
    assert len(state) > len(truth["position"]) - 14  # all but the ends, where a change has no two sides
    rows = np.rint(state["stamp_ns"] / 1e7).astype(int)
    for name, expected in (("v_w", truth["velocity"]), ("omega_b", truth["body_rates"])):
        off = np.linalg.norm(state[name] - expected[rows], axis=1)
        assert off.max() < 0.05 * np.linalg.norm(expected, axis=1).max(), name


@pytest.mark.parametrize(
    ("change", "doubt"),
    [
        (lambda s: s | {"specific_force": turned(s["specific_force"], [1, -1, -1])}, "expected .9.8 along body z"),
        (lambda s: s | {"specific_force": turned(s["specific_force"], 0.102)}, "in g"),
        (
            lambda s: s | {"body_rates": turned(s["body_rates"], 57.3)},
            "57.* times the change of attitude.*degrees for radians",
        ),
        (lambda s: s | {"body_rates": turned(s["body_rates"], [1, -1, -1])}, "body_rates: correlation"),
        (lambda s: s | {"velocity": turned(s["velocity"], 3.6)}, "3.6 times the change of position.*km/h"),
        (lambda s: s | {"velocity": s["velocity"]._replace(t=s["velocity"].t + 1.5)}, "velocity: correlation"),
        (lambda s: s | {"motors": turned(s["motors"], 1000.0)}, "expected commands in 0..1"),
        (
            lambda s: (
                s | {"motors": s["motors"]._replace(t=np.where(s["motors"].t > 5, s["motors"].t + 9, s["motors"].t))}
            ),
            "a gap of 9",
        ),
    ],
    ids=["upside down", "g", "degrees", "frd", "km/h", "clock", "pwm", "gap"],
)
def test_a_doubt_is_named_with_its_number(csv, change, doubt):
    path, chart, _ = csv
    recording, _ = read_recording(path, str(chart))
    found = doubts(recording._replace(signals=change(recording.signals)))
    assert len([line for line in found if re.search(doubt, line)]) == 1, found


def test_a_flight_below_its_beginning_and_end_is_doubted(csv):
    path, chart, _ = csv
    recording, _ = read_recording(path, str(chart))
    t = np.arange(0.0, 20.0, 0.01)
    up = np.column_stack([t, 0.0 * t, np.clip(np.minimum(t, 20.0 - t) - 2.0, 0.0, 1.5)])
    for sign, expected in ((1.0, []), (-1.0, ["position: 77 % of the time below where the flight begins and ends"])):
        flown = recording._replace(signals={"position": Series(t, up * [1.0, 1.0, sign], "xyz")})
        assert [line.partition(":")[0] + ":" + line.split(":")[1] for line in doubts(flown)] == expected


def test_what_nothing_can_speak_against_is_said(csv):
    path, chart, _ = csv
    recording, _ = read_recording(path, str(chart))
    assert unchecked(recording) == []
    few = {name: recording.signals[name] for name in ("position", "motors", "velocity")}
    assert unchecked(recording._replace(signals=few)) == ["order of motors not checked: no body_rates"]


def test_a_column_that_a_map_of_ones_own_names_and_the_log_lacks_is_refused(csv):
    path, chart, _ = csv
    chart.write_text(MAP.replace("[qw, qx", "[q_w, qx"), encoding="utf-8")
    with pytest.raises(FlightLogError, match=r"map\.yaml: attitude: found no column 'q_w', expected qw"):
        read_recording(path, str(chart))


def test_a_quaternion_in_another_order_is_doubted_without_an_accelerometer_too(csv):
    path, chart, _ = csv
    content = yaml.safe_load(chart.read_text(encoding="utf-8"))
    content["signals"] = {name: content["signals"][name] for name in ("position", "attitude")}
    chart.write_text(yaml.safe_dump(content), encoding="utf-8")
    recording, _ = read_recording(path, str(chart))
    assert doubts(recording) == []
    attitude = recording.signals["attitude"]
    mixed = recording.signals | {"attitude": attitude._replace(values=attitude.values[:, [3, 0, 1, 2]])}
    (doubt,) = doubts(recording._replace(signals=mixed))
    assert re.search(r"body z is 1\d\d deg off the thrust .*; read as w, x, y, z it is [12]?[0-9] deg", doubt)


def turned(signal, factors):
    return signal._replace(values=signal.values * np.array(factors))


def test_motors_in_another_order_than_the_map_says_are_named():
    rng, t = np.random.default_rng(2), np.arange(0.0, 20.0, 0.01)
    motors = 0.5 + np.cumsum(0.01 * rng.standard_normal((len(t), 4)), axis=0) % 0.2
    torque = (motors - motors.mean(axis=0)) @ np.array([(-1, -1, 1, 1), (-1, 1, 1, -1), (-1, 1, -1, 1)]).T  # Crazyflie
    rates = np.cumsum(50.0 * torque * 0.01, axis=0)
    signals = {"motors": Series(t, motors, "m"), "body_rates": Series(t, rates, "g")}
    assert not [line for line in doubts(Recording(signals, "crazyflie", [])) if "order" in line]
    assert "order 'crazyflie'" in "".join(doubts(Recording(signals, "x", [])))


def test_a_damaged_time_is_refused_and_a_damaged_number_left_out():
    table = {"t": np.array([0.0, 1.0, 2.0, 3.0]), "battery": np.array([12.0, 1e300, 12.0, 12.0])}
    content = {"time": {"column": "t"}, "signals": {"voltage": {"columns": ["battery"]}}}
    assert mapped({"": table}, content, []).signals["voltage"].t.tolist() == [0.0, 2.0, 3.0]
    table["t"][3] = 1e11
    with pytest.raises(FlightLogError, match=r"voltage: battery: its times span 1e[+]11 s, expected at most 86400 s"):
        mapped({"": table}, content, [])


def test_attitude_and_thrust_set_points_of_px4_are_read():
    half, one = np.sqrt(0.5), np.ones(2)
    columns = {"t": np.array([0.0, 0.1]), "q_d[0]": half * one, "q_d[3]": half * one, "thrust_body[2]": -0.6 * one}
    empty = ("q_d[1]", "q_d[2]", "thrust_body[0]", "thrust_body[1]")
    tables = {"vehicle_attitude_setpoint": {**columns, **dict.fromkeys(empty, 0.0 * one)}}
    found = mapped(tables, load_map("px4"), []).signals
    east = Rotation.from_quat(found["attitude_target"].values[0]).apply([1.0, 0.0, 0.0])
    assert east == pytest.approx([1.0, 0.0, 0.0])  # a quarter turn from north, seen from above
    assert found["thrust_target"].values[0] == pytest.approx([0.0, 0.0, 0.6])


def test_logs_of_a_crazyflie_and_of_px4_are_read():
    flown, name = read_recording(DATA / "crazyflie.usd.gz")
    assert name == "crazyflie"
    assert len(flown.signals["motors"].t) == 700
    assert np.linalg.norm(flown.signals["specific_force"].values.mean(axis=0)) == pytest.approx(9.8, rel=0.6)
    assert 0.0 < flown.signals["motors"].values.min() < flown.signals["motors"].values.max() < 1.0
    pytest.importorskip("pyulog")
    waiting, name = read_recording(DATA / "px4.ulg.gz")
    assert name == "px4"
    force = waiting.signals["specific_force"].values.mean(axis=0)
    assert force == pytest.approx([0.0, 0.0, 9.8], abs=0.5)


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_a_damaged_file_is_read_up_to_its_damage_or_ends_in_one_line(path, seed, tmp_path):
    rng, data = np.random.default_rng(seed), bytearray(gzip.decompress(path.read_bytes()))
    if seed % 3 == 0:
        data = data[: int(rng.integers(1, len(data)))]
    for _ in range(1 + seed % 4):
        head = 300 if seed % 2 else len(data)
        data[int(rng.integers(0, min(head, len(data))))] ^= 1 << int(rng.integers(0, 8))
    if seed % 5 == 0:
        data[3:7] = b"\xff\xff\xff\xff"
    damaged = tmp_path / "damaged"
    damaged.write_bytes(bytes(data))
    try:
        kind, tables, _ = read_tables(damaged)
        recording = mapped(tables, load_map({"ulog": "px4", "usd": "crazyflie"}.get(kind, "ros")), [])
    except FlightLogError as error:
        assert "\n" not in str(error)
        return
    doubts(recording)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("a: 1", "found no 'signals'"),
        ("signals: {speed: {columns: [a]}}", "found signal 'speed', expected one of"),
        ("signals: {position: {columns: [a, b]}}", "position: found 2 columns, expected 3"),
        ("signals: {position: {columns: [a, b, c], unit: ft}}", "unit: found 'ft', expected one of"),
        ("rotors: h\nsignals: {}", "rotors: found 'h', expected one of x, plus"),
        ("signals: {position: {columns: [a, b, c]}}", "position: found no column 'a', expected"),
    ],
)
def test_a_bad_map_is_refused_by_key(text, problem, csv, tmp_path):
    (tmp_path / "bad.yaml").write_text(text)
    with pytest.raises(FlightLogError, match=problem):
        read_recording(csv[0], str(tmp_path / "bad.yaml"))


@pytest.mark.parametrize("change", [lambda t: 0.0 * t, lambda t: -t], ids=["stands", "goes back"])
def test_a_time_that_stands_or_goes_back_is_named(change, csv, tmp_path):
    pandas = pytest.importorskip("pandas")
    frame = pandas.read_csv(csv[0])
    frame.assign(t=change(frame["t"])).to_csv(tmp_path / "bad.csv", index=False)
    with pytest.raises(FlightLogError, match="found 1 rows of finite numbers whose time goes on, expected two"):
        read_recording(tmp_path / "bad.csv", str(csv[1]))


def test_a_table_needs_a_map_and_parquet_is_read_as_csv(csv, tmp_path):
    with pytest.raises(FlightLogError, match="give --map"):
        read_recording(csv[0])
    pandas = pytest.importorskip("pandas")
    frame, stream = pandas.read_csv(csv[0]), io.BytesIO()
    frame.to_parquet(stream)
    (tmp_path / "lap.parquet").write_bytes(stream.getvalue())
    one, _ = read_recording(csv[0], str(csv[1]))
    other, _ = read_recording(tmp_path / "lap.parquet", str(csv[1]))
    assert all(np.array_equal(one.signals[name].values, other.signals[name].values) for name in one.signals)
