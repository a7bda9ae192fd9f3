"""Monte Carlo: fly a campaign on all cores or on a Dask cluster, part by part."""

from functools import partial
from pathlib import Path
from typing import Any

from quad_campaign.batch import Batch, fly_numbers, prepared
from quad_campaign.definition import Definition
from quad_campaign.parts import Parts
from quad_flight.many import run_many

_PREPARED: dict[str, Batch] = {}


def fly_part(definition: Definition, compiled: bool, numbers: range) -> list[dict[str, Any]]:
    """Fly the flights ``numbers``; a process prepares a campaign once."""
    key = repr(definition)
    if key not in _PREPARED:
        _PREPARED[key] = prepared(definition)
    return fly_numbers(_PREPARED[key], numbers, compiled=compiled)


def run(
    definition: Definition, parts: Parts, *, scheduler: str = "", compiled: bool = True, progress: bool = True
) -> None:
    """Fly every part that is missing and store each as it comes; ``scheduler`` and errors as ``run_many``."""
    from tqdm import tqdm

    missing = parts.missing()
    jobs = [parts.numbers(part) for part in missing]
    with tqdm(total=sum(map(len, jobs)), unit="flight", disable=not progress, smoothing=0.05) as bar:
        for place, rows in run_many(partial(fly_part, definition, compiled), jobs, scheduler=scheduler):
            parts.write(missing[place], rows)
            bar.update(len(rows))


def shipped() -> dict[str, Path]:
    """Return {name: file} of the campaigns that come with the stack."""
    return {path.stem: path for path in sorted((Path(__file__).parent / "config").glob("campaign_*.yaml"))}
