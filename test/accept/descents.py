"""Descents of the guard on a wrong heading, off trim, and without any state: hover, Case 2 and missions.

Kinds, for ``--only``: heading (200 jumps of it in disturbed air), torque (400 flights with a centre of gravity or a
rotor that is off, commands lost, with and without a freeze), frozen (states frozen for good, calm and disturbed). A
tenth of the jumps is flown again by CPython and must have the same bits.
"""

import math
import random

import numpy as np
from commanded_flights import Flight, tilt
from frozen_state import GAUSSIAN, scenario

from quad_core.cycle import seconds
from quad_core.enumerations import GuardReason
from quad_core.geometry import norm
from quad_core.types import SensorFault
from quad_core.vehicle import Vehicle
from quad_dynamics import held_gaussian
from quad_flight.flight import fly, from_names
from quad_guard import guard

PERIOD = 2_000_000
SLOW = [f"attitude_controller.abfnitsm.{axis}.max_torque={size}" for axis, size in
        (("roll", 0.006), ("pitch", 0.006), ("yaw", 0.001))]  # fmt: skip
VEHICLES = {"paper": ("tuned", []), "x500": ("x500", []), "crazyflie21": ("tuned", SLOW)}
HOVER = ["trajectory.hover.position.z=5.0"]
JUMPS, TORQUES, CALM_FREEZES, FREEZES = 200, 400, 100, 200
OFTEN, SPEED, LIMIT, TILT = 0.95, 1.5, 3.0, 15.0  # share, m/s, m/s, deg
LEAST_JUMP = math.radians(20.0)  # less is no jump for the guard
STEEPEST = 57.3  # deg on the way down with a steady torque


def flown(figures, name, case, events, seed, start, longest, more=(), *, compiled=True):
    """Return the result of a flight whose fault begins at ``start`` s, and speed, tilt and largest tilt since then."""
    preset, settings = VEHICLES[name]
    settings = [*settings, *more, *(HOVER if case == "hover" else [])]
    path = scenario(figures.folder, events)
    flight = from_names(
        case, vehicle=name, preset=preset, settings=settings, scenario=path, seed=seed, duration=start + longest
    )
    result = fly(flight, compiled=compiled)
    truth = result.topics["truth"]
    leans = np.degrees(np.arccos(np.clip(1.0 - 2.0 * (truth["q_wb"][:, :2] ** 2).sum(axis=1), -1.0, 1.0)))
    since = truth["p_w"].shape[0] if not result.guard else int(result.guard.split("step ")[1].split(":")[0])
    return result, float(np.linalg.norm(truth["v_w"][-1])), float(leans[-1]), float(leans[since:].max(initial=0.0))


def jumped(figures, rng, count):
    """Yield (jump rad, why the guard flies, speed, tilt, same bits) of heading jumps without a commander."""
    for number in range(count):
        case, name = ("hover", "case2")[number % 2], list(VEHICLES)[number // 2 % 3]
        start, yaw = rng.uniform(6.0, 12.0 if case == "hover" else 40.0), rng.uniform(-math.pi, math.pi)
        asked = (figures, name, case, [GAUSSIAN, f"jump start={start:.3f} yaw={yaw:.4f}"], number, start, 90.0)
        result, speed, lean, _ = flown(*asked)
        same = True
        if number % 10 == 0:
            twin = flown(*asked, compiled=False)[0]
            same = all(twin.topics[name].tobytes() == rows.tobytes() for name, rows in result.topics.items())
        yield yaw, result.guard, speed, lean, same


def jumped_in_mission(rng, count):
    """Yield the same of missions, whose commander then lands; in HOLD and on the way up."""
    parameters = held_gaussian.Parameters()
    for number in range(count):
        table = held_gaussian.draw(parameters, Vehicle(), number, 200.0)
        at, yaw = rng.uniform(5.0, 12.0), rng.uniform(-math.pi, math.pi)
        flight = Flight(
            f"takeoff:{rng.uniform(3.0, 6.0):g},hold:12,land",
            acts=lambda k, table=table: held_gaussian.sample(parameters, table, seconds(k, PERIOD)),
            fault=lambda k, at=at, yaw=yaw: SensorFault(False, yaw_offset=yaw if seconds(k, PERIOD) >= at else 0.0),
        )
        low, why = None, ""
        for _ in range(round(90e9 / PERIOD)):
            before = flight.truth
            flight.step()
            if flight.report is not None and flight.report.status.reason == GuardReason.HEADING:
                why = guard.REASONS[GuardReason.HEADING]
            if flight.k > at * 1e9 / PERIOD and flight.truth.p_w.z <= 0.001:
                low = norm(before.v_w), math.degrees(tilt(before))
                break
        yield yaw, why, *(low or (math.nan, math.nan)), True


def headings(figures):
    """Judge the jumps of heading; one below 20 deg is flown on."""
    rng, count = random.Random(3), figures.each(JUMPS)
    missions = count // 5
    found = [*jumped(figures, rng, count - missions), *jumped_in_mission(rng, missions)]
    taken = [one for one in found if one[1]]
    missed = sum(abs(yaw) > LEAST_JUMP and "heading" not in why for yaw, why, *_ in found)
    figures.check(missed == 0, f"heading: {len(found)} jumps, {len(taken)} taken over, {missed} not named")
    figures.check(all(same for *_, same in found), "heading: a tenth flown by CPython has the same bits")
    speeds = np.array([speed for _, _, speed, _, _ in taken])
    share = float((speeds < SPEED).mean())
    figures.check(share >= OFTEN, f"heading: {100 * share:.1f} % touch down below {SPEED} m/s")
    figures.at_most("heading: touchdown, fastest", float(speeds.max()), LIMIT, "m/s")
    figures.at_most("heading: touchdown, steepest", max(lean for _, _, _, lean, _ in taken), TILT, "deg")


def torques(figures):
    """Judge steady torques, of a centre of gravity up to 25 mm off or a rotor at 50 to 100 %; commands get lost."""
    rng, count = random.Random(4), figures.each(TORQUES)
    found = []
    for number in range(count):
        name, freezes, rotor = ("paper", "x500")[number % 2], number // 2 % 2, number // 4 % 2
        weight = {"paper": 0.56 * 9.8, "x500": 2.064 * 9.81}[name]
        moment, towards = weight * rng.uniform(0.0, 0.025), rng.uniform(-math.pi, math.pi)
        x, y = moment * math.cos(towards), moment * math.sin(towards)
        events = [f"push start=4 torque={x:.4f},{y:.4f},0", "link start=8 drop=1"]
        if rotor:
            events[0] = f"rotor start=4 number={rng.randrange(1, 5)} effectiveness={rng.uniform(0.5, 1.0):.3f}"
        if freezes:
            start = rng.uniform(6.0, 9.0)
            events += [f"freeze start={start:.3f} end={start + rng.uniform(0.1, 1.8):.3f}"]
        _, speed, _, largest = flown(figures, name, "hover", events, number, 8.0, 30.0)
        found.append((speed, largest))
    speeds, largest = np.array(found).T
    figures.at_most(f"torque: {count} flights, fastest touchdown", float(speeds.max()), SPEED, "m/s")
    figures.at_most(f"torque: {count} flights, largest tilt", float(largest.max()), STEEPEST, "deg")
    figures.show(f"torque: median {np.median(speeds):.2f} m/s, {np.median(largest):.1f} deg")


def frozen(figures):
    """Judge states that are frozen for good, from 5 m, mass 5 % off, beside motors off at once."""
    for weather, count in (("calm", figures.each(CALM_FREEZES)), ("disturbed", figures.each(FREEZES))):
        for name in ("paper", "x500"):
            kinds = {"flown": [], "motors off": ["simulator.guard.state.gone_age=0.1"]}
            medians = {}
            for kind, more in kinds.items():
                rng, speeds = random.Random(5), []
                for number in range(count // 2):
                    start = rng.uniform(6.0, 12.0)
                    mass = rng.uniform(-0.05, 0.05) * {"paper": 0.56, "x500": 2.064}[name]
                    events = [*([GAUSSIAN] if weather == "disturbed" else []), f"freeze start={start:.3f}"]
                    settings = [f"simulator.rigid_body.mass_error={mass:.5f}", *more]
                    speeds.append(flown(figures, name, "hover", events, number, start, 10.0, settings)[1])
                medians[kind] = float(np.median(speeds))
                figures.show(
                    f"frozen for good, {weather}, {name}, {kind}: median {np.median(speeds):.2f} m/s,"
                    f" 95 % {np.percentile(speeds, 95):.2f}, worst {max(speeds):.2f}, {count // 2} flights"
                )
            limit = medians["motors off"]
            figures.at_most(f"frozen for good, {weather}, {name}: median", medians["flown"], 0.5 * limit, "m/s")


def run(figures):
    for kind in (torques, frozen, headings):
        if figures.wants(kind.__name__):
            kind(figures)
