"""Many flights of one campaign, without logs, on all cores or a Dask cluster: a row of measures for each.

The directory has parts that appear whole or not at all, so that a killed campaign can go on.
"""

import json
import os
from collections.abc import Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from quad_campaign.definition import Definition, base_flight, drawn
from quad_core.parameters import ParameterError, Value
from quad_flight.flight import Flight, Result, fly
from quad_flight.many import run_many
from quad_flight.score import MEASURES
from quad_flight.set_up import is_late
from quad_flight.variation import Variation

ABOUT = "campaign.json"
FLIGHTS = "flights.parquet"


class Parts:
    """Parts of ``size`` flights each in ``directory/parts``; part i holds flights i * size to (i + 1) * size - 1."""

    def __init__(self, directory: Path, flights: int, size: int) -> None:
        self.directory, self.flights, self.size = directory, flights, size

    def open(self, about: dict[str, Any], resume: bool) -> None:
        """Make the directory, or check that it holds the same campaign; raises ParameterError if it does not."""
        path = self.directory / ABOUT
        if not resume and self.directory.exists() and any(self.directory.iterdir()):
            raise ParameterError(f"--out: {self.directory} exists; go on with --resume or choose another directory")
        if resume and path.exists():
            try:
                before = dict(json.loads(path.read_text("utf-8"))["identity"])
            except (ValueError, KeyError, TypeError) as error:
                raise ParameterError(f"--resume: {path}: found no identity of a campaign ({error!r})") from error
            for key, value in about["identity"].items():
                if before.get(key) != value:
                    found = f"found {key} {value!r}, expected {before.get(key)!r} as it was begun with"
                    raise ParameterError(f"--resume: {path}: {found}")
            return
        (self.directory / "parts").mkdir(parents=True, exist_ok=True)
        temporary = path.with_suffix(".tmp")
        temporary.write_text(json.dumps(about, indent=2), "utf-8")
        temporary.replace(path)

    def missing(self) -> list[int]:
        """Return the numbers of the parts that are not there."""
        return [part for part in range(-(-self.flights // self.size)) if not self._path(part).exists()]

    def numbers(self, part: int) -> range:
        """Return the numbers of the flights of a part."""
        return range(part * self.size, min((part + 1) * self.size, self.flights))

    def write(self, part: int, rows: Sequence[dict[str, Any]]) -> None:
        """Store a part."""
        path = self._path(part)
        temporary = path.with_suffix(f".{os.getpid()}.tmp")
        pd.DataFrame(rows).to_parquet(temporary, index=False)
        temporary.replace(path)

    def joined(self) -> pd.DataFrame:
        """Return all flights in order, and store them as one file; raises ValueError if one is missing or twice."""
        frame = pd.concat([pd.read_parquet(self._path(part)) for part in range(-(-self.flights // self.size))])
        if list(frame["flight"]) != list(range(self.flights)):
            raise ValueError(f"{self.directory}: the parts do not hold each of {self.flights} flights once")
        temporary = self.directory / f"{FLIGHTS}.tmp"
        frame.to_parquet(temporary, index=False)
        temporary.replace(self.directory / FLIGHTS)
        return frame.reset_index(drop=True)

    def _path(self, part: int) -> Path:
        return self.directory / "parts" / f"part-{part:06d}.parquet"


ENDED = "ended"


class Batch(NamedTuple):
    """A campaign made ready to fly. ``base``: its flight 0; ``variation``: of its flight without values.

    ``variations``: {whether sensors are late: of a flight like that}, as far as there was one. Values decide what runs:
    where sensors are late, laws see predicted states.
    """

    definition: Definition
    base: Flight
    variation: Variation
    variations: dict[bool, Variation]


def prepared(definition: Definition) -> Batch:
    """Return a campaign ready to fly; raises ParameterError or PluginError if its flight or parameters are unknown."""
    plain = base_flight(definition)
    batch = Batch(definition, plain, Variation(plain, definition.vary), {})
    return batch._replace(base=flight_of(batch, 0)[0])


def flight_of(batch: Batch, number: int) -> tuple[Flight, dict[str, Value]]:
    """Return flight ``number``, as ``base_flight`` makes it of its values, and those."""
    values = drawn(batch.definition, batch.variation, number)
    late = is_late(batch.variation.apply(values).setup.sensing)
    if late not in batch.variations:
        batch.variations[late] = Variation(base_flight(batch.definition, values), batch.definition.vary)
    return batch.variations[late].apply(values), values


def fly_numbers(batch: Batch, numbers: Iterable[int], *, compiled: bool = True) -> list[dict[str, Any]]:
    """Fly the flights of these numbers and return a row for each; see ``row``. Raises EngineError as ``fly``."""
    rows = []
    for number in numbers:
        flight, values = flight_of(batch, number)
        rows.append(row(batch.definition, number, values, fly(flight, compiled=compiled, logging=False)))
    return rows


def row(definition: Definition, number: int, values: dict[str, Value], result: Result) -> dict[str, Any]:
    """Return {column: value}: ``flight``, the parameters, ``outcome``, ``reason`` of a refusal, measures, ``success``.

    Success: it ended and every measure named by the campaign's ``success`` is at most its limit.
    """
    measures = {name: measure.of(result.score) for name, measure in MEASURES.items()}
    good = result.outcome == ENDED and all(measures[name] <= limit for name, limit in definition.success.items())
    return {
        "flight": number,
        **values,
        "outcome": result.outcome,
        "reason": result.reason,
        "steps": result.steps,
        **measures,
        "success": good,
    }


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
    """Fly every part that is missing and store each when it is done; ``scheduler`` and errors as ``run_many``."""
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
