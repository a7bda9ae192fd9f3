"""Laws beside a flight: equal bits for those that flew, each planted mistake by name, and flights of others."""

import copy

import numpy as np
import pytest
from loop_flight import FlownFlight, fly_short, write_flight

from quad_analysis.refly import refly
from quad_analysis.shadow import AXES, Beside, mistakes, shadow
from quad_core.vehicle import Vehicle
from quad_flight_log.reader import open_flight
from quad_report.cli import main

VEHICLE = "/**:\n  ros__parameters:\n    vehicle:\n      mass: 0.56\n"
MAP = """
rotors: plus
time: {column: t}
signals:
  attitude: {columns: [qx, qy, qz, qw]}
  body_rates: {columns: [wx, wy, wz]}
  position: {columns: [px, py, pz]}
  velocity: {columns: [vx, vy, vz]}
  motors: {columns: [m1, m2, m3, m4]}
  reference_position: {columns: [rx, ry, rz]}
  reference_velocity: {columns: [ux, uy, uz]}
  reference_yaw: {columns: [yaw]}
"""


@pytest.fixture(scope="module")
def calm():
    """Case 1 without the disturbance of the paper."""
    return fly_short(2.5, "none")


def as_csv(flown, tmp_path, *, leave_out=(), curve=1):
    """Return a CSV file of the flight, a row per step of its vehicle, with commands of motors; and a map of it."""
    topics = flown.result.topics
    truth, made, reference = topics["truth"], topics["actuation"], topics["reference"]
    count = min(len(truth), len(made))
    reference = np.repeat(reference, int(reference["next_step"][0] - reference["step"][0]))
    full = np.sqrt(Vehicle().thrust_to_weight * Vehicle().mass * Vehicle().gravity / 4.0 / Vehicle().lift_coefficient)
    columns = {"t": truth["stamp_ns"][:count] * 1e-9}
    for names, values in (
        ("qx qy qz qw", truth["q_wb"]), ("wx wy wz", truth["omega_b"]), ("px py pz", truth["p_w"]),
        ("vx vy vz", truth["v_w"]), ("m1 m2 m3 m4", (made["rotor_speed"] / full) ** (2 - curve)),
        ("rx ry rz", reference["p_w"]),
        ("ux uy uz", reference["v_w"]), ("yaw", reference["yaw"][:, None]),
    ):  # fmt: skip
        columns |= dict(zip(names.split(), values[:count].T, strict=True))
    lines = [line for line in MAP.splitlines() if not line.strip().startswith(leave_out or "-")]
    (tmp_path / "map.yaml").write_text("\n".join([f"curve: {curve:.1f}", *lines]))
    (tmp_path / "vehicle.yaml").write_text(VEHICLE)
    path = tmp_path / "flight.csv"
    np.savetxt(path, np.column_stack(list(columns.values())), delimiter=",", header=",".join(columns), comments="")
    return path


def imported(flown, tmp_path, **options):
    bag = tmp_path / "bag"
    path = as_csv(flown, tmp_path, **options)
    assert main(["import", str(path), "--map", str(tmp_path / "map.yaml"), "--out", str(bag)]) == 0
    return bag


def test_the_laws_that_flew_give_every_bit_and_others_do_not(flown_bag, capsys):
    assert main(["shadow", str(flown_bag)]) == 0
    assert "shadow: aibs, abfnitsm: every bit is that of the flight" in capsys.readouterr().out
    assert main(["shadow", str(flown_bag), "--position", "pid", "--attitude", "se3"]) == 0
    said = capsys.readouterr().out
    assert said.startswith("shadow: pid, se3\n")
    assert "memory carried from the first step on" in said
    assert "memory begun anew every second" in said


def test_the_attitude_law_follows_the_position_law_of_its_pair(flown_bag):
    flight = open_flight(flown_bag)
    same = shadow(flight, {}, {}, anew=False)
    other = shadow(flight, {"position_controller": "pid"}, {}, anew=False)
    assert same.equal
    assert not other.equal
    for axis in ("roll", "torque y"):
        assert np.array_equal(same.axes[axis][1], other.axes[axis][1])
        assert np.abs(other.axes[axis][2] - same.axes[axis][2]).max() > 1e-3


@pytest.mark.parametrize(
    ("change", "named"),
    [
        (lambda torque: setattr(torque, "x", -torque.x), "sign? torque x: the shadow does the opposite"),
        (lambda torque: setattr(torque, "y", torque.y / 10.0), "scale? torque y: the shadow is 10 times"),
    ],
    ids=["sign", "scale"],
)
def test_a_planted_mistake_is_named(flown, tmp_path, capsys, change, named):
    replaced = {}
    for index, (topic, sample) in enumerate(flown.messages):
        if topic == "wrench_setpoint":
            replaced[index] = copy.deepcopy(sample)
            change(replaced[index].wrench.torque)
    assert main(["shadow", str(write_flight(tmp_path / "bag", FlownFlight(*flown), replace=replaced))]) == 0
    said = capsys.readouterr().out
    assert named in said
    assert said.count("? ") == 1
    assert "every bit" not in said


def test_an_axis_that_follows_another_is_named():
    t = np.linspace(0.0, 10.0, 1001)
    waves = {name: np.sin((1.0 + number) * t) for number, name in enumerate(AXES)}
    axes = {name: (t, wave, wave) for name, wave in waves.items()} | {"thrust": (t, 5.0 + 0.0 * t, 5.0 + 0.0 * t)}
    axes |= {one: (t, waves[one], -waves[other]) for one, other in (("roll", "pitch"), ("pitch", "roll"))}
    named = [f"frame? {one} of the shadow follows {two} of the flight (correlation -1.00)" for one, two in
             (("roll", "pitch"), ("pitch", "roll"))]  # fmt: skip
    assert mistakes(Beside([], axes, {}, 5.0, True, [])) == named


def test_time_without_a_set_point_is_left_out_and_counted(calm, tmp_path):
    table = np.loadtxt(as_csv(calm, tmp_path), delimiter=",", skiprows=1)
    head = (tmp_path / "flight.csv").read_text().splitlines()[0]
    table[:, head.split(",").index("rx")][250:1000] = np.nan  # from 0.5 s to 2 s
    np.savetxt(tmp_path / "flight.csv", table, delimiter=",", header=head, comments="")
    bag = tmp_path / "bag"
    assert main(["import", str(tmp_path / "flight.csv"), "--map", str(tmp_path / "map.yaml"), "--out", str(bag)]) == 0
    beside = shadow(open_flight(bag), {}, {"vehicle.mass": 0.56}, anew=False)
    assert "left out: 1.5 s without a reference, 0.0 s with idle motors, of 2.5 s" in beside.notes
    times = beside.axes["roll"][0]
    assert not ((times > 0.51) & (times < 1.99)).any()


@pytest.mark.parametrize("curve", [1, 0], ids=["thrust is the square of a command", "thrust is linear in a command"])
def test_an_imported_flight_has_a_shadow_and_goes_on_from_its_states(calm, tmp_path, capsys, curve):
    bag, vehicle = imported(calm, tmp_path, curve=curve), ["--vehicle", str(tmp_path / "vehicle.yaml")]
    capsys.readouterr()
    assert main(["shadow", str(bag), *vehicle, "--position", "aibs", "--attitude", "abfnitsm"]) == 0
    said = capsys.readouterr().out
    assert "left out: 0.0 s without a reference" in said
    assert "open loop holds for" in said
    times, torque, _ = shadow(open_flight(bag), {}, {"vehicle.mass": 0.56}, anew=False).axes["torque x"]
    made = calm.result.topics["actuation"]["torque_b"][np.round(times / 0.002).astype(int), 0]
    assert torque == pytest.approx(made, abs=1e-9)
    assert main(["refly", str(bag), *vehicle]) == 0
    assert "holds for 1.0 s and more by position" in capsys.readouterr().out


def test_the_plant_goes_on_as_the_flight_did(calm, tmp_path):
    flight = open_flight(write_flight(tmp_path / "bag", calm))
    found = refly(flight, {})
    assert found.seconds == 2
    assert np.delete(found.errors, 2, axis=1).max() == 0.0  # of the attitude the angle is not resolved to the last bit
    assert found.errors[:, 2].max() < 1e-7
    assert found.held[-1].min() > 0.1
    assert found.trusted("position") is None
    heavier = refly(flight, {"vehicle.mass": 1.0})
    assert heavier.trusted("position") == pytest.approx(0.22, abs=0.1)  # s^2 = 2 * 0.1 m / (9.8 m/s^2 * 0.44)


@pytest.mark.parametrize(
    ("leave_out", "command", "lack"),
    [("reference", "shadow", "no reference"), ("motors", "shadow", "no motors"), ("motors", "refly", "no motors"),
     ("position", "refly", "no state"), ("", "shadow", "no vehicle")],
)  # fmt: skip
def test_what_a_bag_lacks_is_said_by_name(flown, tmp_path, capsys, leave_out, command, lack):
    bag = imported(flown, tmp_path, leave_out=leave_out)
    capsys.readouterr()
    assert main([command, str(bag), *(["--vehicle", str(tmp_path / "vehicle.yaml")] if leave_out else [])]) == 2
    said = capsys.readouterr().err
    assert f": {lack}: " in said
    assert said.count("\n") == 1
