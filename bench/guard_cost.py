"""What guard and commander cost: each beside the same flight without it, in turn."""

import os
from collections.abc import Sequence
from functools import partial

from batch import campaign, rates
from ros_runs import stack
from table import Row, alternated, ratios

from quad_campaign.batch import fly_numbers
from quad_flight.set_up import Request

BENCH = "guard_cost"
_SECONDS = 20.0
_FLIGHTS = 40
_WITHOUT = ("simulator.guard.enabled=false",)
_MISSION = "takeoff:2,hold:12,land"


def measure(rounds: int) -> list[Row]:
    """Return all rows; paired rounds of bare cascade, guard, and guard with commander."""
    return [*_lockstep(rounds), *_real_time(rounds), *_batch(rounds)]


def _lockstep(rounds: int) -> list[Row]:
    """Return cycles per second of five bare processes, with the guard, and of six with guard and commander."""
    bare = Request("hover", duration=_SECONDS, settings=_WITHOUT)
    kinds = (bare, bare._replace(settings=()), Request("hover", mission=_MISSION))
    without, guarded, commanded = alternated(rounds, [partial(_rate, request) for request in kinds])
    return [
        Row(BENCH, "lockstep, without guard", tuple(without), "cycles/s"),
        Row(BENCH, "lockstep, with guard", tuple(guarded), "cycles/s"),
        Row(BENCH, "lockstep, with guard and commander", tuple(commanded), "cycles/s", "", _MISSION),
        Row(BENCH, "lockstep: guard over none", ratios(guarded, without), "", ">= 0.97"),
        Row(BENCH, "lockstep: guard and commander over none", ratios(commanded, without), "", ">= 0.9"),
    ]


def _real_time(rounds: int) -> list[Row]:
    """Return the share of commands that a 1 kHz loop misses, without and with the guard."""
    request = Request("hover", duration=6.0, realtime=True, settings=("flight.plant_period=1000000",))
    kinds = (request._replace(settings=(*request.settings, *_WITHOUT)), request)
    without, guarded = alternated(rounds, [partial(_missed, kind) for kind in kinds])
    return [
        Row(BENCH, "real time 1 kHz, without guard: missed commands", tuple(without), "%"),
        Row(BENCH, "real time 1 kHz, with guard: missed commands", tuple(guarded), "%", "<= 0.5"),
    ]


def _batch(rounds: int) -> list[Row]:
    """Return steps per second of the compiled batch without and with the guard, by wall clock and CPU time."""
    threads = os.cpu_count() or 1
    kinds = [campaign(_WITHOUT), campaign()]
    for kind in kinds:
        fly_numbers(kind, [0])
    found = alternated(rounds, [partial(rates, kind, _FLIGHTS, threads) for kind in kinds])
    rows = []
    for clock, name in enumerate(("wall clock", "CPU time")):
        without, guarded = (_column(values, clock) for values in found)
        rows.append(Row(BENCH, f"batch, without guard, {name}", without, "M steps/s"))
        rows.append(Row(BENCH, f"batch, with guard, {name}", guarded, "M steps/s"))
        rows.append(Row(BENCH, f"batch: guard over none, {name}", ratios(guarded, without), "", ">= 0.9"))
    return rows


def _column(values: Sequence[tuple[float, float]], index: int) -> tuple[float, ...]:
    return tuple(value[index] / 1e6 for value in values)


def _rate(request: Request) -> float:
    return stack(request).rate


def _missed(request: Request) -> float:
    run = stack(request)
    return 100.0 * run.missed / run.steps
