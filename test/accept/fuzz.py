"""Every command of `log` on drawn bags, changed from field to file: no traceback, no hang, one line of complaint."""

import contextlib
import io
import os
import random
import resource
import shutil
import signal
import struct
import tempfile
import time
import traceback
import warnings
from collections import Counter
from functools import cache
from pathlib import Path

import drawn_flights
import flight_samples
from mcap.writer import CompressionType, Writer

from quad_report import cli

LONGEST = 20  # s of computing for one verb
MEMORY = 4 << 30  # bytes
ALWAYS = ("info", "metrics --json", "check --limits position_rmse=1", "hash --topics", "export --out OUT/csv", "replay")
SELDOM = ("report --out OUT/report",)  # with each eighth bag
NUMBERS = [0.0, -0.0, 5e-324, 1e308, -1e300, float("nan"), float("inf"), float("-inf"), 1.0]
COUNTS = [0, 1, 2**31, 2**32 - 1, 999_999_999]
TEXTS = ["", "\x1b[31m", "\n", "a" * 5000, "../../x", "NaN", "1e999", "state", "\0", "\ud800", "ä\u202e"]
# without byte, which is unsigned in ROS 2 and which rosbags reads as signed
BASES = ["float64", "float32", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "bool"]
BASES += ["string", "char", "builtin_interfaces/Time", "wstring", "a/B"]
FORMS = ["", "", "", "[]", "[3]", "[<=4]", "[0]", "[1000]"]
TIME = "=" * 80 + "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
KEYS = ["outcome", "seed", "limit.position_rmse", "plant_period_ns", "namespace", "mode", "run_id", *TEXTS]
PARAMETERS = ["", "simulator: {ros__parameters: {flight.seed: 7}}\n", "a: [", "- 1", *TEXTS]
LOG_TIMES = [0, 1, 10**9, 2**63 - 1, 2**63, 2**64 - 1]


@cache
def whole_flight():
    """Return {topic: (type, definition, payloads)} of a short flight."""
    found = {}
    for name, message in drawn_flights.messages(drawn_flights.tables(60)):
        kind = message.__msgtype__
        _, _, payloads = found.setdefault(name, (kind, flight_samples.definition(kind).text, []))
        payloads.append(flight_samples.encoded(message))
    return found


def of_made_up_types(draw):
    """Return {topic: [type, definition, payloads]} whose payloads are random bytes behind the head of a message."""
    topics = {}
    for _ in range(draw.randint(1, 3)):
        lines = [f"{draw.choice(BASES)}{draw.choice(FORMS)} f{index}" for index in range(draw.randint(0, 6))]
        lines[:0] = draw.choice([[], ["builtin_interfaces/Time stamp"]])
        inner = draw.choice(["float64 x\nstring s\n", "uint8 u\nfloat64[2] y\n", ""])
        definition = "\n".join(lines) + "\n" + TIME + "=" * 80 + "\nMSG: a/B\n" + inner
        payloads = [b"\0\1\0\0" + draw.randbytes(draw.randint(0, 80)) for _ in range(draw.randint(0, 12))]
        topics[draw.choice(["/t0", "/t1", "/truth", "/state", "/reference", "/flight/events"])] = [
            "a/msg/A",
            definition,
            payloads,
        ]
    return topics


def poke(draw, topics):
    """Change one payload."""
    payloads = topics[draw.choice(sorted(topics))][2]
    if not payloads:
        return
    index = draw.randrange(len(payloads))
    payload = bytearray(payloads[index])
    at = draw.randint(0, len(payload))
    eighth = 4 + (at - 4) // 8 * 8
    payload[:], again = draw.choice(
        [
            (payload[:at] + draw.randbytes(draw.randint(1, 4)) + payload[at + 1 :], []),
            (payload[:eighth] + struct.pack("<d", draw.choice(NUMBERS)) + payload[eighth + 8 :], []),
            (payload[:at] + struct.pack("<I", draw.choice(COUNTS)) + payload[at + 4 :], []),
            (payload[:at], []),
            (payload + draw.randbytes(draw.randint(0, 12)), []),
            (draw.choice([b"\0\0", b"\0\7", b"\xff\xff"]) + payload[2:], []),
            (payload, [bytes(payload)]),
        ]
    )
    payloads[index : index + 1] = [*again, bytes(payload)]


def retype(draw, topics):
    """Change a line of a definition."""
    topic = topics[draw.choice(sorted(topics))]
    lines = topic[1].splitlines()
    at = draw.randint(0, max(0, len(lines) - 1))
    line = f"{draw.choice(BASES)}{draw.choice(['', '[]', '[7]'])} {draw.choice(['x', 'stamp', 'step', 'p_w'])}"
    lines[at : at + draw.randint(0, 1)] = draw.choice([[], [line], lines[at : at + 1] * 2, ["?"]])
    topic[1] = "\n".join(lines)


def rename(draw, topics):
    """Give a topic another name, perhaps that of another one."""
    new = draw.choice([*whole_flight(), *(f"/{text}" for text in TEXTS)])
    topics.setdefault(new, topics.pop(draw.choice(sorted(topics))))


def mix(draw, topics):
    """Let two topics change type, definition or payloads."""
    first, second, place = draw.choice(sorted(topics)), draw.choice(sorted(topics)), draw.randint(0, 2)
    topics[first][place], topics[second][place] = topics[second][place], topics[first][place]


def thin(draw, topics):
    """Cut, turn, thin or repeat the messages of a topic."""
    payloads = topics[draw.choice(sorted(topics))][2]
    several = payloads[: draw.randint(0, len(payloads))], payloads[::-1], payloads[draw.randint(1, 3) :: 2]
    payloads[:] = draw.choice([*several, payloads[:1] * len(payloads)])


def write(draw, path):
    """Write a bag: a flight or made-up types, with up to six changes, and perhaps with damage of the file."""
    flight = {name: [kind, text, list(payloads)] for name, (kind, text, payloads) in whole_flight().items()}
    topics = draw.choice([flight, of_made_up_types(draw)])
    for _ in range(draw.randint(0, 6)):
        draw.choice([poke, poke, poke, retype, rename, mix, thin])(draw, topics)
    options = {name: draw.choice([True, False]) for name in ("use_chunking", "enable_crcs", "enable_data_crcs")}
    chunks = {"chunk_size": draw.choice([50, 2000, 1 << 20]), "compression": draw.choice(list(CompressionType))}
    with path.open("wb") as stream:
        writer = Writer(stream, **options, **chunks)
        writer.start("ros2", "some tool")
        writer.add_metadata("quad", {draw.choice(KEYS): draw.choice(TEXTS) for _ in range(draw.randint(0, 4))})
        if parameters := draw.choice(PARAMETERS).encode("utf-8", "surrogatepass"):
            writer.add_attachment(0, 0, "parameters.yaml", "application/yaml", parameters)
        for name, (kind, text, payloads) in topics.items():
            schema = writer.register_schema(kind, "ros2msg", text.encode("utf-8", "surrogatepass"))
            channel = writer.register_channel(name, "cdr", schema, {})
            for index, payload in enumerate(payloads):
                when = draw.choice(LOG_TIMES) if draw.random() < 0.01 else index * 1000
                writer.add_message(channel, when, payload, index)
        writer.finish()
    data = bytearray(path.read_bytes())
    for _ in range(draw.choice([0, 0, 1, 2, 3])):
        at = draw.randint(0, len(data))
        data[at : draw.choice([at, at + 1, len(data)])] = draw.randbytes(draw.randint(0, 9))
    path.write_bytes(data)


class HangError(BaseException):
    """A verb computes for too long."""


def hung(_number, _frame):
    raise HangError


def told(words, bag, out):
    """Return (exit code, stdout, stderr) of a verb, or what it raised as one line."""
    verb, *rest = words.replace("OUT", str(out)).split()
    said, complained = io.StringIO(), io.StringIO()
    signal.setitimer(signal.ITIMER_VIRTUAL, LONGEST)
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(complained), warnings.catch_warnings():
            warnings.simplefilter("default")
            code = cli.main([verb, str(bag), *rest])
    except HangError:
        return f"hang: more than {LONGEST} s", "", ""
    except BaseException as error:
        frame = traceback.extract_tb(error.__traceback__)[-1]
        return f"{type(error).__name__}: {str(error)[:100]} at {Path(frame.filename).name}:{frame.lineno}", "", ""
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
    return code, said.getvalue(), complained.getvalue()


def problem_of(words, code, said, complained):
    """Return what is wrong with how a verb ended."""
    if code not in (0, 1, 2):
        return f"{words}: {code}"
    lines = len(complained.splitlines())
    if lines != (1 if code == 2 else 0):
        return f"{words}: exit code {code} with {lines} lines of complaint: {complained[:200]!r}"
    if "\x1b" in said + complained:
        return f"{words}: an escape byte"
    return ""


def run(figures):
    kept, kinds, runs = Path(tempfile.mkdtemp(prefix="fuzz-found-")), {}, Counter()
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, resource.RLIM_INFINITY))
    signal.signal(signal.SIGVTALRM, hung)
    os.nice(19 - os.nice(0))
    until = time.monotonic() + figures.seconds(1800.0)
    while time.monotonic() < until:
        draw = random.Random(runs["drawn"])
        runs["drawn"] += 1
        bag, out = figures.folder / "bag.mcap", figures.folder / "out"
        shutil.rmtree(out, ignore_errors=True)
        out.mkdir()
        try:
            write(draw, bag)
        except (UnicodeEncodeError, OverflowError, ValueError, struct.error):  # what cannot be written is no bag
            continue
        runs["bags"] += 1
        for words in (*ALWAYS, *([draw.choice(SELDOM)] if runs["bags"] % 8 == 0 else [])):
            runs[words.split()[0]] += 1
            problem = problem_of(words, *told(words, bag, out))
            if problem and problem not in kinds:
                kinds[problem] = shutil.copy(bag, kept / f"found-{len(kinds)}.mcap")
    figures.show(f"{runs['bags']} bags: {dict(runs)}")
    for kind, file in kinds.items():
        figures.check(False, f"{kind} ({file})")
    figures.check(not kinds, f"tracebacks, hangs and lines too many: {len(kinds)} kinds, 0 wanted")
    if not kinds:
        kept.rmdir()
