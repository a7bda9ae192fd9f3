"""Feed recorded inputs to the controllers again and compare their answers with the recorded ones.

With the recorded law and parameters every bit must be the same (exit 1 if not). With --set, --preset or another law
the difference is shown. --out writes every replayed number beside the recorded one.
"""

import argparse
import json

from quad_core.cascade import ATTITUDE, POSITION, STAGE
from quad_core.parameters import ParameterError
from quad_core.resolution import parse_settings
from quad_flight_log.analysis.replay import Replay, replay
from quad_flight_log.bag.export import write_csv
from quad_flight_log.errors import FlightLogError
from quad_flight_log.report.text import text_table
from quad_flight_log.verbs.common import add_bags, opened, progress

OWN_OUT = True
EXAMPLES = """examples:
  log replay flights/case1-1-1
  log replay flights/case1-1-1 --set position_controller.aibs.x.position_gain=3.5
  log replay flights/case1-1-1 --attitude itsm --out replayed"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add BAG and what is to be different."""
    add_bags(parser, several=False)
    parser.add_argument("--position", metavar="LAW", help="another position law")
    parser.add_argument("--attitude", metavar="LAW", help="another attitude law")
    parser.add_argument("--only", choices=sorted(STAGE), help="replay only this controller")
    parser.add_argument(
        "--set", action="append", default=[], dest="settings", metavar="NODE.PARAM=VALUE", help="may be repeated"
    )
    parser.add_argument("--json", action="store_true", help="print JSON")


def run(options: argparse.Namespace) -> int:
    """Print one block per controller."""
    (flight,) = opened(options)
    try:
        settings = parse_settings(options.settings)
    except ParameterError as error:
        raise FlightLogError(str(error)) from error
    strangers = [role for role in settings if role not in (*STAGE, "/**")]
    if strangers:
        raise FlightLogError(f"--set {strangers[0]}: only {' and '.join(STAGE)} are replayed")
    found = []
    for role in [options.only] if options.only else STAGE:
        changes = {**settings.get("/**", {}), **settings.get(role, {})}
        law = {POSITION: options.position, ATTITUDE: options.attitude}
        found.append(replay(flight, role, law=law.get(role), settings=changes, progress=progress(role, " steps")))
    print(as_json(found) if options.json else "\n".join(as_text(item) for item in found))
    if options.out:
        options.out.mkdir(parents=True, exist_ok=True)
        (options.out / "replay.json").write_text(as_json(found), encoding="utf-8")
        for item in found:
            columns = {"step": item.steps}
            for name in item.recorded:
                columns[f"{name} recorded"], columns[f"{name} replayed"] = item.recorded[name], item.replayed[name]
            write_csv(options.out / f"replay_{item.role}.csv", columns)
    return 0 if all(item.equal or item.changed for item in found) else 1


def as_text(item: Replay) -> str:
    """Return the result for people: one line if all is equal, else the numbers that differ."""
    kind = "changed parameters" if item.changed else "recorded parameters"
    head = f"{item.role}: {item.law}, {kind}, {len(item.steps)} steps, {len(item.recorded)} numbers each"
    lines = [head, *(f"  {note}" for note in item.notes)]
    if item.missing:
        lines.append(f"  {item.missing} steps were answered only in one of record and replay")
    differing = [difference for difference in item.differences() if difference.differing]
    if not differing:
        return "\n".join([*lines, "  every bit is equal" if item.equal else "  nothing differs where both answered"])
    rows = [["number", "steps that differ", "first", "largest", "rms", "recorded rms"]]
    for one in differing:
        numbers = (one.largest, one.rms, one.recorded_rms)
        rows.append([one.name, str(one.differing), str(one.first_step), *(f"{number:.4g}" for number in numbers)])
    lines += [f"  {line}" for line in text_table(rows, right=range(1, 6)).splitlines()]
    return "\n".join(lines)


def as_json(items: list[Replay]) -> str:
    """Return the result for programs."""
    content = [
        {
            "role": item.role,
            "law": item.law,
            "changed": item.changed,
            "equal": item.equal,
            "steps": len(item.steps),
            "missing": item.missing,
            "notes": item.notes,
            "differences": [one._asdict() for one in item.differences() if one.differing],
        }
        for item in items
    ]
    return json.dumps(content, indent=2)
