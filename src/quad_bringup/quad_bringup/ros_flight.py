"""One flight: five processes in a domain, watched to their end, judged by the bag."""

import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from quad_analysis.flight_checks import ends_early, judgement
from quad_analysis.metrics import FlightMetrics
from quad_analysis.tables import measured, truth_note
from quad_analysis.text import table
from quad_bringup import one_process, surroundings
from quad_bringup.processes import Processes, describe_exit, executable
from quad_bringup.supervisor import Interrupted, Interrupts, Outcome, Patience, Supervisor
from quad_bringup.terminal import Progress, busy, complain, say
from quad_core.cascade import ROLES, SHADOWS, SIMULATOR, VEHICLE_INTERFACES
from quad_core.cycle import seconds
from quad_core.resolution import Resolved
from quad_flight.set_up import parameter_file, summary
from quad_flight_log.errors import FlightLogError, TopicError
from quad_flight_log.notes import LIMITS, STEPPED
from quad_flight_log.reader import open_flight
from quad_msgs.msg import FlightState
from quad_node.codec import stamp_ns
from quad_node.executor import STARTER
from quad_node.watch import NO_FILES, PHASES, FlightWatch, is_over

GOOD, FAILED, BAD_SETUP = 0, 1, 2


class Planned(NamedTuple):
    """One flight, checked and ready to start.

    ``vehicle``, ``preset``: as they were asked for. ``limits``: {metric: largest value}; ``own``: {role: its command}.
    ``step``: what the bag notes of a first flight in steps (``notes.STEPPED``).
    """

    name: str
    vehicle: str
    preset: str
    directory: Path
    run_id: str
    namespace: str
    nodes: dict[str, Resolved]
    limits: dict[str, float]
    one_process: bool = False
    own: Mapping[str, Sequence[str]] = {}
    step: str = ""


def fly(flight: Planned, domain: int, interrupted: Interrupts) -> int:
    """Fly ``flight`` in ``domain``, print what its bag shows, and return the exit code."""
    about = summary(flight.nodes)
    plant = "named below" if SIMULATOR in flight.own else about["plant"]
    say(
        f"{flight.name}: {about['position']} + {about['attitude']}, preset {flight.preset}, vehicle {flight.vehicle}, "
        f"plant {plant}, start {about['start']}, {about['mode']}, seed {about['seed']}"
    )
    for role, command in flight.own.items():
        say(f"{flight.name}: {role}: {shlex.join(command)} (with this flight's parameters)")
    say(f"{flight.name}: bag {flight.directory}, ROS_DOMAIN_ID={domain}")
    logs = flight.directory / "logs"
    logs.mkdir()
    limits = ",".join(f"{metric}={limit!r}" for metric, limit in flight.limits.items())
    # A process that crashes, or hangs and is aborted, leaves in its log where it was.
    own = {"ROS_DOMAIN_ID": str(domain), "PYTHONFAULTHANDLER": "1", STARTER: str(os.getpid())}
    own |= {LIMITS: limits, STEPPED: flight.step}
    processes = Processes(logs, {**os.environ, **own})
    progress = Progress(flight.name, sys.stderr)
    patience = Patience.of(flight.nodes[SIMULATOR])
    watch = None
    try:
        _start(processes, flight, logs / "parameters.yaml")
        # after the nodes, which take longer to start than it does
        watch = _watch(flight, domain)
        supervisor = Supervisor(processes, watch, patience, interrupted, _named(flight, SIMULATOR))
        outcome = supervisor.run(partial(_show, progress, watch))
    finally:
        progress.close()
        if watch is not None:
            watch.close()
        processes.stop(patience.landing)
        if watch is None or (interrupted.name and not any(flight.directory.glob("*.mcap*"))):
            shutil.rmtree(logs)  # nothing was recorded: the directory stays free for another try
    if not logs.exists():
        cause = outcome.cause or f"interrupted by {interrupted.name}"
        complain(f"{flight.name}: {cause} before anything was recorded")
        return FAILED
    interrupted.flying = False  # a large bag takes its time, and a signal ends that
    try:
        return _judge(flight, processes, outcome, watch.newest)
    except Interrupted as name:
        interrupted.names.append(str(name))
        complain(f"{flight.name}: interrupted by {name} while its bag was read; scripts/log check {flight.directory}")
        return FAILED
    finally:
        interrupted.flying = True


def _show(progress: Progress, watch: FlightWatch, state: FlightState | None) -> None:
    while watch.news:
        progress.tell(*watch.news.popleft())
    progress.show(state)


def _watch(flight: Planned, domain: int) -> FlightWatch:
    try:
        return FlightWatch(flight.run_id, domain, flight.namespace)
    except RuntimeError as error:  # rclpy's own
        raise surroundings.refusal_of_ros(domain, error) from error


def _named(flight: Planned, role: str) -> str:
    """Return what a role is called: a vehicle interface by its own name."""
    name = Path(flight.own.get(role, [role])[0]).name
    return name if name in VEHICLE_INTERFACES else role


def _start(processes: Processes, flight: Planned, parameters: Path) -> None:
    interfaces = tuple(VEHICLE_INTERFACES) if SIMULATOR in flight.own else ()
    parameters.write_text(parameter_file(flight.nodes, flight.namespace, interfaces), encoding="utf-8")
    arguments = [*NO_FILES, "--params-file", str(parameters)]
    if flight.namespace:
        arguments += ["-r", f"__ns:=/{flight.namespace}"]
    composed = set(ROLES) if flight.one_process else set()
    if composed:
        processes.start(one_process.NAME, [sys.executable, "-m", one_process.__name__, *arguments])
    for role in flight.nodes:
        if role in composed:
            continue
        name = ["-r", f"__node:={role}"] if role in SHADOWS else []
        processes.start(role, started(flight.own.get(role, [executable(role)]), [*arguments, *name]))


def started(command: Sequence[str | Path], arguments: Sequence[str]) -> list[str | Path]:
    """Return ``command`` with a flight's ROS ``arguments`` before its own, for of two values the later one counts."""
    own = command.index("--ros-args") if "--ros-args" in command else len(command)
    return [*command[:own], *arguments, *command[own:]]


def _judge(flight: Planned, processes: Processes, outcome: Outcome, seen: FlightState | None) -> int:
    """Print the table and what went wrong; returns the exit code. ``seen``: the last news of the flight itself."""
    with busy(f"{flight.name}: reading the bag"):
        text, found, unknown, early = shown(flight)
    for role, code in processes.codes.items():
        if code == BAD_SETUP and (not text or role in SHADOWS):  # of a flight that began it is how a node ended
            complain(processes.last_lines(role, 1)[0] if processes.last_lines(role, 1) else f"{role}: bad set-up")
            return BAD_SETUP
    if text:
        say(text)
    problems = ([outcome.cause] if outcome.cause else []) + found
    verdict = "failed" if problems else "unknown" if unknown else "good"
    problems += unknown if text or not problems else []  # of a flight that never began all of it is unknown
    if (found or unknown) and surroundings.is_full(flight.directory):
        problems.append(f"{flight.directory}: No space left on device")
    if outcome.cause.startswith("interrupted") or not text:
        # What was not flown cannot be measured, and that is no fault of the flight.
        problems = [problem for problem in problems if "found not available" not in problem]
    ends = {role: f"{_named(flight, role)} {describe_exit(code)}" for role, code in processes.codes.items()}
    bad = [role for role, code in processes.codes.items() if code]
    if not problems:
        problems = [ends[role] for role in bad if role not in (*SHADOWS, *outcome.late)]
        verdict = "failed" if problems else "good"
    if early and seen is not None and is_over(seen):
        until = seconds(stamp_ns(seen.stamp), 1)
        problems.insert(0, f"the flight itself went on to {until:.2f} s: {seen.reason or PHASES[seen.state]}")
    lines = [
        f"{_named(flight, role)} hung while it left, after the flight had ended, and was stopped"
        for role in outcome.late
    ]
    lines += [f"{ends[role]}; the flight does not depend on it" for role in set(bad) & set(SHADOWS)]
    for line in (*lines, *problems):
        complain(f"{flight.name}: {line}")
    for role, end in ends.items():
        if role in outcome.late or any(end in problem for problem in problems):  # its log says why
            for line in processes.last_lines(role, 3):
                complain(f"{role}: {line}")
    say(f"{flight.name}: {verdict}")
    bag = shlex.quote(str(flight.directory))
    say(f"{flight.name}: next: scripts/log report {bag}   (or info, metrics, play)")
    return FAILED if problems else GOOD


def shown(flight: Planned) -> tuple[str, list[str], list[str], bool]:
    """Return what the bag of ``flight`` shows: text, empty if it never began, why it failed, what it does not tell.

    Last, whether it ends before the flight.
    """
    try:
        bag = open_flight(flight.directory, namespace=flight.namespace)
        try:
            metrics = measured(bag)
        except TopicError:  # it never began: its record tells why, and there is nothing to measure
            metrics = FlightMetrics()
        judged = judgement(bag, metrics, flight.limits)
        problems, unknown = list(judged.problems), list(judged.unknown)
        note = truth_note(bag)
        states: Any = bag.array("flight/state") if bag.has("flight/state") else ()
    except FlightLogError as error:
        return "", [f"no readable bag: {error}"], [], False
    if not len(states) or not (stamp := states[-1]["stamp_ns"]):
        return "", problems, unknown, ends_early(bag)
    flown, wall = float(stamp) * 1e-9, float(states[-1]["wall_time"])
    measured_any = any(value is not None for value in metrics)
    rows = table([flight.name], [metrics], flight.limits, notes=[note])
    text = f"{rows if measured_any else f'{flight.name}: no metrics: {note}'}\n"
    text += f"seed {flight.nodes[SIMULATOR].flight.seed}; {flown:.2f} s flown"
    text += f" at {flown / wall if wall > 0.0 else 0.0:.2f} x real time; {PHASES.get(states[-1]['state'], 'unknown')}"
    return text, problems, unknown, ends_early(bag)


_GOODBYE = 8.0  # s in which it reads the end of the bag and tells the browsers


@contextmanager
def viewed(bag: Path, *, wanted: bool) -> Iterator[None]:
    """Show in the browser what is recorded into ``bag`` while the context lasts; nothing unless ``wanted``.

    A process of its own, of low priority, that reads the growing bag: no node notices it.
    """
    if not wanted:
        yield
        return
    command = ["nice", sys.executable, "-m", "quad_report.cli", "view", "--live", str(bag)]
    # its own session: Ctrl-C ends the flight, and the view with it
    with subprocess.Popen(command, stdin=subprocess.DEVNULL, start_new_session=True) as process:
        try:
            yield
            if any(bag.glob("*.mcap*")):
                with suppress(subprocess.TimeoutExpired):
                    process.wait(_GOODBYE)
        finally:
            process.terminate()
