"""The commands: what they print, where they write, how they end."""

import json
import os
import subprocess
import sys
from pathlib import Path

import drawn_flights
import flight_samples
import pytest

from quad_analysis.metrics import FlightMetrics
from quad_analysis.text import latex_table
from quad_flight_log.reader import open_flight
from quad_report import cli


def run(capsys, *arguments):
    code = cli.main([str(argument) for argument in arguments])
    captured = capsys.readouterr()
    return code, captured.out, captured.err


@pytest.mark.parametrize("verb", cli.COMMANDS)
def test_every_verb_explains_itself_with_examples(verb, capsys):
    with pytest.raises(SystemExit) as ended:
        cli.main([verb, "--help"])
    shown = capsys.readouterr().out
    assert ended.value.code == 0
    assert "examples:" in shown
    assert f"  log {verb} " in shown


@pytest.mark.parametrize(
    "arguments", [["fly"], ["info"], ["metrics", "--yaml", "x"], ["metrics", "a", "--name", "b"], []]
)
def test_bad_usage_ends_with_two_and_one_line(arguments, capsys):
    with pytest.raises(SystemExit) as ended:
        cli.main(arguments)
    assert ended.value.code == 2
    assert len(capsys.readouterr().err.splitlines()) == 1


@pytest.mark.parametrize("verb", ["info", "metrics", "hash", "export", "replay"])
def test_no_bag_ends_with_two_and_its_name(verb, capsys, tmp_path):
    code, out, err = run(capsys, verb, tmp_path / "nowhere")
    assert (code, out) == (2, "")
    assert f"log {verb}: " in err
    assert "nowhere" in err
    (tmp_path / "foreign.mcap").write_bytes(b"hello, world")
    assert run(capsys, verb, tmp_path / "foreign.mcap")[0] == 2


def test_a_defect_ends_with_two_for_one_says_that_the_flight_failed(flown_bag, capsys, monkeypatch):
    monkeypatch.setattr(cli, "judgement", lambda *_: 1 / 0)
    code, out, err = run(capsys, "check", flown_bag)
    assert (code, out) == (2, "")
    assert "Traceback" in err
    assert "log check: a defect of this program, not of the flight: ZeroDivisionError" in err


@pytest.mark.parametrize("flights", [1, 400])
def test_a_reader_that_leaves_early_changes_no_exit_code(flights, flown_bag, monkeypatch):
    ours, theirs = os.pipe()
    os.close(ours)
    with os.fdopen(theirs, "w") as left:
        monkeypatch.setattr(sys, "stdout", left)
        monkeypatch.setattr(cli, "_opened", lambda _: [open_flight(flown_bag)] * flights)
        assert cli.main(["check", str(flown_bag), "--limits", "duration=0.001"]) == 1


def test_info_tells_bytes_rate_and_drops_of_each_topic(flown, flown_bag, capsys):
    code, out, _ = run(capsys, "info", flown_bag)
    assert code == 0
    (line,) = [line.split() for line in out.splitlines() if line.strip().startswith("/truth ")]
    size = next(len(flight_samples.encoded(sample)) for topic, sample in flown.messages if topic == "truth")
    assert line[1:3] == ["500", str(500 * size)]
    assert line[-4:] == ["500.0", "Hz", "0", "quad_msgs/msg/VehicleState"]
    assert "  seed: 7" in out.splitlines()
    assert f"  complete, {next(flown_bag.glob('*.mcap')).stat().st_size} bytes, written by " in out


def test_metrics_as_table_and_json_agree(flown, flown_bag, capsys):
    code, out, _ = run(capsys, "metrics", flown_bag)
    assert code == 0
    shown = json.loads(run(capsys, "metrics", flown_bag, "--json")[1])[0]
    assert shown["flight"] == "flight"
    assert shown["position_rmse"] == pytest.approx(flown.result.rmse, rel=1e-12)
    assert f"{shown['position_rmse']:.5g}" in out


def test_metrics_as_csv_keep_every_digit_and_as_latex_name_units_and_the_least(flown_bag, tmp_path, capsys):
    shown = json.loads(run(capsys, "metrics", flown_bag, "--json")[1])[0]
    head, line = run(capsys, "metrics", flown_bag, "--csv")[1].splitlines()
    found = dict(zip(head.split(","), line.split(","), strict=True))
    assert found["flight"] == "flight"
    assert float(found["position_rmse"]) == shown["position_rmse"]
    one, two = (
        drawn_flights.bag(tmp_path / f"{name}_1", steps=260, scale=scale) for name, scale in (("a", 1), ("b", 2))
    )
    table = run(capsys, "metrics", one, two, "--names", "a_1,pid", "--latex")[1].splitlines()
    assert table[0] == r"\begin{tabular}{lrrl}"
    assert r"metric & a\_1 & pid & unit \\" in table
    assert r"position rmse & $\mathbf{0.3742}$ & $0.7483$ & $\mathrm{m}$ \\" in table


def test_of_values_that_print_alike_all_or_none_are_bold():
    same, more = FlightMetrics(thrust_effort=13480.1), FlightMetrics(thrust_effort=13480.4, position_rmse=1.0)
    assert "mathbf" not in latex_table(["a", "b"], [same, more])
    table = latex_table(["a", "b", "c"], [same, more, FlightMetrics(thrust_effort=20000.0)])
    assert table.count(r"\mathbf{1.348\cdot10^{4}}") == 2


def test_check_ends_with_one_if_a_limit_is_not_kept(flown_bag, capsys, tmp_path):
    limits = tmp_path / "limits.yaml"
    limits.write_text("position_max: 100.0\nposition_rmse: 50\n")
    assert run(capsys, "check", flown_bag, "--limits", limits)[0] == 0
    code, out, _ = run(capsys, "check", flown_bag, "--limits", limits, "--limits", "position_max=0.001")
    assert code == 1
    assert out.count("FAIL") == 1
    assert "position_max" in out.split("FAIL")[1]
    code, out, _ = run(capsys, "check", flown_bag, "--limits", "settling_time=1000")
    assert (code, "settling_time: found not available" in out) == (1, True)
    assert run(capsys, "check", flown_bag)[:2] == (0, "ok   flight: Ended as planned, held to no limits\n")
    noted = flight_samples.write_bag(tmp_path / "noted", flight_samples.samples(3), notes={"limit.position_max": "1"})
    code, out, _ = run(capsys, "check", noted)
    assert (code, "position_max: found not available, expected at most 1 m" in out) == (1, True)


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("position_rms: 1\n", "position_rms"),
        ("position_rmse: fast\n", "fast"),
        ("position_rmse: .nan\n", "nan"),
        ("- 1\n", "list"),
        ("a: [\n", "cannot be read"),
        ("[" * 50_000, "cannot be read"),
        ("position_rmse: " + "9" * 5000, "cannot be read"),
    ],
)
def test_a_wrong_limits_file_is_named(text, word, flown_bag, capsys, tmp_path):
    path = tmp_path / "limits.yaml"
    path.write_text(text)
    code, _, err = run(capsys, "check", flown_bag, "--limits", path)
    assert code == 2
    assert "limits.yaml" in err
    assert word in err


def test_hashes_differ_or_are_of_a_cut_bag(flown_bag, capsys, tmp_path):
    (path,) = flown_bag.glob("*.mcap")
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(path.read_bytes()[:-2000])
    assert run(capsys, "hash", flown_bag, path)[0] == 0
    other = flight_samples.write_bag(tmp_path / "other", flight_samples.samples(3))
    code, out, _ = run(capsys, "hash", flown_bag, other)
    assert (code, "the flights differ" in out) == (1, True)
    code, out, _ = run(capsys, "hash", cut, "--topics")
    assert code == 1, "the hash of a part is not that of the flight"
    assert "(no whole flight: the bag is cut (ends within a record at byte " in out.splitlines()[0]


def test_metrics_of_a_cut_bag_say_that_it_is_cut(flown_bag, tmp_path, capsys):
    (path,) = flown_bag.glob("*.mcap")
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(path.read_bytes()[: path.stat().st_size * 2 // 3])
    code, out, _ = run(capsys, "metrics", cut)
    assert code == 1
    assert "cut.mcap: the bag is cut (ends within a record" in out
    assert "ends within a record" in json.loads(run(capsys, "metrics", cut, "--json")[1])[0]["note"]
    assert "cut.mcap: the bag is cut (ends within a record" in run(capsys, "metrics", cut, "--latex")[2]
    assert json.loads(run(capsys, "metrics", flown_bag, "--json")[1])[0]["note"] == ""


def test_a_report_of_a_part_of_a_flight_ends_with_one_also_where_the_part_has_failed(tmp_path, capsys):
    sent = drawn_flights.messages(drawn_flights.tables(260))
    bag = tmp_path / "bag"
    flight_samples.write_bag(bag, sent, notes={"limit.position_rmse": "0.01"}, pause_every=500)
    (path,) = bag.glob("*.mcap")
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(path.read_bytes()[: path.stat().st_size * 9 // 10])
    whole, part = (run(capsys, "report", one, "--out", tmp_path / "out") for one in (bag, cut))
    for (code, out, _), expected in ((whole, 0), (part, 1)):
        assert code == expected
        assert ("no verdict: the bag is cut" in out) == bool(expected)
        assert "position_rmse: found 0.374" in Path(out.splitlines()[0]).read_text(encoding="utf-8")


def test_an_interrupt_is_one_line(flown_bag, capsys, monkeypatch):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(cli, "open_flight", interrupted)
    assert run(capsys, "info", flown_bag) == (130, "", "log info: interrupted\n")


def test_reading_needs_neither_ros_nor_extras(flown_bag):
    blocked = ("rclpy", "quad_msgs", "pandas", "scipy", "matplotlib", "numba", "plotly")
    text = (
        f"import sys\nfor name in {blocked!r}: sys.modules[name] = None\n"
        "from quad_report import cli\n"
        "sys.exit(max(cli.main([verb, sys.argv[1]]) for verb in ('metrics', 'info', 'replay')))"
    )
    done = subprocess.run(
        [sys.executable, "-c", text, str(flown_bag)], capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "position_rmse" in done.stdout
