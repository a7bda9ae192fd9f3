"""A report as one HTML file that opens from disk without a network: text, tables, figures and plotly.js itself."""

import base64
import hashlib
import html
import json
from collections.abc import Collection, Mapping, Sequence
from importlib import resources
from itertools import zip_longest
from pathlib import Path
from typing import Any, NamedTuple

from quad_flight_log.analysis.metrics import METRICS, FlightMetrics
from quad_flight_log.errors import FlightLogError
from quad_flight_log.report.figures import POINTS, REFERENCE, Figure, Table, runs_of
from quad_flight_log.report.interactive_figures import colours, specification

_FEWEST = 100  # points of a line, however large the page
LARGEST = 14_500_000  # bytes of a page; a bigger one is slow to open


class Section(NamedTuple):
    """One part of a page: figures, tables, texts (title, text) that are folded, and tables ``more`` that are folded."""

    title: str
    note: str = ""
    figures: tuple[Figure, ...] = ()
    tables: tuple[Table, ...] = ()
    folded: tuple[tuple[str, str], ...] = ()
    more: tuple[Table, ...] = ()


class Page(NamedTuple):
    """A whole report. ``command`` made it; ``facts`` are lines of name and value, folded at its end.

    ``verdict``: (whether it is good, the line that says so), first of all; None where nothing was judged. ``numbers``:
    (value, what it is), under the verdict.
    """

    title: str
    command: str
    facts: tuple[tuple[str, str], ...]
    sections: tuple[Section, ...]
    verdict: tuple[bool, str] | None = None
    numbers: tuple[tuple[str, str], ...] = ()


def write_page(page: Page, path: Path) -> Path:
    """Write the page; raises FlightLogError if plotly is not installed or the file cannot be written."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(page_text(page), encoding="utf-8")
    except OSError as error:
        raise FlightLogError(f"{path}: {error.strerror or error}") from error
    return path


def page_text(page: Page) -> str:
    """Return the HTML of a page, its lines thinned further where it would be larger than ``LARGEST``."""
    library = _library()
    points = POINTS
    text = _assembled(page, library, points)
    while len(text) > LARGEST and points > _FEWEST:
        room = (LARGEST - len(library)) / (len(text) - len(library))
        points = max(_FEWEST, int(0.9 * room * points))
        text = _assembled(page, library, points)
    return text


def _assembled(page: Page, library: str, points: int) -> str:
    figures = [figure for section in page.sections for figure in section.figures]
    runs = runs_of(figures)
    colour = colours(runs)
    data: dict[str, Any] = {}
    for figure in figures:
        if figure.key in data:
            raise ValueError(f"two figures with the key {figure.key!r}")
        data[figure.key] = {**specification(figure, colour, points), "time": figure.over_time}
    body = "\n".join(_section(index, section) for index, section in enumerate(page.sections))
    drawing = _resource("page.js")
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{_policy(library, drawing)}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<link rel="icon" href="data:,">
<title>{html.escape(page.title)}</title>
<style>{_resource("page.css")}</style>
</head>
<body>
<header><h1>{html.escape(page.title)}</h1>
{_verdict(page)}{_numbers(page)}</header>
{_bar(runs, colour)}
<main>
{body}
{_facts(page)}
</main>
<script>{library}</script>
<script type="application/json" id="report-data">{_json(data)}</script>
<script>{drawing}</script>
</body>
</html>
"""


def _policy(*scripts: str) -> str:
    """Return the policy of the page: these scripts and no others, nothing from elsewhere, nothing sent."""
    digests = [base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() for text in scripts]
    hashes = " ".join(f"'sha256-{digest}'" for digest in digests)
    # plotly makes the programs of its figures in space with new Function
    return (
        f"default-src 'none'; script-src {hashes} 'unsafe-eval'; style-src 'unsafe-inline'; "
        "img-src data: blob:; base-uri 'none'; form-action 'none'"
    )


def _verdict(page: Page) -> str:
    if page.verdict is None:
        return ""
    good, text = page.verdict
    return f'<p class="verdict {"good" if good else "bad"}">{html.escape(text)}</p>\n'


def _facts(page: Page) -> str:
    rows = "".join(f"<tr><td>{html.escape(name)}</td><td>{html.escape(value)}</td></tr>" for name, value in page.facts)
    table = f'<div class="scroll"><table class="facts">{rows}</table></div>' if rows else ""
    made = f'<p class="note">Made by</p><pre>{html.escape(page.command)}</pre>'
    return f"<details><summary>Where this comes from</summary>{table}{made}</details>"


def _numbers(page: Page) -> str:
    items = [f"<div><b>{html.escape(value)}</b>{html.escape(name)}</div>" for value, name in page.numbers]
    return f'<div class="numbers">{"".join(items)}</div>\n' if items else ""


def _bar(runs: list[str], colour: dict[str, str]) -> str:
    boxes = []
    for run in runs:
        label = "the reference" if run == REFERENCE else run
        swatch = f'<span class="swatch" style="background:{colour[run]}"></span>'
        name = html.escape(run, quote=True)
        boxes.append(f'<label><input type="checkbox" checked data-run="{name}">{swatch}{html.escape(label)}</label>')
    boxes.append('<label><input type="checkbox" id="link-time" checked>zoom time in all figures</label>')
    return f'<nav id="bar"><form autocomplete="off">{"".join(boxes)}</form></nav>'


def _section(index: int, section: Section) -> str:
    title = f"<h2>{html.escape(section.title)}</h2>" if section.title else ""
    parts = [f'<section id="part-{index}">{title}']
    if section.note:
        parts.append(f'<p class="note">{html.escape(section.note)}</p>')
    parts += [_table(table) for table in section.tables]
    parts += [_figure(figure) for figure in section.figures]
    for table in section.more:
        inside = _table(table._replace(title=""))
        parts.append(f"<details><summary>{html.escape(table.title)}</summary>{inside}</details>")
    for head, text in section.folded:
        parts.append(f"<details><summary>{html.escape(head)}</summary><pre>{html.escape(text)}</pre></details>")
    return "\n".join([*parts, "</section>"])


def _figure(figure: Figure) -> str:
    key, title, caption = (html.escape(text, quote=True) for text in (figure.key, figure.title, figure.caption))
    return (
        f'<figure id="{key}"><h3>{title}</h3><figcaption>{caption}</figcaption>'
        f'<div class="plot" data-figure="{key}"></div></figure>'
    )


def _table(table: Table) -> str:
    head = "".join(f"<th>{html.escape(cell)}</th>" for cell in table.head)
    rows = "".join(
        f"<tr{hint}>{''.join(f'<td>{html.escape(cell)}</td>' for cell in row)}</tr>"
        for row, hint in zip_longest(table.rows, _titles(table.hints), fillvalue="")
    )
    note = f'<p class="note">{html.escape(table.note)}</p>' if table.note else ""
    title = f"<h3>{html.escape(table.title)}</h3>" if table.title else ""
    return f'{title}{note}<div class="scroll"><table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>'


def _titles(hints: Sequence[str]) -> list[str]:
    return [f' title="{html.escape(hint, quote=True)}"' for hint in hints]


def metric_table(
    names: Sequence[str],
    values: Sequence[FlightMetrics],
    title: str,
    limits: Mapping[str, float] | None = None,
    shown: Collection[str] = tuple(METRICS),
) -> Table:
    """Return a table of metrics, a column per flight, with the limits that one flight was held to, if any."""
    limits = limits or {}
    rows = []
    for name, about in METRICS.items():
        if name not in shown:
            continue
        numbers = [getattr(item, name) for item in values]
        cells = ["n/a" if number is None else f"{number:.5g}" for number in numbers]
        limit = [f"{limits[name]:.5g}" if name in limits else ""] if limits else []
        rows.append((name, *cells, about.unit, *limit))
    head = ("metric", *names, "unit", *(("limit",) if limits else ()))
    return Table(
        title, head, tuple(rows), hints=tuple(about.meaning for name, about in METRICS.items() if name in shown)
    )


def _json(data: dict[str, Any]) -> str:
    """Return JSON that cannot end the script element it stands in."""
    return json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")


def _library() -> str:
    try:
        from plotly.offline import get_plotlyjs
    except ImportError as error:
        raise FlightLogError("the report needs plotly: pip install -r requirements/extras.txt") from error
    return str(get_plotlyjs())


def _resource(name: str) -> str:
    return resources.files("quad_flight_log.report").joinpath(name).read_text(encoding="utf-8")
