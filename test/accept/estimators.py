"""45 mistakes of an estimator and 12 honest odd ones, in hover and Case 2: refused, landed by name, or flown.

A process stands between the simulator's `odom` and the relay (``estimator``). A mistake is refused before the flight
where it shows there. Otherwise it is named within 0.5 s of the motion that shows it; a wrong twist is taken from the
pose and the flight goes on, a wrong pose is landed, at most 3 m from the reference. An honest stream flies within 1.5
times the error of the clean one. ``--only "^heading.*lockstep"`` takes rows whose name holds it.
"""

import re
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from flying import finish, in_domain, start
from scipy.spatial.transform import Rotation
from spoiled import CHANGES, turned

from quad_bringup.surroundings import reserved_domain
from quad_core.estimator import MISFIT_SHARE, RATE_MISFIT, VELOCITY_MISFIT
from quad_flight_log.reader import open_flight

RELAY = ("--relay", "--set", "odometry_relay.odometry=est/odom")
CASES = {"hover": ("hover", "--duration", "10"), "case2": ("case2", "--duration", "20")}
LONGEST = 400.0  # s for a flight on a busy machine
STREAMS = {
    **{f"{rate} Hz": {"rate": str(rate)} for rate in (250, 120, 100, 60)},
    "jitter of 20 %": {"jitter": "0.2"},
    "5 % lost": {"lost": "0.05"},
    "2 % doubled": {"doubled": "0.02"},
    "2 % swapped": {"swapped": "0.02"},
    "best effort": {"best_effort": "1"},
    "wall clock": {"wall_clock": "1"},
    "a reset of 3 m": {"wrong": "jump", "begins": "4"},
    "all of it at 100 Hz": {"rate": "100", "jitter": "0.2", "lost": "0.05", "doubled": "0.02", "swapped": "0.02"}
    | {"best_effort": "1", "wall_clock": "1"},
}
SHARE = 1.5
NAMED_WITHIN = 0.5  # s
AWAY = ("hover", "--set", "trajectory.hover.yaw=3", "--set", "trajectory.hover.position.x=3", "--duration", "3")
SHORT = ("case2", "--duration", "4")
UP = ("--mission", "takeoff:1.5,hold:3,land")
NAMING = ("wrong_twist", "wrong_pose", "estimator_silent")
REFUSED, LANDED, FLIES = "refused", "landed", "flies"
FARTHEST = 3.0
"""m from the reference, in the horizontal plane, up to where the mistake is named: nobody flies away."""
QUICK = 0.02  # s over which the change of a pose is taken
DOES_NOT_MOVE = "does not move as the wrench says"


class Mistake(NamedTuple):
    """What is wrong with a stream: what becomes of a flight, the words that name it, its faults beside ``wrong``."""

    outcome: str
    words: str
    faults: Mapping[str, str] = MappingProxyType({})
    flights: tuple[tuple[str, ...], ...] = (AWAY, SHORT)


UPRIGHT, ITS_STAMPS = "deg from upright before the flight", "its stamps are of another clock"
MISTAKES = {
    "heading 15": Mistake(FLIES, "hover: good|case2: good|a heading that is off by 1. deg"),
    "heading 45": Mistake(LANDED, f"{DOES_NOT_MOVE}.*a heading that is off by"),
    "heading 90": Mistake(LANDED, f"{DOES_NOT_MOVE}.*a heading that is off by"),
    "heading 180": Mistake(LANDED, f"{DOES_NOT_MOVE}.*a heading that is off by"),
    "heading -90": Mistake(LANDED, f"{DOES_NOT_MOVE}.*a heading that is off by"),
    "pose alone, heading 90": Mistake(LANDED, f"{DOES_NOT_MOVE}.*a heading that is off by", {"pose": "1"}),
    "axes swapped": Mistake(LANDED, f"{DOES_NOT_MOVE}.*x and y of the position swapped"),
    "left-handed": Mistake(LANDED, f"{DOES_NOT_MOVE}.*a left-handed frame, . mirrored"),
    "ned": Mistake(LANDED, "sinks at lift-off", flights=(UP,)),
    "begun in the air, ned": Mistake(LANDED, DOES_NOT_MOVE),
    "from 1 s on, ned": Mistake(LANDED, f"{DOES_NOT_MOVE}|which no vehicle turns", {"begins": "1"}),
    "from 1 s on, frd": Mistake(LANDED, "which no vehicle turns", {"begins": "1"}),
    "ned position": Mistake(LANDED, f"{DOES_NOT_MOVE}.*a position in NED"),
    "mm": Mistake(LANDED, DOES_NOT_MOVE),
    "cm": Mistake(LANDED, f"{DOES_NOT_MOVE}.*a position in cm|{DOES_NOT_MOVE}"),
    "ft": Mistake(LANDED, f"{DOES_NOT_MOVE}.*a position in ft"),
    "wxyz": Mistake(REFUSED, f"{UPRIGHT}.*the order w, x, y, z"),
    "conjugate": Mistake(LANDED, f"{DOES_NOT_MOVE}.*from the world to the body"),
    "on its side": Mistake(REFUSED, UPRIGHT),
    "on its head": Mistake(REFUSED, f"{UPRIGHT}.*an FRD body"),
    "world twist": Mistake(FLIES, "the world frame, expected the body frame", flights=(AWAY,)),
    "zero twist": Mistake(FLIES, "a twist that is not filled in"),
    "sign": Mistake(FLIES, "the wrong sign"),
    "frd twist": Mistake(FLIES, "FRD axes, expected FLU"),
    "degrees": Mistake(FLIES, "twist.angular does not fit"),
    "km/h": Mistake(FLIES, "km/h, expected m/s"),
    "rates of other axes": Mistake(FLIES, "x and y swapped"),
    "pose frozen": Mistake(LANDED, "the same pose since", {"begins": "3", "pose": "1"}),
    "frozen": Mistake(LANDED, "the same pose since", {"begins": "3"}),
    "pose alone, two poses": Mistake(LANDED, "the same poses since", {"begins": "3", "pose": "1"}),
    "two poses": Mistake(LANDED, "the same poses since|does not move as the wrench says", {"begins": "3"}),
    "noisy": Mistake(LANDED, f"{DOES_NOT_MOVE}|the same attitude since", {"begins": "2", "pose": "1"}),
    "silent": Mistake(LANDED, "est/odom: silent since", {"begins": "3"}),
    "latency": Mistake(LANDED, f"{DOES_NOT_MOVE}.*a pose that comes late|the same pose since"),
    "zero stamps": Mistake(REFUSED, "its stamps do not advance"),
    "whole seconds": Mistake(REFUSED, "its stamps do not advance"),
    "another clock": Mistake(REFUSED, f"{ITS_STAMPS}.*stamps=first"),
    "a clock behind": Mistake(REFUSED, ITS_STAMPS),
    "another type": Mistake(REFUSED, "found geometry_msgs/msg/PoseWithCovarianceStamped", {"pose": "2"}),
    "two publishers": Mistake(REFUSED, "one publisher of est/odom, there are 2", {"publishers": "2"}),
    "frame": Mistake(REFUSED, "frame 'odom', expected 'map'"),
    "body frame": Mistake(REFUSED, "frame 'imu', expected 'base_link'"),
    "no attitude": Mistake(REFUSED, "a quaternion that is not of length 1"),
    "not finite": Mistake(REFUSED, "a number that is not finite"),
    "stale first stamp": Mistake(FLIES, "stamps jumped by 1000|: good", {"wall_clock": "1"}, (AWAY,)),
}
"""In lockstep and in real time; a clock that is stale at first is one of real time."""


class Flown(NamedTuple):
    """How a flight through an estimator ended."""

    code: int
    rmse: float
    words: str
    named: float
    """s from the moment a mistake shows to the event that names it, NaN without either."""
    away: float
    """m: the largest distance from the reference before that, in the horizontal plane."""


def flown(figures, flight, faults, clock=("--realtime",)):
    """Fly the words ``flight`` of fly on the estimator with ``faults`` ({key of Faults: text})."""
    bag = figures.folder / re.sub(r"[^\w-]+", "_", " ".join([*flight, *sum(faults.items(), ()), *clock]))
    stamps = ("--set", "odometry_relay.stamps=first") if faults.get("wall_clock") == "1" else ()
    with reserved_domain(None) as domain:
        pass
    process = start(*flight, *RELAY, *clock, *stamps, "--domain", str(domain), "--out", bag)
    words = [f"{key}={value}" for key, value in faults.items()]
    program = [sys.executable, str(Path(__file__).with_name("estimator.py")), *words]
    estimator = subprocess.Popen(program, env=in_domain(domain))
    try:
        done = finish(process, LONGEST)
    finally:
        estimator.kill()
        estimator.wait()
    said, named, away = done.stdout + done.stderr, np.nan, 0.0
    if any(bag.glob("*.mcap")) and (recorded := open_flight(bag)).has("truth"):
        events, truth = recorded.array("flight/events"), recorded.array("truth")
        naming = [row["stamp_ns"] for row in events if row["kind"] in NAMING]
        shows = shown_from(truth, faults.get("wrong", ""))
        named = 1e-9 * float(naming[0] - shows) if naming and shows is not None else np.nan
        away = farthest(recorded, max(naming, default=np.inf))
    rmse = re.search(r"^position_rmse +([\d.e-]+)", said, re.MULTILINE)
    return Flown(done.returncode, float(rmse[1]) if rmse else np.nan, said, named, away)


def farthest(recorded, until):
    """Return the largest horizontal distance of the truth from the reference up to the stamp ``until``."""
    truth, reference = recorded.array("truth"), recorded.array("reference")
    if not len(reference):
        return 0.0
    truth = truth[truth["stamp_ns"] <= until]
    at = np.searchsorted(reference["stamp_ns"], truth["stamp_ns"], "right") - 1
    return float(np.linalg.norm((truth["p_w"] - reference["p_w"][at])[:, :2], axis=1).max(initial=0.0))


def shown_from(truth, wrong):
    """Return the stamp from which on twist and change of pose differ by more than the relay tolerates, or None."""
    if wrong not in CHANGES or len(truth) < 3:
        return None
    rows = []
    for row in truth:
        v_b = turned(row["v_w"], row["q_wb"], inverse=True)
        rows.append(CHANGES[wrong](row["p_w"], row["q_wb"], np.array(v_b), np.array(row["omega_b"])))
    p, q, v, w = (np.array(part, dtype=float) for part in zip(*rows, strict=True))
    every = max(1, round(QUICK / 1e-9 / (truth["stamp_ns"][1] - truth["stamp_ns"][0])))
    elapsed = 1e-9 * (truth["stamp_ns"][every:] - truth["stamp_ns"][:-every])[:, None]
    attitude = Rotation.from_quat(q)
    moves = (p[every:] - p[:-every]) / elapsed
    turns = (attitude[:-every].inv() * attitude[every:]).as_rotvec() / elapsed
    claimed = attitude.apply(v)[every // 2 :][: len(moves)], w[every // 2 :][: len(moves)]
    shows = np.zeros(len(moves), dtype=bool)
    for found, seen, limit in zip(claimed, (moves, turns), (VELOCITY_MISFIT, RATE_MISFIT), strict=True):
        size = np.linalg.norm(seen, axis=1)
        shows |= np.linalg.norm(found - seen, axis=1) > limit + MISFIT_SHARE * size
    return truth["stamp_ns"][every:][shows.argmax()] if shows.any() else None


def last_words(words):
    """Return how a flight ended: good, or the first line that speaks against it."""
    lines = [line for line in re.split(r"[\r\n]+", words) if re.match(r"(fly: )?(hover|case2): ", line)]
    against = [
        line for line in lines if not re.search(r": (next|bag|starting|waiting|failed|good|\[|aibs|[\d.]+ s)", line)
    ]
    against.sort(key=lambda line: not line.startswith("fly: "))
    return (against or [line for line in lines if line.endswith("good")] or [words.strip()[-120:]])[0][:200]


def fly_streams(figures):
    """Fly both cases on each honest stream."""
    for case, words in CASES.items():
        rows = {name: f"{name} {case}" for name in STREAMS if figures.wants(f"{name} {case}")}
        if not rows:
            continue
        clean = flown(figures, words, {})
        figures.check(clean.code == 0, f"{case}, clean, 500 Hz: {1e3 * clean.rmse:.2f} mm, {last_words(clean.words)}")
        for name, row in rows.items():
            seen = flown(figures, words, STREAMS[name])
            kept = seen.code == 0 and seen.rmse <= SHARE * clean.rmse
            now = f"{1e3 * seen.rmse:.2f} mm, {seen.rmse / clean.rmse:.2f} of clean, limit {SHARE}"
            figures.check(kept, f"{row} | {now}; exit code {seen.code}, {last_words(seen.words)}")


def fly_mistakes(figures):
    """Fly each mistake in each case by each clock; NED a take-off, for only lifting shows it."""
    for name, mistake in MISTAKES.items():
        wrong = name.rpartition(", ")[2]
        for clock, by in ((), "lockstep"), (("--realtime",), "real time"):
            if "wall_clock" in mistake.faults and not clock:
                continue
            for flight in mistake.flights:
                row = f"{name} {flight[0].removeprefix('--')} {by}"
                if figures.wants(row):
                    judge(figures, row, mistake, flown(figures, flight, {"wrong": wrong, **mistake.faults}, clock))


def judge(figures, row, mistake, seen):
    """Print what became of one mistake."""
    named = re.search(mistake.words, seen.words)
    kept = bool(named) and (seen.code == 0) == (mistake.outcome == FLIES) and not seen.named > NAMED_WITHIN
    kept = kept and seen.away <= FARTHEST
    now = f"{mistake.outcome}, exit code {seen.code}, {seen.away:.2f} m away, {named[0][:90] if named else 'NOT NAMED'}"
    now += f", {seen.named:.2f} s after it shows" if seen.named == seen.named else ""
    figures.check(kept, f"{row} | {now}; {last_words(seen.words)}")


def run(figures):
    fly_streams(figures)
    fly_mistakes(figures)
