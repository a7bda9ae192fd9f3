"""Bags made to harm: every verb ends in time, with an exit code and at most one line of complaint."""

import re
import resource
import shutil
import subprocess
import sys
import warnings
from pathlib import Path

import pytest
from hostile_bags import ESCAPE, HOSTILE, YAML_TEXTS, bomb

from quad_flight_log import cli
from quad_flight_log.bag.reader import open_flight

LONGEST = 10.0  # s
LARGEST = 1_000_000  # kB of memory in all
CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")
VERBS = {
    "info": [],
    "metrics": [],
    "metrics --json": [],
    "check": ["--limits", "position_rmse=1"],
    "hash": [],
    "export": ["--out", "csv"],
    "replay": [],
    "report": ["--out", "report"],
    "view": ["--out", "view"],
}


def cpu_time() -> float:
    """Return the seconds that this process and its children computed: the machine has other work too."""
    return sum(sum(resource.getrusage(who)[:2]) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))


def ends_well(verb: str, bag: Path, out: Path, capfd: pytest.CaptureFixture[str]) -> str:
    arguments = [
        str(out / item) if before == "--out" else item
        for before, item in zip(["", *VERBS[verb]], VERBS[verb], strict=False)
    ]
    began = cpu_time()
    with warnings.catch_warnings():
        warnings.simplefilter("default")
        code = cli.main([*verb.split(), str(bag), *arguments])
    took = cpu_time() - began
    printed = capfd.readouterr()
    assert code in (0, 1, 2)
    assert took < LONGEST, f"{took:.1f} s"
    assert len(printed.err.splitlines()) == (1 if code == 2 else 0), printed.err
    assert len(printed.err) < 1000
    assert CONTROL.search(printed.out + printed.err) is None
    return printed.out + printed.err


@pytest.mark.parametrize("name", HOSTILE)
def test_every_verb_ends_well(name, tmp_path, capfd):
    bag = HOSTILE[name](tmp_path / "hostile.mcap")
    assert bag.stat().st_size < 2_000_000
    for verb in VERBS:
        ends_well(verb, bag, tmp_path / "out", capfd)


@pytest.mark.parametrize("name", YAML_TEXTS)
def test_a_bag_is_read_whatever_its_metadata_yaml_says(name, flown_bag, tmp_path):
    bag = tmp_path / "bag"
    shutil.copytree(flown_bag, bag)
    (bag / "metadata.yaml").write_text(YAML_TEXTS[name], encoding="utf-8")
    began = cpu_time()
    assert open_flight(bag).payloads("truth") == open_flight(flown_bag).payloads("truth")
    assert cpu_time() - began < LONGEST


def test_what_a_bag_holds_is_printed_without_its_escapes(tmp_path, capfd):
    bag = HOSTILE["notes with escapes"](tmp_path / "hostile.mcap")
    printed = ends_well("info", bag, tmp_path, capfd)
    assert ESCAPE not in printed
    assert r"\x1b]0;owned" in printed
    assert "\nok" not in printed


@pytest.mark.parametrize("verb", ["metrics", "info"])
def test_a_bomb_stays_within_memory(verb, tmp_path):
    bag = bomb(tmp_path / "bomb.mcap", 60 << 20, 40)
    assert bag.stat().st_size < 300_000
    # a child's rusage begins with what its parent had
    script = (
        "import sys; from quad_flight_log.cli import main; code = main(sys.argv[1:]); "
        "print(*[line for line in open('/proc/self/status') if line.startswith('VmHWM')]); sys.exit(code)"
    )
    began = cpu_time()
    done = subprocess.run([sys.executable, "-c", script, verb, str(bag)], capture_output=True, text=True, check=False)
    assert done.returncode == 2, done.stderr
    assert "unpack" in done.stderr
    assert int(done.stdout.split()[1]) < LARGEST
    assert cpu_time() - began < LONGEST
