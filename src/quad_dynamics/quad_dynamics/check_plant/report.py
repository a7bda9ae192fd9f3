"""The findings of a check as a table. No ROS."""

from typing import NamedTuple


class Finding(NamedTuple):
    """One line of the contract: ``problem`` empty if it is kept; ``optional`` lines do not fail the check."""

    name: str
    problem: str
    optional: bool = False


class Report:
    """Collects findings; the first problem of a name stays."""

    def __init__(self) -> None:
        """Start empty."""
        self._found: dict[str, Finding] = {}

    def add(self, name: str, problem: str = "", optional: bool = False) -> None:
        """Note that ``name`` was checked and what was wrong."""
        known = self._found.get(name)
        if known is None or (problem and not known.problem):
            self._found[name] = Finding(name, problem, optional)

    @property
    def failed(self) -> list[Finding]:
        """Return the findings that fail the check."""
        return [finding for finding in self._found.values() if finding.problem and not finding.optional]

    def text(self) -> str:
        """Return one line per finding and a last line with the result."""
        lines = []
        for finding in self._found.values():
            verdict = "ok  " if not finding.problem else ("note" if finding.optional else "FAIL")
            lines.append(f"{verdict}  {finding.name}" + (f": {finding.problem}" if finding.problem else ""))
        kept = len(self._found) - len(self.failed)
        lines.append(f"{kept} of {len(self._found)} kept" + ("" if not self.failed else f", {len(self.failed)} broken"))
        return "\n".join(lines)
