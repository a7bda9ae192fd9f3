"""Which of our sources need a ROS 2: the tests that need one take turns, the API pages leave such modules out."""

import re
import sys
from pathlib import Path

_IMPORT = re.compile(
    r"^\s*(?:import|from) (?:rclpy|quad_node|quad_[\w.]+\.node|\w+_msgs|\w+_interfaces)\b", re.MULTILINE
)
_UNIT_FILE = re.compile(r"^pytestmark = .*\bmark\.unit\b", re.MULTILINE)
ROOT = Path(__file__).resolve().parents[2]
WHOLE_STACK = ROOT / "test"


def imports_ros(source: str) -> bool:
    """Return whether a module's text imports ROS."""
    return _IMPORT.search(source) is not None


def kinds_of(path: Path, source: str) -> set[str]:
    """Return which tests a test file may hold: "ros", those that need it, "plain", those that do not.

    In ``test/`` a test needs ROS unless it is marked as unit.
    """
    if imports_ros(source):
        return {"ros"}
    if WHOLE_STACK not in path.parents or _UNIT_FILE.search(source):
        return {"plain"}
    return {"ros", "plain"} if "mark.unit" in source else {"ros"}


def main() -> None:
    """Print the test files that hold tests of the kind that the first argument names.

    In reverse order those of the whole stack, which take longest, come first.
    """
    places = ("src/*/test", "studies/test", "test")
    files = sorted((path for place in places for path in ROOT.glob(f"{place}/**/test_*.py")), reverse=True)
    print("\n".join(str(file) for file in files if sys.argv[1] in kinds_of(file, file.read_text("utf-8"))))


if __name__ == "__main__":
    main()
