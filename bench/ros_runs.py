"""One measured run of the flight stack or of the bare relay, in processes of their own."""

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from diagnostic_msgs.msg import DiagnosticArray
from mcap.reader import make_reader
from rclpy.serialization import deserialize_message

from quad_bringup.processes import Processes, executable
from quad_bringup.surroundings import reserved_domain
from quad_core.cascade import ATTITUDE, POSITION, RECORDER, SIMULATOR, TRAJECTORY
from quad_flight.set_up import Request, parameter_file, resolve_flight
from quad_node.watch import ENDED, FAILED, FLYING, FlightWatch

ROLES = (SIMULATOR, TRAJECTORY, POSITION, ATTITUDE, RECORDER)
TICK = os.sysconf("SC_CLK_TCK")


class Run(NamedTuple):
    """Steps done, wall time of them in s, CPU time of them in s per process.

    Real time: ``latency`` {quantile: ms from a state to its wrench at the simulator}, ``missed`` commands.
    """

    steps: int
    wall: float
    cpu: dict[str, float]
    latency: Mapping[str, float] = {}
    missed: int = 0

    @property
    def rate(self) -> float:
        """Cycles per second."""
        return self.steps / self.wall

    @property
    def cpu_per_cycle(self) -> float:
        """CPU time of one cycle over all processes, microseconds."""
        return 1e6 * sum(self.cpu.values()) / self.steps


def cpu_time(pids: Mapping[str, int]) -> dict[str, float]:
    """Return user and system time of processes in s."""
    found = {}
    for role, pid in pids.items():
        fields = Path(f"/proc/{pid}/stat").read_text("ascii").rpartition(")")[2].split()
        found[role] = (int(fields[11]) + int(fields[12])) / TICK
    return found


def spent(before: Mapping[str, float], after: Mapping[str, float]) -> dict[str, float]:
    """Return the CPU time between two looks."""
    return {role: after[role] - before[role] for role in before}


def relay(steps: int, one_process: bool = False, record: bool = False) -> Run:
    """Run the bare relay; with ``record`` its recorder writes a bag as that of the stack does."""
    script = Path(__file__).with_name("relay.py")
    roles = ("all",) if one_process else ROLES
    with tempfile.TemporaryDirectory(prefix="quad-bench-") as scratch, reserved_domain(None) as domain:
        more = ["--record", f"{scratch}/bag"] if record else []
        environment = {**os.environ, "ROS_DOMAIN_ID": str(domain)}
        started = {
            role: subprocess.Popen(
                [
                    sys.executable,
                    str(script),
                    role,
                    "--steps",
                    str(steps),
                    *(more if role in ("all", RECORDER) else []),
                ],
                env=environment,
                stdout=subprocess.PIPE,
            )
            for role in roles
        }
        try:
            news = started[roles[0]].stdout
            assert news is not None
            pids = {role: process.pid for role, process in started.items()}
            json.loads(news.readline())
            before = cpu_time(pids)
            report = json.loads(news.readline())
            others = {role: pid for role, pid in pids.items() if role not in (SIMULATOR, "all")}
            after = {**before, **cpu_time(others)}
            after[roles[0]] = _final(started[roles[0]])
        finally:
            for process in started.values():
                process.terminate()
            for process in started.values():
                process.wait()
    return Run(report["steps"], report["wall"], spent(before, after))


def stack(request: Request, one_process: bool = False, timeout: float = 300.0) -> Run:
    """Fly ``request`` with the real nodes; raises RuntimeError if it does not end well."""
    with tempfile.TemporaryDirectory(prefix="quad-bench-") as scratch, reserved_domain(None) as domain:
        logs = Path(scratch, "logs")
        logs.mkdir()
        run_id = f"bench-{os.getpid()}-{time.monotonic_ns()}"
        identity = {"/**": {"flight.run_id": run_id}, RECORDER: {"directory": str(Path(scratch, "bag"))}}
        nodes = resolve_flight(request, identity)
        parameters = logs / "parameters.yaml"
        parameters.write_text(parameter_file(nodes), encoding="utf-8")
        processes = Processes(logs, {**os.environ, "ROS_DOMAIN_ID": str(domain)})
        watch = FlightWatch(run_id, domain)
        arguments = ["--ros-args", "--params-file", str(parameters)]
        try:
            if one_process:
                processes.start("all", [sys.executable, "-m", "quad_bringup.one_process", *arguments])
            else:
                for role in nodes:
                    processes.start(role, [executable(role), *arguments])
            run = _watched(processes, watch, timeout)
            deadline = time.monotonic() + 20.0
            while processes.running() and time.monotonic() < deadline:
                processes.reap()
                time.sleep(0.05)
        finally:
            watch.close()
            processes.stop()
        if not request.realtime:
            return run
        latency, missed = _real_time(next(Path(scratch, "bag").glob("*.mcap")), run.rate)
        return run._replace(latency=latency, missed=missed)


def idle(seconds: float) -> dict[str, float]:
    """Return the share of a core that each node takes while it waits for a flight: all but the simulator run."""
    with tempfile.TemporaryDirectory(prefix="quad-bench-") as scratch, reserved_domain(None) as domain:
        logs = Path(scratch, "logs")
        logs.mkdir()
        processes = Processes(logs, {**os.environ, "ROS_DOMAIN_ID": str(domain)})
        try:
            for role in ROLES[1:]:
                more = ["-p", f"directory:={scratch}/bag"] if role == RECORDER else []
                processes.start(role, [executable(role), *(["--ros-args", *more] if more else [])])
            time.sleep(8.0)
            before = cpu_time(processes.pids())
            time.sleep(seconds)
            used = spent(before, cpu_time(processes.pids()))
        finally:
            processes.stop()
    return {role: value / seconds for role, value in used.items()}


def _real_time(bag: Path, rate: float) -> tuple[dict[str, float], int]:
    """Return what the simulator said of its loop in /diagnostics: median over the seconds, and all missed commands.

    ``p99.9`` is told by the largest of each second of ``rate`` steps: that share of them is below it.
    """
    said: dict[str, list[float]] = {}
    with bag.open("rb") as stream:
        for _, _, message in make_reader(stream).iter_messages(["/diagnostics"]):
            for status in deserialize_message(message.data, DiagnosticArray).status:
                for pair in status.values:
                    if pair.key.startswith("latency_") or pair.key == "missed_commands":
                        said.setdefault(pair.key.removeprefix("latency_"), []).append(float(pair.value))
    missed = said.pop("missed_commands")[-1]
    largest = sorted(said["max"])
    rare = largest[round(0.999**rate * (len(largest) - 1))]
    return {**{key: statistics.median(values) for key, values in said.items()}, "p99.9": rare}, int(missed)


def _watched(processes: Processes, watch: FlightWatch, timeout: float) -> Run:
    deadline = time.monotonic() + timeout
    before: dict[str, float] = {}
    while time.monotonic() < deadline:
        seen = watch.poll(0.2)
        if seen is not None and seen.state == FLYING and not before:
            before = cpu_time(processes.pids())
        if seen is not None and seen.state == ENDED:
            return Run(seen.step + 1, seen.wall_time, spent(before, cpu_time(processes.pids())))
        if seen is not None and seen.state == FAILED:
            raise RuntimeError(f"the flight failed: {seen.reason}")
        processes.reap()
        if not processes.running():
            break
    raise RuntimeError(f"the flight did not end: {processes.codes}")


def _final(process: "subprocess.Popen[bytes]") -> float:
    # the relay's simulator leaves by itself: its whole time comes from the kernel
    _, _, usage = os.wait4(process.pid, 0)
    process.returncode = 0
    return usage.ru_utime + usage.ru_stime
