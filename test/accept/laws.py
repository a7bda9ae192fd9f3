"""Tracking of both cases over 20 seeds and on each plant, arrival from the printed start and from 50 m off; no ROS."""

import sys
from pathlib import Path

from quad_flight.many import sweep

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "bench"))
from paper_flight import (
    ATTITUDE_ADAPTATION_OFF,
    CASES,
    FIRST_POINT,
    POSITION_ADAPTATION_OFF,
    PaperCase,
    arrival,
    paper_flight,
)

SEEDS = range(1, 21)
RMSE_LIMITS = {"tuned": 0.02, "minimal": 0.08}
PLANTS = ("paper", "mujoco")  # besides rigid_body
FROZEN = {"position": POSITION_ADAPTATION_OFF, "attitude": ATTITUDE_ADAPTATION_OFF}
STRONG = {"disturbance": {"acceleration_sd": 1.5}}
THRUSTS = (2.0, 3.0, 4.0)
FAR = {"below": (0.0, 0.0, -50.0), "beside": (0.0, 50.0, 0.0), "above": (0.0, 0.0, 50.0)}
ARRIVED, BACK = 20.0, 30.0
"""s after which a flight from the origin has arrived, and one from 50 m off is back."""
CLOSE, LARGEST = 0.2, 0.25


def run(figures):
    for preset, limit in RMSE_LIMITS.items():
        for case in CASES:
            tracking(figures, PaperCase(case, preset), limit)
    for case in CASES:
        for plant in PLANTS:
            (result,) = sweep(paper_flight(PaperCase(case, plant=plant)), [1], compiled=plant != "mujoco")
            figures.at_most(f"{case} on {plant}, seed 1: 3-D RMSE", result.rmse, RMSE_LIMITS["tuned"], "m")
    for preset in RMSE_LIMITS:
        for case in CASES:
            for thrust in THRUSTS:
                paper_case = PaperCase(case, preset, "printed", vehicle={"thrust_to_weight": thrust})
                coming(figures, paper_case, f"from the origin at {thrust:g} m g")
            for where, offset in FAR.items():
                begin = tuple(p + d for p, d in zip(FIRST_POINT[case], offset, strict=True))
                coming(figures, PaperCase(case, preset, "printed", initial=begin), f"from 50 m {where}", BACK)


def tracking(figures, paper_case, limit):
    name = f"{paper_case.case} {paper_case.preset}"
    asked = flown(paper_case)
    figures.check(asked.ended == len(SEEDS), f"{name}: {asked.ended} of {len(SEEDS)} seeds flown to the end")
    figures.at_most(f"{name}: worst 3-D RMSE (best {asked.best:.4f} m)", asked.worst, limit, "m")
    for what, other in (("adaptation frozen", FROZEN), ("sd 1.5 m/s^2", STRONG), ("both", FROZEN | STRONG)):
        beside = flown(paper_case._replace(**other))
        figures.show(f"{name}, {what}: RMSE {beside.best:.4f} to {beside.worst:.4f} m, {beside.ended} flown to the end")


class Flown:
    def __init__(self, results):
        errors = [result.rmse for result in results]
        self.best, self.worst = min(errors), max(errors)
        self.ended = sum(result.outcome == "ended" for result in results)


def flown(paper_case):
    return Flown(sweep(paper_flight(paper_case), SEEDS))


def coming(figures, paper_case, how, after=ARRIVED):
    """Judge the errors from ``after`` s on; flights from the origin have to be close at that time already."""
    name = f"{paper_case.case} {paper_case.preset} {how}"
    found = arrival(paper_case, SEEDS, after)
    line = (
        f"{name}: {found.error_then:.4f} m at {after:g} s, at most {found.largest_after:.4f} m after, "
        f"RMSE {found.rmse_after:.4f} m, {found.ended} of {found.seeds} flown to the end"
    )
    close = found.error_then <= CLOSE or after > ARRIVED
    figures.check(found.ended == found.seeds and close and found.largest_after <= LARGEST, line)
