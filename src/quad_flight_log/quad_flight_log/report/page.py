"""A report as one HTML file that opens from disk without a network: text, tables, figures and plotly.js itself."""

import json
from collections.abc import Sequence
from html import escape
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple

from quad_flight_log.errors import FlightLogError
from quad_flight_log.report.figures import REFERENCE, Figure, colours, runs_of, specification

_POLICY = "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval'; style-src 'unsafe-inline'; img-src data: blob:"


class Page(NamedTuple):
    """A whole report: ``body`` holds figures and HTML of the functions below, in order.

    ``command`` made it; ``facts`` are lines of name and value, folded at its end. ``verdict``: good, failed or
    unknown, and the line that opens the page; None where nothing was judged. ``numbers``: (value, what it is).
    """

    title: str
    command: str
    facts: Sequence[tuple[str, str]]
    body: Sequence[Figure | str]
    verdict: tuple[str, str] | None = None
    numbers: Sequence[tuple[str, str]] = ()


def heading(title: str, note: str = "") -> str:
    """Return the HTML of a heading and the line under it."""
    return (f"<h2>{escape(title)}</h2>" if title else "") + (f'<p class="note">{escape(note)}</p>' if note else "")


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return the HTML of a table of text."""
    above = "".join(f"<th>{escape(cell)}</th>" for cell in head)
    body = "".join(f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>" for row in rows)
    return f'<div class="scroll"><table><thead><tr>{above}</tr></thead><tbody>{body}</tbody></table></div>'


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
    figures = [part for part in page.body if isinstance(part, Figure)]
    runs = runs_of(figures)
    colour = colours(runs)
    data: dict[str, Any] = {}
    for figure in figures:
        if figure.key in data:
            raise ValueError(f"two figures with the key {figure.key!r}")
        data[figure.key] = {**specification(figure, colour), "time": figure.over_time}
    # no JSON may end the script element that holds it
    drawn = json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    body = "\n".join(_figure(part) if isinstance(part, Figure) else part for part in page.body)
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{_POLICY}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<link rel="icon" href="data:,">
<title>{escape(page.title)}</title>
<style>{_resource("page.css")}</style>
</head>
<body>
<header><h1>{escape(page.title)}</h1>
{_opening(page)}</header>
{_bar(runs, colour)}
<main>
{body}
{_source(page)}
</main>
<script>{_library()}</script>
<script type="application/json" id="report-data">{drawn}</script>
<script>{_resource("page.js")}</script>
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


def _figure(figure: Figure) -> str:
    key = escape(figure.key)
    return (
        f'<figure id="{key}"><h3>{escape(figure.title)}</h3><figcaption>{escape(figure.caption)}</figcaption>'
        f'<div class="plot" data-figure="{key}"></div></figure>'
    )


def _library() -> str:
    try:
        from plotly.offline import get_plotlyjs
    except ImportError as error:
        raise FlightLogError("the report needs plotly: pip install -r requirements/extras.txt") from error
    return str(get_plotlyjs())


def _resource(name: str) -> str:
    return resources.files("quad_flight_log.report").joinpath(name).read_text(encoding="utf-8")
