"""Monte Carlo: fly a campaign on all cores or on a Dask cluster, part by part."""

import os
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import Any

from quad_campaign.batch import Batch, fly_numbers, prepared
from quad_campaign.definition import Definition
from quad_campaign.parts import Parts

Row = dict[str, Any]
_PREPARED: dict[str, Batch] = {}


def fly_part(definition: Definition, numbers: range, compiled: bool) -> list[Row]:
    """Fly the flights ``numbers``; a process prepares a campaign once."""
    key = repr(definition)
    if key not in _PREPARED:
        _PREPARED[key] = prepared(definition)
    return fly_numbers(_PREPARED[key], numbers, compiled=compiled)


def run(
    definition: Definition, parts: Parts, *, scheduler: str = "", compiled: bool = True, progress: bool = True
) -> None:
    """Fly every part that is missing and store each when it is done.

    ``scheduler``: address of a Dask scheduler whose workers have this stack installed; empty: threads of this process.
    Raises EngineError as ``fly``, OSError if the scheduler does not answer.
    """
    from tqdm import tqdm

    missing = parts.missing()
    if not missing:
        return
    flights = sum(len(parts.numbers(part)) for part in missing)
    with tqdm(total=flights, unit="flight", disable=not progress, smoothing=0.05) as bar:
        flown = (_on_cluster if scheduler else _on_threads)(definition, parts, missing, compiled, scheduler)
        for part, rows in flown:
            parts.write(part, rows)
            bar.update(len(rows))


def _on_threads(
    definition: Definition, parts: Parts, missing: list[int], compiled: bool, _scheduler: str
) -> Iterator[tuple[int, list[Row]]]:
    if compiled:
        # compile once, before threads would do it at the same time
        fly_part(definition, parts.numbers(missing[0])[:1], compiled)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        futures = {pool.submit(fly_part, definition, parts.numbers(part), compiled): part for part in missing}
        try:
            for future in as_completed(futures):
                yield futures.pop(future), future.result()
        finally:
            for future in futures:
                future.cancel()


def _on_cluster(
    definition: Definition, parts: Parts, missing: list[int], compiled: bool, scheduler: str
) -> Iterator[tuple[int, list[Row]]]:
    from distributed import Client
    from distributed import as_completed as as_they_come

    with Client(scheduler, set_as_default=False) as client:
        futures = {
            # a part belongs to its number whoever flies it: one that is flown twice is stored once
            client.submit(fly_part, definition, parts.numbers(part), compiled, pure=False, retries=2): part
            for part in missing
        }
        for future in as_they_come(list(futures), loop=client.loop):
            yield futures.pop(future), future.result()


def shipped() -> dict[str, Path]:
    """Return {name: file} of the campaigns that come with the stack."""
    return {path.stem: path for path in sorted((Path(__file__).parent / "config").glob("campaign_*.yaml"))}
