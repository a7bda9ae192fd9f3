"""Estimators in real time: each stream flies within 1.5 times the error of the clean one, or is refused with numbers.

A process stands between the simulator's `odom` and the relay (``estimator``). First the streams: 500 to 50 Hz, 20 %
jitter of the spacing, 5 % lost, 2 % doubled, 2 % swapped, best effort, wall clock; then each mistake, which must be
named before take-off or within 0.5 s of the motion that shows it. ``--only PATTERN`` flies the rows whose name holds
it, such as ``--only "hover.*100"``.
"""

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np
from estimator import set_parts, spoil, turned
from figures import Figures
from flying import finish, in_domain, start
from nav_msgs.msg import Odometry

from quad_core.estimator import MISFIT_SHARE, RATE_MISFIT, VELOCITY_MISFIT
from quad_flight_log.bag.reader import open_flight

ONLY = re.compile(os.environ.get("QUAD_ACCEPT_ONLY", ""))
RELAY = ("--relay", "--realtime", "--set", "odometry_relay.odometry=est/odom")
CASES = {"hover": ("--duration", "10"), "case2": ("--duration", "20")}
RATES = (500, 250, 120, 100, 50)
REAL = "jitter=0.2 lost=0.05 doubled=0.02 swapped=0.02 best_effort=1 wall_clock=1"
SHARE = 1.5
NAMED_WITHIN = 0.5  # s
AWAY = ("--set", "trajectory.hover.yaw=3", "--set", "trajectory.hover.position.x=3")


class Mistake(NamedTuple):
    """What is wrong with a stream, the words that name it, and whether the flight goes on."""

    faults: dict[str, str]
    words: str
    flies: bool


MISTAKES = {
    "world twist": Mistake({}, "world frame, expected the body frame", True),
    "zero twist": Mistake({}, "a twist that is not filled in", True),
    "sign": Mistake({}, "the wrong sign", True),
    "frd twist": Mistake({}, "FRD axes, expected FLU", True),
    "degrees": Mistake({}, "deg/s, expected rad/s", True),
    "km/h": Mistake({}, "km/h, expected m/s", True),
    "ned": Mistake({}, r"twist\.|height|stands|upside|guard|est/odom", False),
    "frame": Mistake({}, "frame 'odom', expected 'map'", False),
    "body frame": Mistake({}, "frame 'imu', expected 'base_link'", False),
    "no attitude": Mistake({}, "a quaternion that is not of length 1", False),
    "not finite": Mistake({}, "a number that is not finite", False),
    "jump": Mistake({"begins": "3.0"}, r"jumped by 3\.00 m", True),
    "jump in height": Mistake({"begins": "3.0"}, r"jumped by 0\.80 m", True),
    "silent": Mistake({"begins": "3.0"}, r"est/odom: silent since", False),
    "stale first stamp": Mistake({"wall_clock": "1"}, "stamps jumped by 1000|hover: good", True),
}


class Flown(NamedTuple):
    """How a flight through an estimator ended."""

    code: int
    rmse: float
    words: str
    named: float
    """s from the moment a mistake shows to the event that names it, NaN without either."""


def flown(case, folder, *extra, faults):
    """Fly ``case`` on the estimator with ``faults`` ({key of Faults: text})."""
    bag = Path(folder) / re.sub(r"\W+", "-", f"{case} {' '.join(faults.values())}")
    clock = ("--set", "odometry_relay.stamps=first") if faults.get("wall_clock") == "1" else ()
    flight = start(case, *CASES[case], *RELAY, *clock, *extra, "--out", bag)
    lines = []
    for line in flight.stdout:
        lines.append(line)
        if "ROS_DOMAIN_ID=" in line:
            break
    domain = int(re.search(r"ROS_DOMAIN_ID=(\d+)", lines[-1])[1])
    words = [f"{key}={value}" for key, value in faults.items()]
    program = [sys.executable, str(Path(__file__).with_name("estimator.py")), *words]
    estimator = subprocess.Popen(program, env=in_domain(domain))
    try:
        done = finish(flight)
    finally:
        estimator.kill()
        estimator.wait()
    said = "".join(lines) + done.stdout + done.stderr + "".join(f"{text}\n" for text in events_of(bag))
    rmse = re.search(r"^position_rmse +([\d.e-]+)", said, re.MULTILINE)
    return Flown(done.returncode, float(rmse[1]) if rmse else np.nan, said, named_after(bag, faults.get("wrong", "")))


def events_of(bag):
    """Return the texts of a flight's events, which the report shows; none without a bag."""
    if not any(bag.glob("*.mcap")):
        return []
    return [str(row["text"]) for row in open_flight(bag).array("flight/events")]


def named_after(bag, wrong):
    """Return how long after the mistake is larger than what the relay tolerates the first event names it, in s."""
    if not any(bag.glob("*.mcap")):
        return np.nan
    flight = open_flight(bag)
    named = [row["stamp_ns"] for row in flight.array("flight/events") if row["kind"] == "wrong_twist"]
    shows = (row["stamp_ns"] for row in flight.array("truth") if misfit(row, wrong))
    first = next(shows, None)
    return 1e-9 * float(named[0] - first) if named and first is not None else np.nan


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


def fly_streams(figures, folder):
    """Fly both cases on each stream."""
    real = dict(word.split("=") for word in REAL.split())
    for case in CASES:
        rows = [rate for rate in RATES if ONLY.search(f"{case} {rate} Hz")]
        if not rows:
            continue
        clean = flown(case, folder, faults={})
        figures.check(clean.code == 0, f"{case}, clean, 500 Hz: {1e3 * clean.rmse:.2f} mm, {last_words(clean.words)}")
        for rate in rows:
            seen = flown(case, folder, faults={"rate": str(rate), **real})
            refused = re.search(r"samples [\d.]+ ms apart, expected at most", seen.words)
            kept = bool(refused) or (seen.code == 0 and seen.rmse <= SHARE * clean.rmse)
            ratio = seen.rmse / clean.rmse
            line = f"{case} {rate} Hz: {1e3 * seen.rmse:.2f} mm, {ratio:.2f} of clean, limit {SHARE}"
            figures.check(kept, f"{line}; exit code {seen.code}, {last_words(seen.words)}")


def fly_mistakes(figures, folder):
    """Fly a hover away from the start on each mistake."""
    for name, mistake in MISTAKES.items():
        if not ONLY.search(f"mistake {name}"):
            continue
        seen = flown("hover", folder, *AWAY, "--duration", "3", faults={"wrong": name, **mistake.faults})
        named = re.search(mistake.words, seen.words)
        soon = not seen.named > NAMED_WITHIN or "begins" in mistake.faults
        good = bool(named) and soon and (seen.code == 0) == mistake.flies
        figures.check(
            good,
            f"mistake {name}: exit code {seen.code}, named: {named[0] if named else 'no'}"
            f"{f', {seen.named:.2f} s after it shows' if seen.named == seen.named else ''}; {last_words(seen.words)}",
        )


def main():
    figures = Figures()
    with tempfile.TemporaryDirectory(prefix="estimators-") as folder:
        fly_streams(figures, folder)
        fly_mistakes(figures, folder)
    return figures.code()
