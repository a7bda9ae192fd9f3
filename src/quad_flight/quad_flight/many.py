"""Many flights: one function over many jobs, on the cores of this machine or on a Dask cluster."""

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from functools import partial
from typing import TypeVar

from quad_flight.flight import Flight, Result, fly

Job = TypeVar("Job")
Done = TypeVar("Done")


def run_many(
    function: Callable[[Job], Done], jobs: Sequence[Job], *, threads: int = 0, scheduler: str = ""
) -> Iterator[tuple[int, Done]]:
    """Yield (place in ``jobs``, what ``function`` returns for that job) as the jobs end, in any order.

    ``threads``: 0 for one per core; compiled flights run side by side, plain Python gains nothing. ``scheduler``:
    address of a Dask scheduler whose workers have this stack installed; ``function`` and jobs must pickle. Raises what
    ``function`` raises, and OSError if the scheduler does not answer.
    """
    if scheduler:
        yield from _on_cluster(function, jobs, scheduler)
        return
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        futures = {pool.submit(function, job): place for place, job in enumerate(jobs)}
        try:
            for future in as_completed(futures):
                yield futures[future], future.result()
        finally:
            for future in futures:
                future.cancel()


def all_of(function: Callable[[Job], Done], jobs: Sequence[Job], *, threads: int = 0) -> list[Done]:
    """Return what ``function`` returns for each job, in order; see ``run_many``."""
    done = dict(run_many(function, jobs, threads=threads))
    return [done[place] for place in range(len(jobs))]


def _on_cluster(function: Callable[[Job], Done], jobs: Sequence[Job], scheduler: str) -> Iterator[tuple[int, Done]]:
    from distributed import Client
    from distributed import as_completed as as_they_come

    with Client(scheduler, set_as_default=False) as client:
        # a job that two workers ran, because one was lost, is yielded once
        futures = {client.submit(function, job, pure=False, retries=2): place for place, job in enumerate(jobs)}
        for future in as_they_come(list(futures), loop=client.loop):
            yield futures[future], future.result()


def sweep(flight: Flight, seeds: Iterable[int], *, compiled: bool = True, threads: int = 0) -> list[Result]:
    """Return the result of ``flight`` for each seed, in order, without logs. Raises EngineError as ``fly``."""
    flights = [flight._replace(seed=seed) for seed in seeds]
    return all_of(partial(fly, compiled=compiled, logging=False), flights, threads=threads if compiled else 1)
