"""The mistakes that unit tests must notice, read from ``mistakes/PACKAGE.txt``.

A line without indent names a function. Each line below it is a mistake there: ``EQUATION: `what stands` -> `what it
becomes```, both as ``ast.unparse`` writes code (``\\n`` for the end of a line). What stands must be there exactly once.
"""

import re
from collections.abc import Iterator
from pathlib import Path

from mutation_engine import Mutation, MutationError

FOLDER = Path(__file__).parent / "mistakes"
MISTAKE = re.compile(r"  ([^`]+): `([^`]+)` -> `([^`]*)`")


def read_mistakes(file: Path) -> Iterator[Mutation]:
    """Yield the mistakes of ``file``; raises MutationError naming a line that is none."""
    function = ""
    for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), start=1):
        if not line.startswith(" "):
            function = line
            continue
        found = MISTAKE.fullmatch(line)
        if found is None or not function:
            raise MutationError(f"{file.name}:{number}: found {line!r}, expected a function or a mistake in one")
        equation, old, new = found.groups()
        yield Mutation(equation, function, old.replace("\\n", "\n"), new.replace("\\n", "\n"))


MUTATIONS = [mutation for file in sorted(FOLDER.glob("*.txt")) for mutation in read_mistakes(file)]
