"""The verdict on a flight (``judgement``): two tables of checks of its bag, and the limits of its metrics.

A check finds a fault in the bag alone, in words, or nothing. What RECORD finds leaves the verdict unknown: the bag is
no whole record of one flight. What CHECKS finds is a failed flight. ``fly`` and every command of ``log`` ask for them.
Times in the words are flight times in s. Bags of flights without a guard (controllers ``printed``) are not held to the
guard's envelope: they show what the law does.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_analysis.arrays import Floats, by_stamp, missing_messages, norms
from quad_analysis.directions import wrong_directions
from quad_analysis.metrics import METRICS, FlightMetrics
from quad_analysis.tables import (
    autopilot_lands,
    flight_tables,
    recorded_parameters,
    rows_of,
    takeovers,
    text_table,
    truth_topic,
    unusable_messages,
)
from quad_core.cascade import COMMANDER, SIGNALS, SIMULATOR
from quad_core.enumerations import FlightClock, FlightPhase
from quad_core.node_parameters import GuardParameters
from quad_core.parameter_files import load_yaml_file
from quad_core.records import builder, flattener, leaves
from quad_flight_log.errors import FlightLogError
from quad_flight_log.messages import Table
from quad_flight_log.notes import BENCH, LIBRARY, LIMIT, STEP, STOPPED
from quad_flight_log.payload_hash import step_rows
from quad_flight_log.reader import Flight

SILENCE = 0.5  # s without the flown path in real time: as long as the guard tolerates no state at all
STRAY = 2.5  # m beyond all that was commanded
STOPPED_SHARE = 0.05  # of the largest thrust of the flight: below it the motors count as stopped
STOPPED_TIME = 0.1  # s
EVIDENCE = ("reference", "actuation", "flight/guard", "flight/parameters")
"""Topics of every flight that a verdict needs in addition to the flown path and ``flight/state``."""


class LastState(NamedTuple):
    """The last ``flight/state`` of a bag: whether the flight was over, how, why, and at which flight time in s."""

    is_over: bool
    failed: bool
    reason: str
    time: float


class Flown(NamedTuple):
    """A bag and what several rules need of it: its tables, whether a guard flew along, with which parameters.

    ``last``: None where the bag does not hold how the flight stood.
    """

    flight: Flight
    tables: dict[str, Table]
    guard: GuardParameters
    last: LastState | None

    @property
    def failed(self) -> bool:
        """Whether the recorder or the vehicle interface noted another end than the planned one."""
        noted = self.flight.metadata.get("outcome", "ended") != "ended"
        return noted or (self.last is not None and self.last.failed)


def failed_checks(flight: Flight, checks: Sequence["Check"] = ()) -> list[str]:
    """Return what ``checks``, by default all, find against a flight apart from its metrics, one line each, in order.

    Raises FlightLogError as the metrics do where the bag cannot be read.
    """
    return _found(flown_of(flight), checks or (*RECORD, *CHECKS))


def flown_of(flight: Flight) -> Flown:
    """Return a bag with what the checks need of it; raises as ``failed_checks``."""
    return Flown(flight, flight_tables(flight), _guard_of(flight), last_state(flight))


def _found(flown: Flown, checks: Sequence["Check"]) -> list[str]:
    return [fault for check in checks if (fault := check(flown))]


def last_state(flight: Flight) -> LastState | None:
    """Return the last ``flight/state`` by its stamp; None without any."""
    table = rows_of(flight, "flight/state", ("state", "reason", "stamp_ns"))
    last = max(((int(row["stamp_ns"]), int(row["state"]), str(row["reason"])) for row in table), default=None)
    if last is None:
        return None
    stamp, state, reason = last
    return LastState(
        state in (FlightPhase.ENDED, FlightPhase.FAILED), state == FlightPhase.FAILED, reason, stamp * 1e-9
    )


def ends_early(flight: Flight) -> bool:
    """Return whether a bag ends before its flight: it is cut, its recorder was stopped, or no end is in it."""
    last = last_state(flight)
    return flight.truncated or flight.metadata.get("reason") == STOPPED or last is None or not last.is_over


def whole_file(flown: Flown) -> str:
    """Say where the bag is cut, or which file it lacks."""
    return f"the bag is cut ({flown.flight.damage})" if flown.flight.truncated else ""


def run_ids(flown: Flown) -> str:
    """Name the runs of the bag if there are two or more, by their numbers where no id tells them; 0 is no run."""
    known = {flown.flight.metadata.get("run_id", "")}
    known |= {str(row["run_id"]) for row in rows_of(flown.flight, "flight/nodes", ("run_id",))}
    known.discard("")
    if len(known) < 2:
        known = {str(row["run"]) for row in rows_of(flown.flight, "flight/state", ("run",))} - {"0"}
    return f"messages of {len(known)} runs: {', '.join(map(repr, sorted(known)))}" if len(known) > 1 else ""


def equal_stamps(flown: Flown) -> str:
    """Name the topics on which two different messages carry one stamp; a bit-identical repeat does not count."""
    known = [topic for topic in SIGNALS if flown.flight.has(topic)]
    stamped = [topic for topic in known if "stamp_ns" in (flown.flight.array(topic).dtype.names or ())]
    counts = {
        topic: sum(one[0] == other[0] and one != other for one, other in pairwise(rows))
        for topic, rows in step_rows(flown.flight, stamped).items()
    }
    found = [f"{topic}: {count}" for topic, count in counts.items() if count]
    return f"different messages with equal stamps ({', '.join(found)}): more than one sender" if found else ""


def missing_steps(flown: Flown) -> str:
    """Name the topics that lack messages in lockstep; in real time say when the flown path has a gap of SILENCE.

    A flight that failed may lack some.
    """
    if flown.failed:
        return ""
    if _in_lockstep(flown.flight):
        lost = missing_messages({name: by_stamp(table) for name, table in flown.tables.items()})
        listed = ", ".join(f"{topic}: {count}" for topic, count in lost.items() if count)
        return f"missing messages ({listed})" if listed else ""
    times = by_stamp(flown.tables["truth"])["stamp_ns"] * 1e-9 if "truth" in flown.tables else np.zeros(1)
    gaps = np.diff(times)
    if not (gaps > SILENCE).any():
        return ""
    at = int(gaps.argmax())
    return f"nothing of the vehicle for {gaps[at]:.2f} s from {times[at]:.2f} s on"


def recorded_beginning(flown: Flown) -> str:
    """Say that the bag begins in flight, and where: stamps of a flight begin at 0."""
    begin = float(flown.tables["truth"]["stamp_ns"].min()) * 1e-9 if "truth" in flown.tables else 0.0
    return f"the bag begins at {begin:.2f} s of the flight: what came before is not recorded" if begin > SILENCE else ""


def numbers(flown: Flown) -> str:
    """Say how many messages of the flown path cannot be numbers of a flight: where it went then is not known."""
    topic = truth_topic(flown.flight)
    count = unusable_messages(flown.flight).get(topic, 0)
    return f"{topic}: {count} messages with a number that is not finite or absurd" if count else ""


def envelope(flown: Flown) -> str:
    """Say when the vehicle first leaned, or strayed, farther than a flight under the guard may."""
    if "truth" not in flown.tables or not flown.guard.enabled:
        return ""
    truth = by_stamp(flown.tables["truth"])
    times = truth["stamp_ns"] * 1e-9
    limit = flown.guard.tilt
    x, y = truth["q_wb"][:, 0], truth["q_wb"][:, 1]
    begin, long = _longest(times, 1.0 - 2.0 * (x * x + y * y) < np.cos(limit.large))
    parts = []
    if long > limit.large_time:
        parts.append(f"tilt above {np.degrees(limit.large):.0f} deg for {long:.2f} s from {begin:.2f} s on")
    if "reference" in flown.tables:
        places = truth["p_w"]
        commanded = np.concatenate([places[:1], flown.tables["reference"]["p_w"]])
        beyond = norms(places - places.clip(commanded.min(axis=0), commanded.max(axis=0)))  # the box around it
        if beyond.max() > STRAY:
            at = times[int(np.argmax(beyond > STRAY))]
            parts.append(f"{beyond.max():.3g} m outside of all that was commanded, from {at:.2f} s on")
    return f"the vehicle left its envelope: {'; '.join(parts)}" if parts else ""


def stopped_motors(flown: Flown) -> str:
    """Say when the motors stood still in the air, or that a flight which had to land ended above the ground."""
    if "truth" not in flown.tables or not flown.guard.enabled:
        return ""
    flight, limit = flown.flight, flown.guard.contact.stop_height
    # the ground is where it is, not where an estimate has it
    truth = by_stamp(flight.array("truth") if flight.has("truth") else flown.tables["truth"])
    by_estimate = autopilot_lands(flight) and not flight.has("truth")
    ground = truth["p_w"][0, 2] if by_estimate and len(truth) else flown.guard.ground_height
    times, height = truth["stamp_ns"] * 1e-9, truth["p_w"][:, 2] - ground
    if "actuation" in flown.tables:
        actuation = by_stamp(flown.tables["actuation"])
        thrust = np.interp(times, actuation["stamp_ns"] * 1e-9, actuation["thrust"])
        begin, long = _longest(times, (thrust < STOPPED_SHARE * actuation["thrust"].max()) & (height > limit))
        if long > STOPPED_TIME:
            return f"motors stopped {begin:.2f} s after the start, above {limit:g} m, for {long:.2f} s"
    has_to_be_down = "flight/mode" in flown.tables or flown.failed
    landed = flight.has("flight/autopilot") and bool(flight.array("flight/autopilot")["landed"][-1])
    if autopilot_lands(flight) and (flown.failed or landed):
        return ""  # it, or its pilot, has the vehicle; its own detector knows the ground better than its estimate
    if height[-1] > limit and has_to_be_down and not ends_early(flown.flight):
        return f"the flight ended with the vehicle {height[-1]:.2f} m above the ground: motors stopped in the air"
    return ""


def recorded_end(flown: Flown) -> str:
    """Say that the bag ends before the flight, and where, or that it does not hold how the flight ended."""
    if "truth" not in flown.tables:
        return "neither truth nor state in the bag: where the vehicle flew is not recorded"
    if flown.last is None:
        return "no flight/state in the bag: how the flight ended is not recorded"
    at = int(flown.tables["truth"]["stamp_ns"].max()) * 1e-9
    if flown.last.is_over and (flown.failed or at > flown.last.time - SILENCE):
        return ""
    return f"the bag ends at {at:.2f} s, before the flight: what came after is not recorded"


def missing_topics(flown: Flown) -> str:
    """Name the topics that a verdict needs and that a recorder of others left out; ours records all that there is."""
    flight = flown.flight
    if flight.written_by.startswith(LIBRARY):
        return ""
    roles = text_table(flight, "flight/parameters")["role"] if flight.has("flight/parameters") else ()
    needed = (*EVIDENCE, "flight/mode") if COMMANDER in roles else EVIDENCE
    listed = ", ".join(topic for topic in needed if not flight.has(topic))
    return f"not recorded: {listed}" if listed else ""


def infeasible_reference(flown: Flown) -> str:
    """Return what the position controller said of a reference that asked for more than the vehicle has."""
    if not flown.flight.has("flight/events"):
        return ""
    events = text_table(flown.flight, "flight/events")
    said = events[events["kind"] == "infeasible_reference"]
    if not len(said):
        return ""
    text, at = said["text"][0], said["stamp_ns"][0] * 1e-9
    return f"the reference asked for more than the vehicle has: {text}, at {at:.2f} s"


def guard_in_command(flown: Flown) -> str:
    """Name the times in which the guard flew; a flight that failed says by itself why."""
    found = () if flown.failed else takeovers(flown.flight)
    return "; ".join(f"the guard took over at step {one.step} ({one.mode}): {one.reason}" for one in found)


def step_is_flown(flown: Flown) -> str:
    """Say why a first flight in steps does not count: wrong directions on the bench, else that it never took off."""
    step = flown.flight.metadata.get(STEP, "")
    if not step or not flown.flight.has("state"):
        return ""
    if step == BENCH:
        return wrong_directions(flown.flight)
    stayed = flown.flight.array("state")["on_ground"].all()
    return f"step {step}: the vehicle did not leave the ground" if stayed else ""


Check = Callable[[Flown], str]

RECORD: tuple[Check, ...] = (
    whole_file,
    run_ids,
    equal_stamps,
    missing_steps,
    recorded_beginning,
    numbers,
    recorded_end,
    missing_topics,
)
"""Each returns why the bag is no whole record of one flight, or nothing."""

CHECKS: tuple[Check, ...] = (envelope, stopped_motors, infeasible_reference, guard_in_command, step_is_flown)
"""Each returns the fault that a flight shows, or nothing."""


class Judgement(NamedTuple):
    """What speaks against a flight, one line each, and the limits {metric: largest value} that it was held to.

    ``problems``: faults of the flight. ``unknown``: what its bag does not tell.
    """

    problems: tuple[str, ...]
    unknown: tuple[str, ...]
    limits: Mapping[str, float]

    @property
    def verdict(self) -> str:
        """``good``, ``failed`` or ``unknown``."""
        return "failed" if self.problems else "unknown" if self.unknown else "good"

    @property
    def text(self) -> str:
        """The judgement in one line."""
        if self.verdict != "good":
            return f"{self.verdict.capitalize()}: " + "; ".join(self.problems + self.unknown)
        limits = (f"{name} at most {limit:g} {METRICS[name].unit}".rstrip() for name, limit in self.limits.items())
        listed = ", ".join(limits)
        if not listed:
            return "Ended as planned, held to no limits"
        return f"Good: ended as planned, within its limits ({listed})"


def judgement(flight: Flight, metrics: FlightMetrics, limits: Mapping[str, float] | None = None) -> Judgement:
    """Return the judgement on a flight by ``limits``, by default those that the bag notes; raises FlightLogError."""
    noted = [f"{name}={flight.metadata[LIMIT + name]}" for name in METRICS if LIMIT + name in flight.metadata]
    limits_used = read_limits(noted) if limits is None else limits
    flown, problems = flown_of(flight), list[str]()
    unknown = _found(flown, RECORD)
    if flown.failed:
        reason = flight.metadata.get("reason", "") or (flown.last.reason if flown.last is not None else "")
        problems.append(reason or f"the flight did not end as planned: {flight.metadata.get('outcome', 'failed')}")
    problems += _found(flown, CHECKS)
    for name, limit in limits_used.items():
        value = getattr(metrics, name)
        expected = f"expected at most {limit:g} {METRICS[name].unit}"
        if value is not None and value > limit:
            problems.append(f"{name}: found {value:.4g}, {expected}")
        elif value is None:
            never = name == "settling_time" and metrics.position_rmse is not None
            (problems if never else unknown).append(f"{name}: found not available, {expected}")
    return Judgement(tuple(problems), tuple(unknown), limits_used)


def read_limits(arguments: Sequence[str]) -> dict[str, float]:
    """Return {metric: largest allowed value} of ``KEY=VALUE`` arguments and YAML files of such pairs; later ones win.

    Raises FlightLogError naming file or argument and what is wrong.
    """
    limits: dict[str, float] = {}
    for argument in arguments:
        name, equals, value = argument.partition("=")
        content: object = {name: value}
        if not equals or Path(argument).exists():
            try:
                content = load_yaml_file(Path(argument))
            except (OSError, ValueError) as error:
                raise FlightLogError(f"{argument}: cannot be read: {' '.join(str(error).split())}") from error
        if not isinstance(content, dict):
            raise FlightLogError(f"{argument}: found {type(content).__name__}, expected a map of metric to limit")
        for name, limit in content.items():
            if name not in METRICS:
                raise FlightLogError(f"{argument}: {name!r} is no metric; there are {', '.join(METRICS)}")
            try:
                limits[name] = float("nan" if isinstance(limit, bool) else limit)
            except (TypeError, ValueError, OverflowError):
                limits[name] = math.nan
            if not math.isfinite(limits[name]):
                raise FlightLogError(f"{argument}: {name}: found {limit!r}, expected a finite number")
    return limits


def _longest(times: Floats, holds: NDArray[np.bool_]) -> tuple[float, float]:
    """Return when what ``holds`` began to hold for the longest time without a break, and that time, both in s."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], holds, [False]]).astype(np.int8)))
    begins, ends = times[edges[::2]], times[edges[1::2] - 1]
    at = int((ends - begins).argmax()) if len(begins) else -1
    return (0.0, 0.0) if at < 0 else (float(begins[at]), float(ends[at] - begins[at]))


def _in_lockstep(flight: Flight) -> bool:
    """Return whether the flight was timed in lockstep, as its recorder or its simulator's parameters say."""
    noted = flight.metadata.get("mode") or _owners_parameters(flight).get("flight.mode")
    return noted in ("lockstep", FlightClock.LOCKSTEP)


def _guard_of(flight: Flight) -> GuardParameters:
    """Return the guard's parameters as recorded; defaults for what the bag lacks, or has as no finite number."""
    recorded, defaults = _owners_parameters(flight), flattener(GuardParameters)(GuardParameters())
    numbers = []
    for leaf, default in zip(leaves(GuardParameters), defaults, strict=True):
        value = recorded.get(f"guard.{leaf.name}", default)
        numbers.append(value if isinstance(value, int | float) and np.isfinite(value) else default)
    found: GuardParameters = builder(GuardParameters)(numbers)
    return found


def _owners_parameters(flight: Flight) -> Mapping[str, Any]:
    """Return the recorded parameters of the vehicle interface; empty where the bag lacks them."""
    try:
        return recorded_parameters(flight)[SIMULATOR].values
    except (FlightLogError, KeyError):
        return {}
