"""SHA-256 of whole flights without ROS: equal digests are equal bits of every step topic.

Examples:
  python test/digests.py                      the short flights, plain Python
  python test/digests.py --whole --compiled   the long ones, compiled
  python test/digests.py --only case          only those whose name holds this regular expression
  python test/digests.py --write              renew test/digests.json after a change that is meant
"""

import argparse
import hashlib
import json
import re
import sys
from pathlib import Path

from quad_flight.flight import fly, from_names

FILE = Path(__file__).with_suffix(".json")
LATE = "simulator.sensor.delay=0.01"
LOST = Path(__file__).parent / "digests_lost.yaml"
WHOLE = {"case1 whole": {"case": "case1"}, "case2 whole": {"case": "case2"}}
SHORT = {
    "case1": {"case": "case1", "duration": 4.0},
    "case2": {"case": "case2", "duration": 4.0},
    "lemniscate": {"case": "lemniscate", "duration": 4.0},
    "hover, sensors and rotor lag": {"case": "hover", "vehicle": "x500", "duration": 4.0, "settings": [LATE]},
    "guard's descent": {"case": "hover", "duration": 4.0, "scenario": str(LOST)},
    **{
        f"hover, {position} and {attitude}": {
            "case": "hover",
            "vehicle": "x500",
            "position": position,
            "attitude": attitude,
            "duration": 2.0,
        }
        for position, attitude in (
            ("ibs", "itsm"),
            ("pid", "pid"),
            ("se3", "se3"),
            ("geometric_pid", "geometric_pid"),
            ("indi", "indi"),
            ("l1", "abfnitsm_so3"),
        )
    },
}


def digest_of(choices, compiled=False):
    """Return the SHA-256 over outcome, names and bytes of all topics of the flight of ``from_names(**choices)``."""
    result = fly(from_names(**choices), compiled=compiled)
    found = hashlib.sha256(result.outcome.encode())
    for topic, rows in sorted(result.topics.items()):
        found.update(topic.encode())
        for name in rows.dtype.names:
            found.update(name.encode() + rows[name].tobytes())
    return found.hexdigest()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--whole", action="store_true", help="the whole cases instead of the short flights")
    parser.add_argument("--compiled", action="store_true", help="compiled by Numba")
    parser.add_argument("--only", default="", metavar="PATTERN", help="flights whose name holds this expression")
    parser.add_argument("--write", action="store_true", help="write all of them to test/digests.json")
    options = parser.parse_args()
    if options.write:
        found = {name: digest_of(choices) for name, choices in {**SHORT, **WHOLE}.items()}
        FILE.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
        return 0
    wanted, different = json.loads(FILE.read_text(encoding="utf-8")), 0
    for name, choices in (WHOLE if options.whole else SHORT).items():
        if re.search(options.only, name):
            found = digest_of(choices, options.compiled)
            different += found != wanted[name]
            print(f"{'ok  ' if found == wanted[name] else 'FAIL'} {name}: {found[:16]}", flush=True)
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(main())
