"""A report as one HTML file that opens from disk without a network: text, tables, figures, viewer and plotly.js."""

import base64
import hashlib
import json
from collections.abc import Collection, Sequence
from html import escape
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple

from quad_flight_log.errors import FlightLogError
from quad_flight_log.report.figures import REFERENCE, Figure, colours, drawn, runs_of
from quad_flight_log.report.scene import Playback, scene


class Page(NamedTuple):
    """A whole report: ``body`` holds figures, playbacks and HTML of the functions below, in order.

    ``command`` made it; ``facts`` are lines of name and value, folded at its end. ``verdict``: good, failed or
    unknown, and the line that opens the page; None where nothing was judged. ``numbers``: (value, what it is).
    """

    title: str
    command: str
    facts: Sequence[tuple[str, str]]
    body: Sequence[Figure | Playback | str]
    verdict: tuple[str, str] | None = None
    numbers: Sequence[tuple[str, str]] = ()


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
    scripts += [_library(), resource("page.js")] if parts else []
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


def _library() -> str:
    try:
        from plotly.offline import get_plotlyjs
    except ImportError as error:
        raise FlightLogError("the report needs plotly: pip install -r requirements/extras.txt") from error
    return str(get_plotlyjs())


def resource(name: str) -> str:
    """Return the text of a file of this folder."""
    return resources.files("quad_flight_log.report").joinpath(name).read_text(encoding="utf-8")
