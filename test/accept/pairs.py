"""60 random pairs of faults in disturbed air without ROS, 40 over ROS in real time: hover and Case 2, two vehicles.

A pair is two kinds of fault, each at a random moment and of a random size that the guard promises to bear alone. A
vehicle is lost that touches down faster than 3 m/s or beyond 15 deg. ``--each N``: so many pairs.
``--only "real time"`` or ``--only lockstep``: by one clock.
"""

import collections
import math
import random

import numpy as np
from flying import finish, landing, start
from frozen_state import GAUSSIAN, scenario

from quad_flight.flight import fly, from_names
from quad_flight_log.reader import open_flight

PAIRS = {"lockstep": 60, "real time": 40}
PATIENCE = 400.0  # s for a flight over ROS
SOFT, LIMIT, TILT = 1.5, 3.0, 15.0  # m/s, m/s, deg
LONGEST, LOW = 20.0, 0.05  # s of a flight, m
FLOWN = (("hover", "paper", 0.56), ("hover", "x500", 2.064), ("case2", "paper", 0.56))  # case, vehicle, kg


def direction(rng, size):
    """Return the text of a horizontal vector of this size in a random direction."""
    towards = rng.uniform(-math.pi, math.pi)
    return f"{size * math.cos(towards):.4f},{size * math.sin(towards):.4f},0"


FAULTS = {
    "push": lambda rng, mass: f"force={direction(rng, mass * rng.uniform(0.5, 3.0))} end={{end}}",
    "torque": lambda rng, mass: f"torque={direction(rng, mass * 9.8 * rng.uniform(0.0, 0.012))}",
    "gust": lambda rng, mass: f"velocity={direction(rng, rng.uniform(2.0, 8.0))} end={{end}}",
    "payload": lambda rng, mass: f"mass={mass * rng.uniform(0.0, 0.2):.4f}",
    "rotor": lambda rng, mass: f"number={rng.randint(1, 4)} effectiveness={rng.uniform(0.7, 1.0):.3f}",
    "battery": lambda rng, mass: f"limit={rng.uniform(0.85, 1.0):.3f} sag=5",
    "heading": lambda rng, mass: f"yaw={rng.uniform(-math.pi, math.pi):.3f}",
    "position": lambda rng, mass: f"offset={direction(rng, rng.uniform(0.5, 4.0))}",
    "freeze": lambda rng, mass: f"end={rng.choice(['{short}', '{long}'])}",
    "lost commands": lambda rng, mass: "drop=1",
    "late commands": lambda rng, mass: f"delay={rng.uniform(0.005, 0.06):.3f} jitter=0.01",
}
KINDS = {"torque": "push", "heading": "jump", "position": "jump", "lost commands": "link", "late commands": "link"}


def event(rng, fault, mass, earliest, latest):
    """Return the line of a scenario for a fault that begins between two times in s."""
    begin = rng.uniform(earliest, latest)
    values = FAULTS[fault](rng, mass).format(
        end=f"{begin + 2.0:.3f}",
        short=f"{begin + rng.uniform(0.1, 0.3):.3f}",
        long=f"{begin + rng.uniform(0.3, 1.0):.3f}",
    )
    return f"{KINDS.get(fault, fault)} start={begin:.3f} {values}"


class Table:
    """Counts outcomes: how many pairs each kind took part in, how they ended, and the hardest touchdown."""

    def __init__(self, figures):
        self.figures = figures
        self.rows = collections.defaultdict(collections.Counter)
        self.fastest = collections.defaultdict(float)

    def add(self, name, pair, came_down, speed, tilt):
        """Judge one flight."""
        lost = came_down and not (speed <= LIMIT and tilt <= TILT)
        how = "lost" if lost else "flown on" if not came_down else "soft" if speed <= SOFT else "hard"
        for fault in pair:
            self.rows[fault][how] += 1
            self.fastest[fault] = max(self.fastest[fault], speed if came_down else 0.0)
        text = f"{speed:.2f} m/s, {tilt:.1f} deg" if came_down else ""
        self.figures.check(how != "lost", f"{name}: {' + '.join(pair)}: {how} {text}")

    def show(self):
        """Print the table."""
        for fault, row in sorted(self.rows.items()):
            counts = ", ".join(f"{row[how]} {how}" for how in ("flown on", "soft", "hard", "lost"))
            self.figures.show(f"{fault}: {counts}; at most {self.fastest[fault]:.2f} m/s")


def run(figures):
    for clock, pairs in PAIRS.items():
        if figures.wants(clock):
            figures.show(f"{clock}:")
            fly_pairs(figures, clock, figures.each(pairs))


def fly_pairs(figures, clock, pairs):
    """Fly random pairs by one clock and print the table of their outcomes."""
    table, rng = Table(figures), random.Random(9 if clock == "lockstep" else 40)
    for number in range(pairs):
        case, name, mass = FLOWN[number % len(FLOWN)]
        pair = rng.sample(sorted(FAULTS), 2)
        events = [event(rng, fault, mass, 5.0, 10.0) for fault in pair]
        settings = ["trajectory.hover.position.z=5.0"] if case == "hover" else []
        asked = {
            "vehicle": name,
            "preset": "x500" if name == "x500" else "tuned",
            "scenario": scenario(figures.folder, [GAUSSIAN, *events]),
            "seed": number,
            "duration": LONGEST,
        }
        flown = without_ros(case, settings, asked) if clock == "lockstep" else over_ros(figures, case, settings, asked)
        came_down, height, speed, lean = flown
        figures.check(not came_down or height < LOW, f"{number}: ends at {height:.2f} m")
        table.add(f"{number} {case} {name}, {'; '.join(events)}", pair, came_down, speed, lean)
    table.show()


def without_ros(case, settings, asked):
    """Return whether the guard flew to the ground, and height m, speed m/s and tilt deg of the end."""
    result = fly(from_names(case, settings=settings, **asked))
    last = result.topics["truth"][-1]
    lean = math.degrees(math.acos(1.0 - 2.0 * float((last["q_wb"][:2] ** 2).sum())))
    came_down = bool(result.guard) or result.outcome != "ended"
    return came_down, float(last["p_w"][2]), float(np.linalg.norm(last["v_w"])), lean


def over_ros(figures, case, settings, asked):
    """Return the same of a flight by processes of its own in real time."""
    bag = figures.folder / f"real_time_{asked['seed']}"
    words = [word for key, value in asked.items() for word in (f"--{key}", value)]
    words += [word for setting in settings for word in ("--set", setting)]
    done = finish(start(case, *words, "--realtime", "--out", bag), PATIENCE)
    figures.check(done.returncode in (0, 1), f"{bag.name}: exit code {done.returncode}")
    height, speed, lean = landing(open_flight(bag))
    return done.returncode == 1, height, speed, lean
