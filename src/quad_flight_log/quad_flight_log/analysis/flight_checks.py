"""Whether a flight counts: one table of checks of its bag, whatever its metrics, and the limits that it was held to.

A check finds a fault in the bag alone, in words, or nothing. ``fly``, ``log check`` and a report's verdict ask for all.
Times in the words are flight times in s. Bags of flights without a guard (controllers ``printed``) are not held to the
guard's envelope: they show what the law does.
"""

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_core.cascade import SIGNALS, SIMULATOR
from quad_core.flight_parameters import LOCKSTEP
from quad_core.guard_parameters import GuardParameters
from quad_core.parameter_files import load_yaml
from quad_core.records import builder, flattener, leaves
from quad_flight_log.analysis.arrays import Floats, by_stamp, missing_messages, norms
from quad_flight_log.analysis.metrics import METRICS, FlightMetrics
from quad_flight_log.analysis.recorded_parameters import recorded_parameters
from quad_flight_log.analysis.tables import autopilot_lands, flight_tables, text_table, truth_topic, unusable_messages
from quad_flight_log.analysis.takeovers import takeovers
from quad_flight_log.bag.messages import Table
from quad_flight_log.bag.payload_hash import step_rows
from quad_flight_log.bag.reader import Flight
from quad_flight_log.errors import FlightLogError
from quad_flight_log.recorder.provenance import LIMIT, STOPPED

IDENTIFIED = ("flight/state", "flight/nodes", "flight/guard", "flight/mode")
"""Topics whose messages name the run of their sender."""

SILENCE = 0.5  # s without the flown path in real time: as long as the guard tolerates no state at all
STRAY = 2.5  # m beyond all that was commanded
STOPPED_SHARE = 0.05  # of the largest thrust of the flight: below it the motors count as stopped
STOPPED_TIME = 0.1  # s
_OVER = (2, 3)  # flight/state: ended, failed


class Flown(NamedTuple):
    """A bag and what several rules need of it: its tables, whether a guard flew along, with which parameters."""

    flight: Flight
    tables: dict[str, Table]
    guard: GuardParameters

    @property
    def failed(self) -> bool:
        """Whether the recorder noted another end than the planned one."""
        return self.flight.metadata.get("outcome", "ended") != "ended"


def failed_checks(flight: Flight) -> list[str]:
    """Return what speaks against a flight apart from its metrics, one line each, in the order of CHECKS.

    Raises FlightLogError as the metrics do where the bag cannot be read.
    """
    flown = Flown(flight, flight_tables(flight), _guard_of(flight))
    return [fault for check in CHECKS if (fault := check(flown))]


def ends_early(flight: Flight) -> bool:
    """Return whether a bag ends before its flight: it is cut, or its recorder was stopped."""
    return flight.truncated or flight.metadata.get("reason") == STOPPED


def run_ids(flown: Flown) -> str:
    """Name the runs of the bag if there are two or more; an empty id is no run."""
    known = {flown.flight.metadata.get("run_id", "")}
    for topic in IDENTIFIED:
        if flown.flight.has(topic):
            table = flown.flight.array(topic)
            if "run_id" in (table.dtype.names or ()):
                known |= {str(name) for name in table["run_id"]}
    known.discard("")
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
    leaning = _longest(times, 1.0 - 2.0 * (x * x + y * y) < np.cos(limit.large))
    parts = []
    if leaning.time > limit.large_time:
        parts.append(
            f"tilt above {np.degrees(limit.large):.0f} deg for {leaning.time:.2f} s from {leaning.begin:.2f} s on"
        )
    commanded = truth["p_w"][:1]
    if "reference" in flown.tables:
        commanded = np.concatenate([commanded, flown.tables["reference"]["p_w"]])
        beyond = _beyond(truth["p_w"], commanded)
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
        still = _longest(times, (thrust < STOPPED_SHARE * actuation["thrust"].max()) & (height > limit))
        if still.time > STOPPED_TIME:
            return f"motors stopped {still.begin:.2f} s after the start, above {limit:g} m, for {still.time:.2f} s"
    has_to_be_down = "flight/mode" in flown.tables or flown.failed
    if autopilot_lands(flight) and (flown.failed or _has_landed(flight)):
        return ""  # it, or its pilot, has the vehicle; its own detector knows the ground better than its estimate
    if height[-1] > limit and has_to_be_down and not ends_early(flown.flight):
        return f"the flight ended with the vehicle {height[-1]:.2f} m above the ground: motors stopped in the air"
    return ""


def _has_landed(flight: Flight) -> bool:
    """Return whether the autopilot's own detector saw the ground at the end."""
    return flight.has("flight/autopilot") and bool(flight.array("flight/autopilot")["landed"][-1])


def recorded_end(flown: Flown) -> str:
    """Say that the bag ends before the flight, and where: how the flight ended is not known from it."""
    if not ends_early(flown.flight) or not flown.flight.has("flight/state") or "truth" not in flown.tables:
        return ""
    states = flown.flight.array("flight/state")
    if "state" not in (states.dtype.names or ()) or states["state"][-1] in _OVER:
        return ""
    at = int(flown.tables["truth"]["stamp_ns"].max()) * 1e-9
    return f"the bag ends at {at:.2f} s, before the flight: what came after is not recorded"


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


CHECKS = (
    run_ids,
    equal_stamps,
    missing_steps,
    recorded_beginning,
    numbers,
    envelope,
    stopped_motors,
    recorded_end,
    infeasible_reference,
    guard_in_command,
)
"""Each returns the fault that a bag shows, or nothing."""


class Judgement(NamedTuple):
    """What speaks against a flight, one line each, and the limits {metric: largest value} that it was held to."""

    problems: tuple[str, ...]
    limits: Mapping[str, float]

    @property
    def good(self) -> bool:
        """Whether the flight counts."""
        return not self.problems

    @property
    def text(self) -> str:
        """The judgement in one line."""
        if self.problems:
            return "Failed: " + "; ".join(self.problems)
        limits = (f"{name} at most {limit:g} {METRICS[name].unit}".rstrip() for name, limit in self.limits.items())
        listed = ", ".join(limits)
        if not listed:
            return "Ended as planned, held to no limits"
        return f"Good: ended as planned, within its limits ({listed})"


def judgement(flight: Flight, metrics: FlightMetrics, limits: Mapping[str, float] | None = None) -> Judgement:
    """Return the judgement on a flight by ``limits``, by default those that the bag notes; raises FlightLogError."""
    noted = [f"{name}={flight.metadata[LIMIT + name]}" for name in METRICS if LIMIT + name in flight.metadata]
    limits_used = read_limits(noted) if limits is None else limits
    problems = [f"the bag is cut ({flight.damage})"] if flight.truncated else []
    outcome = flight.metadata.get("outcome", "unknown")  # a recorder of others notes none
    if outcome not in ("ended", "unknown"):
        problems.append(flight.metadata.get("reason", "") or f"the flight did not end as planned: {outcome}")
    problems += failed_checks(flight)
    for name, limit in limits_used.items():
        value = getattr(metrics, name)
        if value is None or value > limit:
            found = "not available" if value is None else f"{value:.4g}"
            problems.append(f"{name}: found {found}, expected at most {limit:g} {METRICS[name].unit}")
    return Judgement(tuple(problems), limits_used)


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
                content = load_yaml(Path(argument).read_text(encoding="utf-8"))
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


class _Spell(NamedTuple):
    """The longest time in s in which something held without a break, and when it began."""

    begin: float
    time: float


def _longest(times: Floats, holds: NDArray[np.bool_]) -> _Spell:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], holds, [False]]).astype(np.int8)))
    begins, ends = edges[::2], edges[1::2] - 1
    if len(begins) == 0:
        return _Spell(0.0, 0.0)
    lengths = times[ends] - times[begins]
    at = int(lengths.argmax())
    return _Spell(float(times[begins[at]]), float(lengths[at]))


def _beyond(places: Floats, commanded: Floats) -> Floats:
    """Return how far in m each of ``places`` lies outside the box around ``commanded``."""
    low, high = commanded.min(axis=0), commanded.max(axis=0)
    return norms(np.maximum(np.maximum(low - places, places - high), 0.0))


def _in_lockstep(flight: Flight) -> bool:
    """Return whether the flight was timed in lockstep, as its recorder or its simulator's parameters say."""
    noted = flight.metadata.get("mode") or _owners_parameters(flight).get("flight.mode")
    return noted in ("lockstep", LOCKSTEP)


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
