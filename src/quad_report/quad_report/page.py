"""The report of flights as one HTML file that opens from disk without a network: text, tables, figures and viewer."""

import base64
import hashlib
import json
import math
from collections.abc import Collection, Mapping, Sequence
from html import escape
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple

from quad_analysis.flight_checks import judgement
from quad_analysis.metrics import METRICS, FlightMetrics
from quad_analysis.tables import text_table, truth_note
from quad_analysis.text import metric_rows
from quad_flight_log.errors import FlightLogError, needed
from quad_flight_log.reader import Flight
from quad_report.figures import REFERENCE, Figure, colours, drawn, runs_of
from quad_report.flight_figures import (
    CASES,
    Playback,
    Run,
    inside_figures,
    paper_figures,
    playback,
    run_from_flight,
    scene,
    with_bands,
)


class Page(NamedTuple):
    """A whole report: ``body`` holds figures, playbacks and HTML of the functions below, in order.

    ``command`` made it; ``facts`` are lines of name and value, folded at its end. ``verdict``: good, failed or
    unknown, and the line that opens the page; None where nothing was judged. ``numbers``: (value, what it is).
    ``lacks``: what the bags do not tell of the verdict.
    """

    title: str
    command: str
    facts: Sequence[tuple[str, str]]
    body: Sequence[Figure | Playback | str]
    verdict: tuple[str, str] | None = None
    numbers: Sequence[tuple[str, str]] = ()
    lacks: Sequence[str] = ()


def heading(title: str, note: str = "") -> str:
    """Return the HTML of a heading and the line under it."""
    return (f"<h2>{escape(title)}</h2>" if title else "") + (f'<p class="note">{escape(note)}</p>' if note else "")


def table(head: Sequence[str], rows: Sequence[Sequence[str]], best: Collection[tuple[int, int]] = ()) -> str:
    """Return the HTML of a table of text; cells ``best`` (row, column) are marked."""
    above = "".join(f"<th>{escape(cell)}</th>" for cell in head)
    lines = []
    for at, row in enumerate(rows):
        marks = [' class="best"' if (at, column) in best else "" for column in range(len(row))]
        cells = (f"<td{mark}>{escape(cell)}</td>" for mark, cell in zip(marks, row, strict=True))
        lines.append(f"<tr>{''.join(cells)}</tr>")
    return f'<div class="scroll"><table><thead><tr>{above}</tr></thead><tbody>{"".join(lines)}</tbody></table></div>'


def folded(title: str, content: str) -> str:
    """Return ``content``, HTML, folded behind its title."""
    return f"<details><summary>{escape(title)}</summary>{content}</details>"


def verbatim(text: str) -> str:
    """Return the HTML of a text as it stands."""
    return f"<pre>{escape(text)}</pre>"


def write_page(page: Page, path: Path) -> Path:
    """Write the page; raises FlightLogError if plotly is not installed or the file cannot be written."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(page_text(page), encoding="utf-8")
    except OSError as error:
        raise FlightLogError(f"{path}: {error.strerror or error}") from error
    return path


def page_text(page: Page) -> str:
    """Return the HTML of a page."""
    parts = [part for part in page.body if not isinstance(part, str)]
    figures = [part for part in parts if isinstance(part, Figure)]
    played = [run.name for part in parts if isinstance(part, Playback) for run in part.runs]
    runs = [*dict.fromkeys([*played, *runs_of(figures)])]
    runs.sort(key=REFERENCE.__eq__)
    colour = colours(runs)
    data: dict[str, Any] = {}
    for part in parts:
        if part.key in data:
            raise ValueError(f"two figures with the key {part.key!r}")
        if isinstance(part, Playback):
            data[part.key] = {"scene": scene(part.runs, colour)}
        else:
            data[part.key] = {**json.loads(drawn(part, colour).to_json()), "time": part.over_time}
    body = "\n".join(part if isinstance(part, str) else _figure(part) for part in page.body)
    scripts = [resource("viewer.js")] if played else []
    scripts += [str(needed("plotly.offline", "the report").get_plotlyjs()), resource("page.js")] if parts else []
    within = f"""<header><h1>{escape(page.title)}</h1>
{_opening(page)}</header>
{_bar(runs, colour)}
<main>
{body}
{_source(page)}
</main>"""
    return document(page.title, within, scripts, data)


def document(title: str, body: str, scripts: Sequence[str], data: Any, policy: str = "") -> str:
    """Return an HTML file with ``data`` as JSON, in which no script runs but ``scripts``, known by their hashes.

    ``policy``: what else the page may do.
    """
    hashes = [base64.b64encode(hashlib.sha256(each.encode()).digest()).decode() for each in scripts]
    allowed = " ".join(f"'sha256-{each}'" for each in hashes) or "'none'"
    # no JSON may end the script element that holds it
    stored = json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    rules = f"default-src 'none'; script-src {allowed}; style-src 'unsafe-inline'; img-src data: blob:{policy}"
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{rules}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<link rel="icon" href="data:,">
<title>{escape(title)}</title>
<style>{resource("page.css")}</style>
</head>
<body>
{body}
<script type="application/json" id="report-data">{stored}</script>
{"".join(f"<script>{each}</script>" for each in scripts)}
</body>
</html>
"""


def _opening(page: Page) -> str:
    parts = []
    if page.verdict is not None:
        word, text = page.verdict
        parts.append(f'<p class="verdict {word}">{escape(text)}</p>')
    if page.numbers:
        items = [f"<div><b>{escape(value)}</b>{escape(name)}</div>" for value, name in page.numbers]
        parts.append(f'<div class="numbers">{"".join(items)}</div>')
    return "\n".join(parts)


def _bar(runs: list[str], colour: dict[str, str]) -> str:
    boxes = []
    for run in runs:
        swatch = f'<span class="swatch" style="background:{colour[run]}"></span>'
        label = escape("the reference" if run == REFERENCE else run)
        boxes.append(f'<label><input type="checkbox" checked data-run="{escape(run)}">{swatch}{label}</label>')
    return f'<nav id="bar"><form autocomplete="off">{"".join(boxes)}</form></nav>' if boxes else ""


def _source(page: Page) -> str:
    rows = "".join(f"<tr><td>{escape(name)}</td><td>{escape(value)}</td></tr>" for name, value in page.facts)
    facts = f'<div class="scroll"><table class="facts">{rows}</table></div>' if rows else ""
    return folded("Where this comes from", f'{facts}<p class="note">Made by</p>{verbatim(page.command)}')


def _figure(part: Figure | Playback) -> str:
    key, kind = escape(part.key), "viewer" if isinstance(part, Playback) else "plot"
    return (
        f'<figure id="{key}"><h3>{escape(part.title)}</h3><figcaption>{escape(part.caption)}</figcaption>'
        f'<div class="{kind}" data-figure="{key}"></div></figure>'
    )


def resource(name: str) -> str:
    """Return the text of a file of this folder."""
    return resources.files("quad_report").joinpath(name).read_text(encoding="utf-8")


_METRICS = ("duration", "position_rmse", "position_max", "position_final", "settling_time", "attitude_rmse")


def report_page(flights: Sequence[Flight], names: Sequence[str], command: str) -> Page:
    """Return the report of one flight, or of several of one trajectory in the same figures.

    Each is judged by the limits that its bag notes; the page opens with the worst verdict. Then come of one flight
    three numbers and its playback, of several the table with the best, the error over time and the playback. Raises
    TopicError for a bag without any topic of a flight, FlightLogError for different trajectories.
    """
    runs = runs_of_one_trajectory(flights, names)
    for flight, run in zip(flights, runs, strict=True):
        if not run.tables:
            raise flight.without_topics("there is nothing to report")
    is_alone = len(runs) == 1
    judged = [judgement(flight, run.metrics) for flight, run in zip(flights, runs, strict=True)]
    notes = {name: truth_note(flight) for flight, name in zip(flights, names, strict=True)}
    body: list[Figure | Playback | str] = [heading("", f"{name}: {note}") for name, note in notes.items() if note]
    tables = _tables(runs, judged[0].limits if is_alone else {})
    inside = with_bands(inside_figures(runs), runs)
    error = [figure for figure in inside if figure.key.endswith("-error")]
    others = [figure for figure in inside if not figure.key.endswith("-error")]
    body += [*playback(runs), *tables, *error] if is_alone else [*tables, *error, *playback(runs)]
    trajectory = runs[0].trajectory
    body += [heading("The paper's figures" if trajectory in CASES else "Position and attitude")]
    body += with_bands(paper_figures(runs), runs)
    body += [heading("Inside the flight"), *others, *_flown_with(flights, names)]
    facts = [(name, str(flight.path)) for flight, name in zip(flights, names, strict=True)]
    verdict = next(word for word in ("failed", "unknown", "good") if word in [one.verdict for one in judged])
    texts: dict[str, list[str]] = {}
    for name, each in zip(names, judged, strict=True):
        texts.setdefault(each.text, []).append(name)
    text = judged[0].text if is_alone else "; ".join(f"{', '.join(alike)}: {text}" for text, alike in texts.items())
    lacks = [lack for each in judged for lack in each.unknown]
    title = f"Flight{'s' * (len(names) > 1)} {', '.join(names)}"
    return Page(title, command, facts, body, (verdict, text), _numbers(runs[0].metrics) if is_alone else (), lacks)


def runs_of_one_trajectory(flights: Sequence[Flight], names: Sequence[str]) -> list[Run]:
    """Return the runs of flights that flew the same trajectory; raises FlightLogError of others."""
    runs = [run_from_flight(flight, name) for flight, name in zip(flights, names, strict=True)]
    flown = dict.fromkeys(run.trajectory for run in runs)
    if len(flown) > 1:
        raise FlightLogError(f"found flights of {', '.join(map(repr, flown))}, expected one trajectory")
    return runs


def _numbers(metrics: FlightMetrics) -> list[tuple[str, str]]:
    """Return the three numbers that a flight's page opens with, those that are available."""
    found = []
    for name, text in (("position_rmse", "position error, RMS"), ("position_max", "largest position error")):
        value = getattr(metrics, name)
        if value is not None:
            found.append((f"{value:.3g} m" if value >= 0.1 else f"{1000.0 * value:.3g} mm", text))
    if metrics.attitude_rmse is not None:
        found.append((f"{math.degrees(metrics.attitude_rmse):.3g}°", "attitude error, RMS"))
    return found


def _tables(runs: Sequence[Run], limits: Mapping[str, float]) -> list[str]:
    """Return what was flown, and the metrics: those of a first look and of ``limits``, and folded the rest."""
    trajectory = runs[0].trajectory
    title = CASES.get(trajectory, f"Trajectory {trajectory}" if trajectory else "The flight")
    note = "t = 0 is the start of the flight."
    if any(run.has("reference", "truth") and run.times("truth")[0] < 0.0 for run in runs):
        note = "t = 0 is the start of the trajectory. A double click on a figure shows all that was flown."
    names, values = [run.name for run in runs], [run.metrics for run in runs]
    chosen = {*_METRICS, *limits}
    found = []
    for shown in (chosen, METRICS.keys() - chosen):
        head, *rows = metric_rows(names, values, limits, shown)
        found.append(table(head, *_with_differences(rows, values)) if len(runs) > 1 else table(head, rows))
    return [heading(title, note), found[0], folded("More metrics", found[1])]


def _with_differences(
    rows: Sequence[Sequence[str]], values: Sequence[FlightMetrics]
) -> tuple[list[list[str]], set[tuple[int, int]]]:
    """Return the rows with what each value has more than the least of its row in per cent, and where the least are."""
    found, best = [], set()
    for at, (name, *cells) in enumerate(rows):
        numbers = [getattr(each, name) for each in values]
        known = [each for each in numbers if each is not None]
        if name != "duration" and len(set(known)) > 1:
            least = min(known)
            for column, value in enumerate(numbers):
                if value == least:
                    best.add((at, column + 1))
                elif value is not None and least > 0.0:
                    cells[column] += f" (+{100.0 * (value / least - 1.0):.3g} %)"
        found.append([name, *cells])
    return found, best


def _flown_with(flights: Sequence[Flight], names: Sequence[str]) -> list[str]:
    meanings = "\n".join(f"{name}: {about.meaning}" for name, about in METRICS.items())
    parts = [heading("Parameters, versions and events"), folded("What the metrics mean", verbatim(meanings))]
    for flight, name in zip(flights, names, strict=True):
        if flight.has("flight/events"):
            head = ("t of flight [s]", "severity", "node", "kind", "text")
            rows = [
                (f"{row['stamp_ns'] * 1e-9:.3f}", *(str(row[key]) for key in head[1:]))
                for row in text_table(flight, "flight/events")
            ]
            parts.append(folded(f"{name}: events", table(head, rows)))
        texts = {}
        if flight.has("flight/parameters"):
            newest = {str(row["node"]): str(row["parameters"]) for row in text_table(flight, "flight/parameters")}
            texts.update({f"{node} as flown": text for node, text in sorted(newest.items())})
        texts["what the recorder noted"] = "\n".join(f"{key}: {each}" for key, each in sorted(flight.metadata.items()))
        parts += [folded(f"{name}: {what}", verbatim(text)) for what, text in texts.items() if text]
    return parts
