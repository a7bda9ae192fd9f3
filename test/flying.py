"""Flights over real processes for the tests: start them, wait for them, read them."""

import fcntl
import math
import os
import re
import signal
import struct
import subprocess
import sys
import termios
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
from ament_index_python.packages import get_package_prefix
from mcap.exceptions import McapError
from mcap.records import Message
from mcap.stream_reader import StreamReader
from rclpy.context import Context
from rclpy.node import Node

from quad_core import cascade
from quad_flight_log.payload_hash import payload_hash
from quad_flight_log.reader import Flight, open_flight

ROOT = Path(__file__).resolve().parents[1]
CONFIG = ROOT / "src" / "quad_flight" / "quad_flight" / "config"
FLY = Path(get_package_prefix("quad_bringup"), "lib", "quad_bringup", "fly")
LONGEST = 120.0
PATIENT = ("--set", "simulator.guard.command.lost_age=10.0", "--set", "flight.setpoint_timeout=10.0")
"""In real time: a busy machine may starve a controller for longer than the guard's 50 ms, and 300 ms of the owner's."""
LOW = ("--set", "trajectory.hover.position.z=0.8")
"""A hover from which a landing takes little time."""
AT_ONCE = ("--start", "printed", "--limits", "position_rmse=9")
"""Without the 3 s that bring the vehicle to its reference."""
_FLYING_BYTES = 200_000

ROLES = {role: kind.package for role, kind in cascade.ROLES.items()}


def executable(role: str) -> str:
    """Return what `ros2 run` would start for ``role``."""
    return str(Path(get_package_prefix(ROLES[role]), "lib", ROLES[role], role))


def start(*arguments: str | Path, **options) -> subprocess.Popen[str]:
    """Start `fly` with ``arguments``; the caller waits."""
    command = [str(FLY), *map(str, arguments)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)


def finish(process: subprocess.Popen[str], patience: float = LONGEST) -> subprocess.CompletedProcess[str]:
    """Return how ``process`` ended, interrupting it after ``patience`` s."""
    try:
        out, err = process.communicate(timeout=patience)
    except subprocess.TimeoutExpired:
        process.terminate()
        out, err = process.communicate(timeout=30)
        raise AssertionError(f"no end after {patience:g} s\n{out}\n{err}") from None
    return subprocess.CompletedProcess(process.args, process.returncode, out, err)


@contextmanager
def terminal() -> Iterator[tuple[int, dict[str, Any]]]:
    """Yield what ends a terminal when it is closed, and the options that start a process on it, which heeds SIGHUP."""

    def take() -> None:
        fcntl.ioctl(slave, termios.TIOCSCTTY, 0)
        signal.signal(signal.SIGHUP, signal.SIG_DFL)  # also where nohup has started the tests

    master, slave = os.openpty()
    try:
        on_it = dict.fromkeys(("stdin", "stdout", "stderr"), slave)
        yield master, {**on_it, "start_new_session": True, "preexec_fn": take}
    finally:
        os.close(slave)


def fly(*arguments: str | Path, **options) -> subprocess.CompletedProcess[str]:
    """Fly to the end."""
    return finish(start(*arguments, **options))


def flown(*arguments: str | Path) -> Flight:
    """Return the bag of a flight that must go well; ``arguments`` hold --out DIR."""
    done = fly(*arguments)
    assert done.returncode == 0, done.stdout + done.stderr
    return open_flight(Path(arguments[arguments.index("--out") + 1]))


@contextmanager
def stranger(domain: int, name: str = "stranger") -> Iterator[Node]:
    """Give a node of its own in ``domain``; it is gone afterwards, whatever the test found."""
    context = Context()
    rclpy.init(args=[], context=context, domain_id=domain)
    node = Node(name, context=context, enable_rosout=False, start_parameter_services=False)
    try:
        yield node
    finally:
        node.destroy_node()
        context.try_shutdown()


def hash_of(directory: Path) -> str:
    """Return the payload hash of a bag directory."""
    return payload_hash(open_flight(directory))


def children(pid: int) -> list[int]:
    """Return the pids of the processes that ``pid`` started and that still run."""
    path = Path(f"/proc/{pid}/task/{pid}/children")
    return [int(word) for word in path.read_text().split()] if path.exists() else []


def alive(pid: int) -> bool:
    """Return whether a process runs; a zombie does not."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except (FileNotFoundError, ProcessLookupError):
        return False
    return state != "Z"


def wait_until(condition, patience: float, what: str) -> None:
    """Poll ``condition`` until it is true; fails with ``what`` after ``patience`` s."""
    deadline = time.monotonic() + patience
    while not condition():
        assert time.monotonic() < deadline, f"not within {patience:g} s: {what}"
        time.sleep(0.05)


@contextmanager
def busy_loops(count: int, longest: float = LONGEST) -> Iterator[None]:
    """Load the machine with ``count`` processes that do nothing but compute, for ``longest`` s at most."""
    text = f"import time\nend = time.monotonic() + {longest}\nwhile time.monotonic() < end: pass"
    loops = [subprocess.Popen([sys.executable, "-S", "-c", text]) for _ in range(count)]
    try:
        yield
    finally:
        for loop in loops:
            loop.kill()
            loop.wait()


def words_of(pid: int) -> list[str]:
    """Return the command line of a process."""
    return [word.decode() for word in Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0")[:-1]]


def environment_of(pid: int) -> dict[str, str]:
    """Return the environment of a process."""
    pairs = (pair.partition(b"=") for pair in Path(f"/proc/{pid}/environ").read_bytes().split(b"\0") if pair)
    return {name.decode(): value.decode() for name, _, value in pairs}


def node_pids(fly_pid: int) -> dict[str, int]:
    """Return {name: pid} of the nodes that a `fly` has started; a shadow controller has a name of its own."""
    found = {}
    for pid in children(fly_pid):
        with suppress(FileNotFoundError, ProcessLookupError):
            words = words_of(pid)
            names = [word.removeprefix("__node:=") for word in words if word.startswith("__node:=")]
            names += [Path(word).name for word in words if Path(word).parent.parent.name == "lib"]
            found.update(dict.fromkeys(names[:1], pid))
    return found


def domain_of(fly_pid: int) -> int:
    """Return the domain of a flight under way."""
    return int(environment_of(node_pids(fly_pid)["simulator"])["ROS_DOMAIN_ID"])


def run_id_of(fly_pid: int) -> str:
    """Return the run id that `fly` has given to its nodes."""
    files = [word for word in words_of(node_pids(fly_pid)["simulator"]) if word.endswith(".yaml")]
    return re.search(r"flight\.run_id: *\W?([\w-]+)", "".join(Path(name).read_text() for name in files))[1]


def bag_file(directory: Path) -> Path:
    """Return the MCAP file in ``directory``, finished or not."""
    files = [*directory.glob("*.mcap"), *directory.glob("*.mcap.part")]
    assert len(files) == 1, files
    return files[0]


def wait_until_flying(process: subprocess.Popen[str], directory: Path, size: int = _FLYING_BYTES) -> dict[str, int]:
    """Return {name: pid} of the nodes once the bag in ``directory`` has more than ``size`` bytes."""

    def fills() -> bool:
        assert process.poll() is None, process.communicate()
        sizes = [path.stat().st_size for path in directory.glob("*.mcap*")]
        return bool(sizes) and sizes[0] > size

    try:
        wait_until(fills, LONGEST, f"a bag that grows in {directory}")
    except AssertionError:
        process.terminate()
        raise
    return node_pids(process.pid)


def last_reception(path: Path) -> float:
    """Return when (s since 1970) the last message of a bag was recorded, as the mcap library reads it."""
    newest = 0
    with path.open("rb") as stream, suppress(McapError, EOFError, struct.error):
        for record in StreamReader(stream).records:
            if isinstance(record, Message):
                newest = max(newest, record.publish_time)
    return newest * 1e-9


def in_domain(domain: int) -> dict[str, str]:
    """Return the environment of processes in a ROS domain."""
    return {**os.environ, "ROS_DOMAIN_ID": str(domain)}


def last_word(flight: Flight, node: str, key: str) -> int:
    """Return what ``node`` (the beginning of its name) said last of ``key`` in /diagnostics, 0 if it never did."""
    values = [
        int(item["value"])
        for row in flight.array("/diagnostics")
        for status in row["status"]
        if status["name"].startswith(node)
        for item in status["values"]
        if item["key"] == key
    ]
    return values[-1] if values else 0


def landing(bag: Flight) -> tuple[float, float, float]:
    """Return height m, speed m/s and tilt deg of the last true state."""
    last = bag.array("truth")[-1]
    x, y = last["q_wb"][:2]
    tilt = math.degrees(math.acos(1.0 - 2.0 * (x * x + y * y)))
    return float(last["p_w"][2]), float(np.linalg.norm(last["v_w"])), tilt


def assert_landed(bag):
    """The vehicle was in the air and its last true state is a soft landing."""
    assert float(bag.array("truth")["p_w"][:, 2].max()) > 0.3
    height, speed, tilt = landing(bag)
    assert height < 0.02
    assert speed < 1.5
    assert tilt < 15.0
