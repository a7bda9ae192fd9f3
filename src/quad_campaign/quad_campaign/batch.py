"""Many flights of one campaign, without logs, on all cores or a Dask cluster: a row of figures for each."""

from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from quad_campaign.definition import Definition, base_flight, drawn
from quad_campaign.parts import Parts
from quad_core.parameters import Value
from quad_flight.flight import Flight, Result, fly
from quad_flight.many import run_many
from quad_flight.score import FIGURES
from quad_flight.set_up import is_late
from quad_flight.variation import Variation

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
    """Return {column: value}: ``flight``, the parameters, ``outcome``, ``reason`` of a refusal, figures, ``success``.

    Success: it ended and every figure named by the campaign's ``success`` is at most its limit.
    """
    figures = {name: figure.of(result.score) for name, figure in FIGURES.items()}
    good = result.outcome == ENDED and all(figures[name] <= limit for name, limit in definition.success.items())
    return {
        "flight": number,
        **values,
        "outcome": result.outcome,
        "reason": result.reason,
        "steps": result.steps,
        **figures,
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
