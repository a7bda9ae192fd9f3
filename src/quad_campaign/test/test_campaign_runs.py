"""Campaigns: any flight by its number, the same wherever it is flown, and all of them once, whoever is killed."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from quad_campaign.batch import Parts, flight_of, fly_numbers, prepared, run
from quad_campaign.campaign_cli import main
from quad_campaign.campaign_report import page, quantiles, success, worst
from quad_campaign.definition import base_flight, command, read_definition, request
from quad_core.parameters import ParameterError
from quad_flight.flight import flight_from_resolved, fly
from quad_flight.set_up import resolve_flight
from quad_report.figures import Figure

FILE = """
flight: {case: hover, duration: 0.1, set: [simulator.held_gaussian.acceleration_sd=0.4]}
success: {rmse: 0.5}
seed: 5
vary:
  vehicle.mass: {uniform: [0.5, 0.6]}
  simulator.rigid_body.mass_error: {normal: [0.0, 0.05], within: [-0.05, 0.05]}
  simulator.rigid_body.substeps: {uniform: [1, 3]}
  position_controller.aibs.thrust_form: {choice: [norm, projected]}
"""


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "small.yaml"
    path.write_text(FILE, encoding="utf-8")
    return path


@pytest.fixture
def definition(file):
    return read_definition(file)


def test_a_flight_is_decided_by_seed_and_number_alone(definition):
    batch = prepared(definition)
    values = [flight_of(batch, number)[1] for number in range(40)]
    assert [flight_of(batch, number)[1] for number in (7, 3)] == [values[7], values[3]]
    masses = [value["vehicle.mass"] for value in values]
    assert len(set(masses)) == 40
    assert 0.5 <= min(masses) < max(masses) <= 0.6
    assert {value["simulator.rigid_body.substeps"] for value in values} == {1, 2, 3}
    assert {value["position_controller.aibs.thrust_form"] for value in values} == {"norm", "projected"}
    assert max(abs(value["simulator.rigid_body.mass_error"]) for value in values) <= 0.05
    assert len({value["flight.seed"] for value in values}) == 40
    fewer = definition._replace(vary={"vehicle.mass": definition.vary["vehicle.mass"]})
    assert flight_of(prepared(fewer), 7)[1] == {"vehicle.mass": masses[7]}
    other = definition._replace(seed=6)
    assert flight_of(prepared(other), 7)[1]["vehicle.mass"] != masses[7]


def test_the_command_of_a_flight_flies_the_very_same_flight(definition):
    batch = prepared(definition)
    for number in (0, 11):
        flight, values = flight_of(batch, number)
        again = flight_from_resolved(resolve_flight(request(definition, values), {}))
        assert again.seed == flight.seed
        assert again.setup == flight.setup
        mine, theirs = fly(flight), fly(again)
        assert mine.topics["truth"].tobytes() == theirs.topics["truth"].tobytes()
        words = command(definition, values)
        assert words[:3] == ["hover", "--duration", "0.1"]
        assert f"vehicle.mass={values['vehicle.mass']!r}" in words


def test_values_decide_what_runs(file):
    ground = "simulator.rigid_body.ground.enabled: {choice: [true, false]}"
    start = "simulator.rigid_body.initial.p.z: {uniform: [0.0, 0.3]}"
    late = "simulator.sensor.delay: {choice: [0.0, 0.02]}"
    file.write_text("\n  ".join((FILE.rstrip(), ground, start, late)), encoding="utf-8")
    definition = read_definition(file)
    batch = prepared(definition)
    for flight, values in (flight_of(batch, number) for number in range(16)):
        again = base_flight(definition, values)
        assert (flight.modules, flight.setup, flight.seed) == (again.modules, again.setup, again.seed), values


def test_a_row_tells_the_flight(definition):
    batch = prepared(definition)
    (row,) = fly_numbers(batch, [4], compiled=False)
    result = fly(flight_of(batch, 4)[0])
    errors = result.topics["truth"]["p_w"][::5] - result.topics["reference"]["p_w"]
    counted = result.topics["reference"]["trajectory_time"] >= 0.0
    assert row["rmse"] == pytest.approx(np.sqrt(np.mean(np.sum(errors[counted] ** 2, axis=1))), rel=1e-12)
    assert (row["flight"], row["outcome"], row["steps"], row["success"]) == (4, "ended", result.steps, True)
    (strict,) = fly_numbers(batch._replace(definition=definition._replace(success={"rmse": 1e-9})), [4], compiled=False)
    assert not strict["success"]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("seed: 5", "sead: 5", ["sead", "seed"]),
        ("rmse: 0.5", "rmse: -1", ["success.rmse", "-1"]),
        ("case: hover", "preset: tuned", ["flight.case"]),
        ("case: hover", "case: loop", ["loop", "hover"]),
        ("{uniform: [0.5, 0.6]}", "{uniform: [0.6, 0.5]}", ["vehicle.mass", "low <= high"]),
        ("{uniform: [0.5, 0.6]}", "{uniform: [-2.0, -1.0]}", ["vehicle.mass", "0.001"]),
        ("{uniform: [1, 3]}", "{uniform: [0.5, 3]}", ["small", "substeps.uniform: found (0.5, 3)", "integers"]),
        ("{uniform: [0.5, 0.6]}", "{triangle: [0.5, 0.6]}", ["triangle", "normal"]),
        ("vehicle.mass", "vehicle.mas", ["vehicle.mas", "vehicle.mass"]),
        ("aibs.thrust_form", "lqr.thrust_form", ["lqr", "aibs"]),
        ("vary:", "vary: [", ["line"]),
        ("case: hover", "case: hover, preset: 5", ["small.yaml", "flight.preset", "5", "text"]),
        ("set: [simulator.held_gaussian.acceleration_sd=0.4]", "set: flight.seed=3", ["flight.set", "a list"]),
        ("{uniform: [0.5, 0.6]}", "{uniform: [0.5, .nan]}", ["small.yaml", "vehicle.mass", "nan", "finite"]),
        ("{uniform: [0.5, 0.6]}", "{uniform: [0.5, 0.6], within: [0.5, 0.51]}", ["vehicle.mass", "within", "normal"]),
        ("within: [-0.05, 0.05]", "within: [0.05, -0.05]", ["small", "mass_error", "no value within"]),
        ("{uniform: [1, 3]}", "{uniform: [1, 1.0e+30]}", ["small", "substeps", "1e+30"]),
        ("seed: 5", "seed: true", ["seed", "True", "integer"]),
        ("rmse: 0.5", "rmse: true", ["success.rmse", "True"]),
        ("{uniform: [0.5, 0.6]}", "{uniform: [0.5, true]}", ["vehicle.mass", "True", "two numbers"]),
        ("seed: 5", "about: caf\udce9", ["small.yaml", "UTF-8"]),
    ],
)
def test_a_wrong_file_is_refused_by_key(file, capsys, tmp_path, old, new, words):
    file.write_text(FILE.replace(old, new), encoding="utf-8", errors="surrogateescape")
    assert main([str(file), "--flights", "2", "--out", str(tmp_path / "out"), "--engine", "python"]) == 2
    said = capsys.readouterr().err
    assert all(word in said for word in words), said
    assert not (tmp_path / "out").exists()


def arguments(file, out, *more):
    words = [str(file), "--flights", "10", "--out", str(out), "--engine", "python", *more]
    return [sys.executable, "-m", "quad_campaign.campaign_cli", *words]


def test_a_campaign_that_was_killed_goes_on_and_ends_as_if_it_had_not(file, tmp_path):
    out = tmp_path / "out"
    killed = subprocess.Popen(arguments(file, out), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + 60
    while len(list(out.glob("parts/*.parquet"))) < 2 and killed.poll() is None and time.monotonic() < deadline:
        time.sleep(0.01)
    killed.send_signal(signal.SIGKILL)
    killed.wait()
    before = {path.name: path.read_bytes() for path in out.glob("parts/*.parquet")}
    assert 2 <= len(before) < 10
    refused = subprocess.run(arguments(file, out), capture_output=True, text=True, check=False)
    assert refused.returncode == 2
    assert "--resume" in refused.stderr
    for flag, value in (("flights", "11"), ("part", "2")):
        words = arguments(file, out, "--resume", f"--{flag}", value)
        other = subprocess.run(words, capture_output=True, text=True, check=False)
        assert other.returncode == 2
        assert f"{flag} {value}" in other.stderr
    done = subprocess.run(arguments(file, out, "--resume"), capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    after = {path.name: path.read_bytes() for path in out.glob("parts/*.parquet")}
    assert {name: after[name] for name in before} == before
    frame = pd.read_parquet(out / "flights.parquet")
    alone = pd.DataFrame(fly_numbers(prepared(read_definition(file)), range(10), compiled=False))
    pd.testing.assert_frame_equal(frame, alone, check_exact=True)
    assert "10 of 10 flights succeeded" in done.stdout
    assert (out / "report.html").stat().st_size > 1_000_000


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--refly", "-1"], "-1, expected at least 0"),
        (["--flights", "x"], "'x'"),
        (["--resume"], "expected --out DIR"),
        (["--scheduler", "tcp://host"], "'tcp://host', expected tcp://HOST:PORT"),
    ],
)
def test_wrong_usage_is_exit_code_2(file, capsys, monkeypatch, tmp_path, words, said):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as left:
        main([str(file), "--engine", "python", *words])
    assert left.value.code == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "campaigns").exists()


def test_parts_hold_each_flight_once(tmp_path):
    parts = Parts(tmp_path / "out", 5, 2)
    parts.open({"identity": {}}, resume=False)
    parts.write(0, [{"flight": 0}])
    parts.write(2, [{"flight": 4}])
    assert parts.missing() == [1]
    parts.write(1, [{"flight": 2}, {"flight": 3}])
    with pytest.raises(ValueError, match="do not hold each of 5 flights once"):
        parts.joined()
    with pytest.raises(ParameterError, match="--resume"):
        parts.open({"identity": {}}, resume=False)
    (tmp_path / "out" / "campaign.json").write_text("{}", encoding="utf-8")
    with pytest.raises(ParameterError, match=r"campaign\.json: found no identity"):
        parts.open({"identity": {}}, resume=True)


@pytest.mark.long
def test_a_killed_worker_costs_no_flight_and_none_is_counted_twice(definition, tmp_path):
    distributed = pytest.importorskip("distributed")
    parts = Parts(tmp_path / "out", 40, 2)
    parts.open({"identity": {}}, resume=False)
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0", host="127.0.0.1"
    ) as cluster:
        victim = next(iter(cluster.workers.values())).pid
        written = parts.write

        def write_and_kill(part, rows):
            written(part, rows)
            if victim_is_alive(victim) and len(parts.missing()) == 15:
                os.kill(victim, signal.SIGKILL)

        parts.write = write_and_kill
        run(definition, parts, scheduler=cluster.scheduler_address, compiled=False, progress=False)
    assert not victim_is_alive(victim)
    frame = parts.joined()
    alone = pd.DataFrame(fly_numbers(prepared(definition), range(40), compiled=False))
    pd.testing.assert_frame_equal(frame, alone, check_exact=True)


def victim_is_alive(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text("ascii").rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def test_rates_have_exact_bounds_and_the_worst_come_first(definition):
    frame = pd.DataFrame(
        {
            "flight": range(10),
            "vehicle.mass": np.linspace(0.5, 0.6, 10),
            "simulator.rigid_body.mass_error": np.linspace(-0.1, 0.1, 10),
            "simulator.rigid_body.substeps": [1] * 10,
            "position_controller.aibs.thrust_form": ["norm"] * 10,
            "flight.seed": range(10),
            "outcome": ["ended"] * 8 + ["diverged", "refused"],
            "steps": [50] * 8 + [20, 10],
            "rmse": [0.1 * n for n in range(8)] + [np.nan, 9.0],
            "largest_error": 1.0,
            "last_error": 1.0,
            "torque_variation": 1.0,
            "success": [True] * 7 + [False] * 3,
        }
    )
    found = success(frame)
    # the exact bounds of 7 in 10 at 95 %, as printed in tables of the binomial distribution
    assert (found.good, found.flights) == (7, 10)
    assert (round(found.low, 4), round(found.high, 4)) == (0.3475, 0.9333)
    assert quantiles(frame).loc[0.5, "rmse"] == pytest.approx(0.35)
    assert list(worst(frame, 4)["flight"]) == [9, 8, 7, 6]
    found = page(definition, prepared(definition).variation, frame, {"command": "<it>", "file text": FILE})
    assert found.verdict is not None
    assert found.verdict[1].startswith("7 of 10 flights succeeded: 70.00 %, 95 % bounds 34.75 to 93.33 %")
    assert found.numbers == [
        ("70 %", "flights succeeded"), ("350 mm", "RMSE, median"), ("665 mm", "RMSE, 95 % of the flights")
    ]  # fmt: skip
    curve, mass, error = (part for part in found.body if isinstance(part, Figure))
    values, share = curve.panels[0].lines[0].columns
    assert values.tolist() == pytest.approx([0.1 * n for n in range(8)])
    assert share.tolist() == [12.5 * n for n in range(1, 9)]
    assert (mass.title, mass.x_label) == ("vehicle.mass", "vehicle.mass [kg]")
    assert error.title == "simulator.rigid_body.mass_error"
    dots = {line.label: line.columns[1].tolist() for line in mass.panels[0].lines}
    assert dots["no success"] == pytest.approx([0.7])
    assert dots["did not end (drawn at the top)"] == pytest.approx([0.7, 0.7])


def test_a_campaign_without_numba_ends_with_one_line(tmp_path):
    text = (
        "import sys; sys.modules['numba'] = None\n"
        "from quad_campaign import campaign_cli\n"
        f"sys.exit(campaign_cli.main(['campaign_case2', '--flights', '2', '--out', {str(tmp_path / 'out')!r}]))"
    )
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, timeout=120, check=False)
    said = [line for line in done.stderr.splitlines() if "Numba" in line]
    assert done.returncode == 1, done.stderr
    assert said == ["campaign: compiled flights need Numba, which is not installed (requirements/extras.txt)"]
    assert "Traceback" not in done.stderr
