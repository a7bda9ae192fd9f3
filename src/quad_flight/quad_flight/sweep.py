"""The same flight with many seeds, on all cores."""

import os
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

from quad_flight.flight import Flight, fly


class SeedResult(NamedTuple):
    """How the flight of one seed went; errors in m over the counted steps; ``reason`` as in ``Result``."""

    seed: int
    outcome: str
    steps: int
    rmse: float
    largest_error: float
    last_error: float
    reason: str = ""


def sweep(flight: Flight, seeds: Iterable[int], *, compiled: bool = True, threads: int = 0) -> list[SeedResult]:
    """Return the result of ``flight`` for each seed, in order.

    ``threads``: 0 for one per core; only the compiled engine gains from them. Raises EngineError as ``fly``.
    """
    chosen = list(seeds)
    if not compiled:
        return [_one(flight._replace(seed=seed), compiled) for seed in chosen]
    done = [_one(flight._replace(seed=seed), compiled) for seed in chosen[:1]]
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        return done + list(pool.map(lambda seed: _one(flight._replace(seed=seed), compiled), chosen[1:]))


def _one(flight: Flight, compiled: bool) -> SeedResult:
    result = fly(flight, compiled=compiled, logging=False)
    return SeedResult(
        flight.seed,
        result.outcome,
        result.steps,
        result.rmse,
        result.score.largest_error,
        result.score.last_error,
        result.reason,
    )
