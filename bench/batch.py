"""The batch engine: closed-loop steps per second of two rates and a scenario, growth with flights."""

import os
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from table import Row, alternated

from quad_campaign.batch import Batch, fly_numbers, prepared
from quad_campaign.definition import Definition, Distribution

BENCH = "batch"
_FLIGHTS = 40
_SEED = {"flight.seed": Distribution("uniform", (0, 2**31 - 1), None)}


def campaign(settings: tuple[str, ...] = (), **flight: object) -> Batch:
    """Return a campaign that varies nothing but the seed."""
    request = {"case": "case2", **flight, "set": list(settings)}
    return prepared(Definition("bench", "", request, _SEED, {}, 1))


def rates(batch: Batch, flights: int, threads: int) -> tuple[float, float]:
    """Return closed-loop steps per second of wall time, and per second of CPU time times the number of threads."""
    share = flights // threads
    wall, cpu = time.perf_counter(), time.process_time()
    with ThreadPoolExecutor(threads) as pool:
        parts = pool.map(lambda i: fly_numbers(batch, range(i * share, (i + 1) * share)), range(threads))
        steps = sum(row["steps"] for part in parts for row in part)
    return steps / (time.perf_counter() - wall), threads * steps / (time.process_time() - cpu)


def measure(rounds: int) -> list[Row]:
    """Return all rows; every configuration in turn."""
    threads = os.cpu_count() or 1
    kinds = {
        "case 2, full laws": campaign(),
        "case 2, at 1 kHz": campaign(("flight.plant_period=1000000",)),
        "scenario flight": campaign(case="flight", vehicle="x500", preset="x500"),
    }
    rows = []
    for name, batch in kinds.items():
        fly_numbers(batch, [0])
        found = [rates(batch, _FLIGHTS, threads) for _ in range(rounds)]
        target = ">= 4" if name == "case 2, full laws" else ""
        rows.append(Row(BENCH, f"{name}: {threads} threads", tuple(f[0] / 1e6 for f in found), "M steps/s", target))
        note = f"steps of {threads} CPU seconds: as on {threads} free cores"
        rows.append(Row(BENCH, f"{name}: by CPU time", tuple(f[1] / 1e6 for f in found), "M steps/s", target, note))
    rows += _growth(kinds["case 2, full laws"], rounds)
    return rows


def _growth(batch: Batch, rounds: int) -> list[Row]:
    counts = (1, 4, 16, 64)

    def measured(count: int) -> Callable[[], float]:
        def once() -> float:
            began = time.process_time()
            fly_numbers(batch, range(count))
            return 1e3 * (time.process_time() - began) / count

        return once

    found = alternated(rounds, [measured(count) for count in counts])
    return [
        Row(BENCH, f"growth: {count} flights", tuple(values), "CPU ms/flight")
        for count, values in zip(counts, found, strict=True)
    ]
