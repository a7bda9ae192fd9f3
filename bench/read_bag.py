"""Reading a long bag to arrays: quad_flight_log beside rosbags, in turn, in one run.

    python bench/read_bag.py                    10 minutes, 5 topics, 500 Hz, three rounds
    python bench/read_bag.py --minutes 1 --rounds 1 --keep DIR

Both read every field of every message of the five topics into NumPy arrays; ours verifies every checksum besides. The
values are compared. Prints a table; exit code 1 if ours is slower or a value differs.
"""

import argparse
import statistics
import struct
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from quad_flight_log.bag.reader import open_flight
from quad_flight_log.bag.writer import BACKLOG_LIMIT, BagWriter

RATE = 500
PERIOD_NS = 1_000_000_000 // RATE
MESSAGES = Path(__file__).resolve().parents[1] / "src" / "quad_msgs" / "msg"
# Topic: type, and how many float64 stand behind stamp and steps.
TOPICS = {
    "/state": ("quad_msgs/msg/VehicleState", 13),
    "/truth": ("quad_msgs/msg/VehicleState", 13),
    "/estimate": ("quad_msgs/msg/VehicleState", 13),
    "/reference": ("quad_msgs/msg/TrajectoryPoint", 19),
    "/attitude_setpoint": ("quad_msgs/msg/AttitudeThrust", 15),
}
HAS_NEXT_STEP = ("/reference", "/attitude_setpoint")


def write_bag(directory: Path, minutes: float) -> int:
    """Write the bag and return the number of messages."""
    rng = np.random.default_rng(1)
    bag = BagWriter(directory)
    steps = round(minutes * 60 * RATE)
    handles = {topic: bag.add_topic(topic, kind) for topic, (kind, _) in TOPICS.items()}
    blocks = {topic: rng.normal(size=(1000, count)).cumsum(axis=0) for topic, (_, count) in TOPICS.items()}
    for step in range(steps):
        stamp = step * PERIOD_NS
        head = struct.pack("<IiIQ", 0x0100, *divmod(stamp, 1_000_000_000), step)
        for topic, handle in handles.items():
            more = struct.pack("<Q", step + 1) if topic in HAS_NEXT_STEP else b""
            bag.write(handle, head + more + blocks[topic][step % 1000].tobytes(), stamp)
        while bag.backlog > BACKLOG_LIMIT // 2:
            time.sleep(0.01)
    report = bag.close()
    if report.error or report.dropped:
        sys.exit(f"read_bag: {report.error or f'{report.dropped} messages dropped'}")
    return report.messages


def read_ours(directory: Path) -> dict[str, dict[str, np.ndarray]]:
    """Read with quad_flight_log."""
    tables = open_flight(directory).arrays(*TOPICS)
    skipped = ("log_ns", "stamp_ns", "stamp")
    return {
        topic: {name: table[name] for name in table.dtype.names or () if name not in skipped}
        for topic, table in tables.items()
    }


def read_rosbags(directory: Path) -> dict[str, dict[str, np.ndarray]]:
    """Read with rosbags."""
    store = get_typestore(Stores.ROS2_JAZZY)
    for path in sorted(MESSAGES.glob("*.msg")):
        store.register(get_types_from_msg(path.read_text(), f"quad_msgs/msg/{path.stem}"))
    fields = {
        topic: [name for name, _ in store.fielddefs[kind][1] if name != "stamp"] for topic, (kind, _) in TOPICS.items()
    }
    columns: dict[str, dict[str, list[Any]]] = {topic: {name: [] for name in names} for topic, names in fields.items()}
    appends = {topic: [(name, content[name].append) for name in fields[topic]] for topic, content in columns.items()}
    with Reader(directory) as reader:
        for connection, _, raw in reader.messages():
            message = store.deserialize_cdr(raw, connection.msgtype)
            for name, append in appends[connection.topic]:
                append(getattr(message, name))
    return {topic: {name: np.array(rows) for name, rows in content.items()} for topic, content in columns.items()}


def timed(read, directory: Path):
    """Return (seconds, result) of reading."""
    began = time.perf_counter()
    found = read(directory)
    return time.perf_counter() - began, found


def differences(ours, theirs) -> list[str]:
    """Return the fields whose values are not equal."""
    return [
        f"{topic} {name}"
        for topic, content in theirs.items()
        for name, values in content.items()
        if not np.array_equal(ours[topic][name], values)
    ]


def main() -> int:
    """Run the comparison; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=10.0, help="length of the bag (default: 10)")
    parser.add_argument("--rounds", type=int, default=3, help="how often each reads it (default: 3)")
    parser.add_argument(
        "--keep", type=Path, metavar="DIR", help="write the bag here and keep it; read it if it is there"
    )
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        directory = options.keep or Path(folder, "bag")
        if not directory.exists():
            print(f"writing {options.minutes:g} min ...", file=sys.stderr)
            write_bag(directory, options.minutes)
        times: dict[str, list[float]] = {"quad_flight_log": [], "rosbags": []}
        wrong: list[str] = []
        for number in range(options.rounds):
            print(f"round {number + 1} of {options.rounds} ...", file=sys.stderr)
            mine, ours = timed(read_ours, directory)
            other, theirs = timed(read_rosbags, directory)
            times["quad_flight_log"].append(mine)
            times["rosbags"].append(other)
            wrong = wrong or differences(ours, theirs)
            count = sum(len(next(iter(content.values()))) for content in ours.values())
            del ours, theirs
    ratios = [other / mine for mine, other in zip(times["quad_flight_log"], times["rosbags"], strict=True)]
    print(f"{count} messages on {len(TOPICS)} topics")
    for name, values in times.items():
        median = statistics.median(values)
        print(f"{name.ljust(16)} {median:8.2f} s  {count / median / 1e3:8.0f} thousand messages/s")
    print(f"speed against rosbags (median of paired rounds): {statistics.median(ratios):.2f} x")
    for name in wrong:
        print(f"DIFFERS: {name}")
    return 1 if wrong or statistics.median(ratios) < 1.0 else 0


if __name__ == "__main__":
    sys.exit(main())
