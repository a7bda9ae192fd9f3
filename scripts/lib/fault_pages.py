"""docs/reference/faults.md: what happens when something fails, from the table test/fault_rows.yaml."""

import re
from collections import Counter
from pathlib import Path
from typing import Any

import yaml

ROOT = Path(__file__).resolve().parents[2]
ROWS = ROOT / "test" / "fault_rows.yaml"
STATES = ("tested", "reasoned", "open")
HEAD = """# What can fail, and what happens then

Every row is a fault that is known from flights of this kind. *tested*: the named tests fail if it ends otherwise;
*reasoned*: no test of the whole, but a reason; **open**: not handled as it should be, or not shown. What an operator
does: [safety](../explanation/safety.md).
"""


def fault_rows() -> list[dict[str, Any]]:
    """Return the rows in order; each has fault, happens, state, tests, outcome."""
    found: list[dict[str, Any]] = yaml.safe_load(ROWS.read_text(encoding="utf-8"))
    return found


def problems(rows: list[dict[str, Any]]) -> list[str]:
    """Return what is wrong with the table: a field that lacks, a test that is not there, a claim without a test."""
    found = []
    for number, row in enumerate(rows, 1):
        where = f"row {number}"
        if set(row) != {"fault", "happens", "state", "tests", "outcome"} or not all(
            row[key] for key in row if key != "tests"
        ):
            found.append(f"{where}: found {sorted(row)}, expected fault, happens, state, tests, outcome")
            continue
        if row["state"] not in STATES:
            found.append(f"{where}: state {row['state']!r}, expected one of {', '.join(STATES)}")
        if row["state"] == "tested" and not row["tests"]:
            found.append(f"{where}: tested by nothing")
        found += [f"{where}: no test {name}" for name in row["tests"] if not exists(name)]
    return found


def exists(name: str) -> bool:
    """Return whether a test, FILE::NAME, or a module of the acceptance runs, ``accept NAME``, is there."""
    module = name.removeprefix("accept ")
    if module != name:
        return (ROOT / "test" / "accept" / f"{module}.py").is_file()
    file, _, function = name.partition("::")
    path = ROOT / file
    return (
        path.is_file()
        and re.search(rf"^def test_{function}\(", path.read_text(encoding="utf-8"), re.MULTILINE) is not None
    )


def faults_page() -> str:
    """Return docs/reference/faults.md without the line that says it is generated."""
    rows = fault_rows()
    count = Counter(row["state"] for row in rows)
    summary = f"{len(rows)} rows: {count['tested']} tested, {count['reasoned']} reasoned, {count['open']} open.\n"
    lines = ["| | fault | what happens | state | outcome | shown by |", "|---|---|---|---|---|---|"]
    for number, row in enumerate(rows, 1):
        state = f"**{row['state']}**" if row["state"] == "open" else row["state"]
        tests = ", ".join(_short(name, count) for count, name in enumerate(row["tests"], 1))
        lines.append(f"| {number} | {row['fault']} | {row['happens']} | {state} | {row['outcome']} | {tests} |")
    return "\n".join([HEAD, summary, *lines, ""])


def _short(name: str, count: int) -> str:
    module = name.removeprefix("accept ")
    if module != name:
        return f"`scripts/accept {module}`"
    return f"[test {count}](../../{name.partition('::')[0]})"
