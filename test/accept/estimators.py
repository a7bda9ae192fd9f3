"""Estimators in real time, for ``first_contact``: streams that fly or are refused, mistakes that are named.

A process stands between the simulator's `odom` and the relay (``estimator``). First the streams: 500 to 50 Hz, 20 %
jitter of the spacing, 5 % lost, 2 % doubled, 2 % swapped, best effort, wall clock. Each flies within 1.5 times the
error of the clean one or is refused. Each mistake must be named before take-off or within 0.5 s of the motion that
shows it.
"""

import re
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from estimator import set_parts, spoil, turned
from flying import finish, in_domain, start
from nav_msgs.msg import Odometry

from quad_bringup.domains import reserved_domain
from quad_core.estimator import MISFIT_SHARE, RATE_MISFIT, VELOCITY_MISFIT
from quad_flight_log.bag.reader import open_flight

RELAY = ("--relay", "--realtime", "--set", "odometry_relay.odometry=est/odom")
CASES = {"hover": ("hover", "--duration", "10"), "case2": ("case2", "--duration", "20")}
RATES = (500, 250, 120, 100, 50)
REAL = "jitter=0.2 lost=0.05 doubled=0.02 swapped=0.02 best_effort=1 wall_clock=1"
TUMBLED = "1 us off the grid ended every flight (C1), 100 Hz tumbled (C2), best effort was not received (C4)"
SHARE = 1.5
NAMED_WITHIN = 0.5  # s
AWAY = ("hover", "--set", "trajectory.hover.yaw=3", "--set", "trajectory.hover.position.x=3", "--duration", "3")
UP = ("--mission", "takeoff:1.5,hold:3,land")


class Mistake(NamedTuple):
    """What is wrong with a stream: the words that name it, whether the flight goes on, and what happened before."""

    words: str
    flies: bool
    before: str
    begins: float = 0.0
    flight: tuple[str, ...] = AWAY


FAR, BLAMED = "118 m away, no event", "the wrong node blamed; the reason in a log, or nowhere"
UNSEEN, EARLY = "3 m off, no event", "one early message ended the flight after 50 ms"
MISTAKES = {
    "C3 world twist": Mistake("world frame, expected the body frame", True, FAR),
    "C3 zero twist": Mistake("a twist that is not filled in", True, FAR),
    "C3 sign": Mistake("the wrong sign", True, FAR),
    "C3 frd twist": Mistake("FRD axes, expected FLU", True, FAR),
    "C3 degrees": Mistake("deg/s, expected rad/s", True, FAR),
    "C3 km/h": Mistake("km/h, expected m/s", True, FAR),
    "C5 ned": Mistake("sinks at lift-off", False, BLAMED, flight=UP),
    "C5 frame": Mistake("frame 'odom', expected 'map'", False, BLAMED),
    "C5 body frame": Mistake("frame 'imu', expected 'base_link'", False, BLAMED),
    "C5 no attitude": Mistake("a quaternion that is not of length 1", False, BLAMED),
    "C5 not finite": Mistake("a number that is not finite", False, BLAMED),
    "C5 silent": Mistake(r"est/odom: silent since", False, BLAMED, begins=3.0),
    "C6 jump": Mistake(r"jumped by 3\.00 m", True, UNSEEN, begins=3.0),
    "C6 jump in height": Mistake(r"jumped by 0\.80 m", True, UNSEEN, begins=3.0),
    "C9 stale first stamp": Mistake("stamps jumped by 1000|hover: good", True, EARLY),
}


class Flown(NamedTuple):
    """How a flight through an estimator ended."""

    code: int
    rmse: float
    words: str
    named: float
    """s from the moment a mistake shows to the event that names it, NaN without either."""


def flown(figures, flight, faults):
    """Fly the words ``flight`` of fly on the estimator with ``faults`` ({key of Faults: text})."""
    bag = figures.folder / re.sub(r"\W+", "-", " ".join([*flight, *faults.values()]))
    clock = ("--set", "odometry_relay.stamps=first") if faults.get("wall_clock") == "1" else ()
    with reserved_domain(None) as domain:
        pass
    process = start(*flight, *RELAY, *clock, "--domain", str(domain), "--out", bag)
    words = [f"{key}={value}" for key, value in faults.items()]
    program = [sys.executable, str(Path(__file__).with_name("estimator.py")), *words]
    estimator = subprocess.Popen(program, env=in_domain(domain))
    try:
        done = finish(process)
    finally:
        estimator.kill()
        estimator.wait()
    said, named = done.stdout + done.stderr, np.nan
    if any(bag.glob("*.mcap")):
        recorded = open_flight(bag)
        events = recorded.array("flight/events")
        said += "".join(f"{row['text']}\n" for row in events)  # as the report shows them
        naming = [row["stamp_ns"] for row in events if row["kind"] == "wrong_twist"]
        shows = (row["stamp_ns"] for row in recorded.array("truth") if misfit(row, faults.get("wrong", "")))
        first = next(shows, None)
        named = 1e-9 * float(naming[0] - first) if naming and first is not None else np.nan
    rmse = re.search(r"^position_rmse +([\d.e-]+)", said, re.MULTILINE)
    return Flown(done.returncode, float(rmse[1]) if rmse else np.nan, said, named)


def misfit(row, wrong):
    """Return whether a mistake in the twist of a true state is larger than what the relay tolerates."""
    v, w = turned(row["v_w"], row["q_wb"], inverse=True), row["omega_b"]
    message = Odometry()
    twist, q = message.twist.twist, message.pose.pose.orientation
    q.x, q.y, q.z, q.w = (float(part) for part in row["q_wb"])
    set_parts(twist.linear, v)
    set_parts(twist.angular, w)
    spoil(message, wrong)
    off = np.array([twist.linear.x, twist.linear.y, twist.linear.z]) - v
    turns = np.array([twist.angular.x, twist.angular.y, twist.angular.z]) - w
    norm = np.linalg.norm
    return norm(off) > VELOCITY_MISFIT + MISFIT_SHARE * norm(v) or norm(turns) > RATE_MISFIT + MISFIT_SHARE * norm(w)


def last_words(words):
    """Return how a flight ended: good, or the first line that speaks against it."""
    lines = [line for line in re.split(r"[\r\n]+", words) if re.match(r"(fly: )?(hover|case2): ", line)]
    against = [
        line for line in lines if not re.search(r": (next|bag|starting|waiting|failed|good|\[|aibs|[\d.]+ s)", line)
    ]
    against.sort(key=lambda line: not line.startswith("fly: "))
    return (against or [line for line in lines if line.endswith("good")] or [words.strip()[-120:]])[0][:200]


def fly_streams(figures):
    """Fly both cases on each stream."""
    real = dict(word.split("=") for word in REAL.split())
    for case, words in CASES.items():
        rows = {rate: f"C1 C2 C4 {case} {rate} Hz" for rate in RATES if figures.wants(f"C1 C2 C4 {case} {rate} Hz")}
        if not rows:
            continue
        clean = flown(figures, words, {})
        figures.check(clean.code == 0, f"{case}, clean, 500 Hz: {1e3 * clean.rmse:.2f} mm, {last_words(clean.words)}")
        for rate, name in rows.items():
            seen = flown(figures, words, {"rate": str(rate), **real})
            refused = re.search(r"samples [\d.]+ ms apart, expected at most", seen.words)
            kept = bool(refused) or (seen.code == 0 and seen.rmse <= SHARE * clean.rmse)
            now = f"{1e3 * seen.rmse:.2f} mm, {seen.rmse / clean.rmse:.2f} of clean, limit {SHARE}"
            now += f"; exit code {seen.code}, {last_words(seen.words)}"
            figures.check(kept, f"{name} | {REAL} | before: {TUMBLED} | now: {now}")


def fly_mistakes(figures):
    """Fly each mistake: a hover away from the start; NED a take-off, for only lifting shows it."""
    for name, mistake in MISTAKES.items():
        if not figures.wants(name):
            continue
        wrong = name.partition(" ")[2]
        faults = {"wrong": wrong, "begins": str(mistake.begins), "wall_clock": str(int("stamp" in wrong))}
        seen = flown(figures, mistake.flight, faults)
        named = re.search(mistake.words, seen.words)
        soon = not seen.named > NAMED_WITHIN or mistake.begins > 0.0
        now = f"exit code {seen.code}, named: {named[0] if named else 'no'}"
        now += f", {seen.named:.2f} s after it shows" if seen.named == seen.named else ""
        figures.check(
            bool(named) and soon and (seen.code == 0) == mistake.flies,
            f"{name} | hover on such an estimator | before: {mistake.before} | now: {now}; {last_words(seen.words)}",
        )
