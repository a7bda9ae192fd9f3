"""Bags made to harm: every verb ends in time, with an exit code and at most one line of complaint."""

import re
import resource
import shutil
import struct
import subprocess
import sys
import warnings
from collections.abc import Callable
from pathlib import Path

import drawn_flights
import pytest
import zstandard
from other_recorders import Sent, in_one_file, sent, started

from quad_flight_log.reader import open_flight
from quad_report import cli

ESCAPE = "\x1b]0;owned\x07\x1b[31m\u202e"
YAML_TEXTS = {
    "deep list": "[" * 50_000,
    "long integer": "a: " + "9" * 5000,
    "bad tag": "a: !!python/object/apply:os.system ['true']",
    "laughs": "a0: &a0 [x, x]\n" + "\n".join(f"a{n}: &a{n} [*a{n - 1}, *a{n - 1}]" for n in range(1, 40)),
    "list": "[1, 2]",
    "much": "a: [" + "1," * 600_000 + "]",
}


def typed(path: Path, text: str, payload: bytes = bytes(68), topic: str = "/truth", kind: str = "a/msg/A") -> Path:
    """Write a bag with one topic of a type defined by ``text``."""
    return in_one_file(path, [Sent(topic, kind, text.encode(), b"\0\1\0\0" + payload[4:])] * 3)


def noted(path: Path, **notes: str) -> Path:
    """Write a bag with nothing but notes."""
    with path.open("wb") as stream:
        writer = started(stream)
        writer.add_metadata("quad", notes)
        writer.finish()
    return path


def chain(count: int, per_type: int) -> str:
    """Return a definition of ``count`` types, each holding the next ``per_type`` times."""
    parts = []
    for n in range(count):
        head = "" if n == 0 else "=" * 80 + f"\nMSG: a/T{n}\n"
        inner = "\n".join(f"T{n + 1} f{index}" for index in range(per_type)) if n + 1 < count else "float64 x"
        parts.append(head + inner)
    return "\n".join(parts)


def flight(
    path: Path, change: Callable[[Sent], Sent] = lambda one: one, number: float | None = None, of: str = ""
) -> Path:
    """Write a short flight: all numbers of topics that end with ``of`` are ``number``, messages after ``change``."""
    made = drawn_flights.tables(60)
    for topic, table in made.items():
        for name in table.dtype.names:
            if number is not None and topic.endswith(of) and table.dtype[name].base.kind == "f":
                table[name] = number
    return in_one_file(path, [change(sent(*message)) for message in drawn_flights.messages(made)])


TIME = "=" * 80 + "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"


def other_type(topic: str) -> Callable[[Sent], Sent]:
    """Return a change that gives ``topic`` the type of a text."""
    text = f"builtin_interfaces/Time stamp\nstring data\n{TIME}".encode()
    other = Sent(topic, "a/msg/A", text, b"\0\1\0\0" + struct.pack("<iII", 1, 0, 6) + b"hello\0\0\0")
    return lambda one: other if one.topic == topic else one


def stamped(seconds: int, nanoseconds: int) -> Callable[[Sent], Sent]:
    """Return a change that gives every second message one absurd stamp."""
    mad, count = struct.pack("<iI", seconds, nanoseconds), iter(range(100_000))
    return lambda one: one._replace(data=one.data[:4] + mad + one.data[12:]) if next(count) % 2 else one


def bomb(path: Path, size: int, chunks: int, singly: bool = False) -> Path:
    """Write ``chunks`` equal chunks, each one message of ``size`` zeros, ``singly`` compressed before the chunk is."""

    def record(opcode: int, body: bytes) -> bytes:
        return struct.pack("<BQ", opcode, len(body)) + body

    def text(value: bytes) -> bytes:
        return struct.pack("<I", len(value)) + value

    schema = struct.pack("<H", 1) + text(b"a/msg/A") + text(b"ros2msg") + text(b"uint8[] x")
    channel = struct.pack("<HH", 1, 1) + text(b"/truth") + text(b"cdr") + struct.pack("<I", 0)
    payload = b"\0\1\0\0" + struct.pack("<I", size) + bytes(size)
    payload = zstandard.compress(payload) if singly else payload
    inside = record(3, schema) + record(4, channel) + record(5, struct.pack("<HIQQ", 1, 0, 0, 0) + payload)
    packed = zstandard.compress(inside)
    chunk = record(
        6, struct.pack("<QQQII", 0, 0, len(inside), 0, 4) + b"zstd" + struct.pack("<Q", len(packed)) + packed
    )
    path.write_bytes(b"\x89MCAP0\r\n" + record(1, text(b"ros2") + text(b"some tool")) + chunk * chunks)
    return path


HOSTILE: dict[str, Callable[[Path], Path]] = {
    "schema that doubles 40 times": lambda path: typed(path, chain(40, 2)),
    "schema 3000 deep": lambda path: typed(path, chain(3000, 1)),
    "length of 5000 digits": lambda path: typed(path, f"float64[{'9' * 5000}] x"),
    "array of 2^40": lambda path: typed(path, f"float64[{1 << 40}] x"),
    "arrays of arrays": lambda path: typed(
        path, "B[1000] b\n" + "=" * 80 + "\nMSG: a/B\nC[1000] c\n" + "=" * 80 + "\nMSG: a/C\nfloat64[1000] x"
    ),
    "sequence of nothing": lambda path: typed(
        path, "B[] b\n" + "=" * 80 + "\nMSG: a/B\n", bytes(4) + struct.pack("<I", 4_000_000) + bytes(4_000_000)
    ),
    "field twice": lambda path: typed(path, "float64 x\nfloat64 x"),
    "field of the reader": lambda path: typed(
        path,
        f"builtin_interfaces/Time stamp\nfloat64 log_ns\nfloat64 stamp_ns\n{TIME}", bytes(4 + 24),
    ),
    "name of a type with escapes": lambda path: typed(path, "float64 x", bytes(12), kind=f"a/msg/{ESCAPE}"),
    "topic with escapes": lambda path: typed(path, "float64 x", bytes(12), f"/{ESCAPE}\nok   forged"),
    "topic of 5000 letters": lambda path: typed(path, "float64 x", bytes(12), "/" + "a" * 5000),
    "topic that climbs": lambda path: typed(path, "float64 x", bytes(12), "/../../etc/x"),
    "notes with escapes": lambda path: noted(path, outcome=f"{ESCAPE}\nok", seed="\x9b31m"),
    "bomb of 240 MB": lambda path: bomb(path, 60 << 20, 4),
    "bomb of 240 MB in single messages": lambda path: bomb(path, 60 << 20, 4, singly=True),
    "empty": lambda path: in_one_file(path, []),
    **{
        f"text on {topic}": lambda path, topic=topic: flight(path, other_type(topic))
        for topic in (
            "/truth", "/reference", "/attitude_setpoint", "/wrench_setpoint", "/actuation", "/disturbance",
            "/flight/plan", "/flight/events", "/flight/state", "/flight/parameters",
            "/attitude_controller/internals", "/position_controller/internals",
        )
    },
    "nan": lambda path: flight(path, number=float("nan")),
    "infinite": lambda path: flight(path, number=float("inf")),
    "nan inside": lambda path: flight(path, number=float("nan"), of="internals"),
    "infinite inside": lambda path: flight(path, number=float("inf"), of="internals"),
    "1e300 inside": lambda path: flight(path, number=1e300, of="internals"),
    "1e300": lambda path: flight(path, number=1e300),
    "stamps of the far past": lambda path: flight(path, stamped(-(1 << 31), 0)),
    "stamps of the far future": lambda path: flight(path, stamped((1 << 31) - 1, 0xFFFFFFFF)),
}  # fmt: skip

LONGEST = 10.0  # s
LARGEST = 1_000_000  # kB of memory in all
CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")
VERBS = {
    "info": [],
    "metrics": [],
    "check": ["--limits", "position_rmse=1"],
    "hash": [],
    "export": ["--out", "csv"],
    "replay": [],
    "report": ["--out", "report"],
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


@pytest.mark.parametrize(("verb", "singly"), [("metrics", False), ("info", False), ("info", True)])
def test_a_bomb_stays_within_memory(verb, singly, tmp_path):
    bag = bomb(tmp_path / "bomb.mcap", 60 << 20, 40, singly)
    assert bag.stat().st_size < 300_000
    # a child's rusage begins with what its parent had
    script = (
        "import sys; from quad_report.cli import main; code = main(sys.argv[1:]); "
        "print(*[line for line in open('/proc/self/status') if line.startswith('VmHWM')]); sys.exit(code)"
    )
    began = cpu_time()
    done = subprocess.run([sys.executable, "-c", script, verb, str(bag)], capture_output=True, text=True, check=False)
    assert done.returncode == 2, done.stderr
    assert "unpack" in done.stderr
    assert int(done.stdout.split()[1]) < LARGEST
    assert cpu_time() - began < LONGEST
