"""Lint of pure text: what would make CPython and Numba disagree by a bit, or what Numba cannot compile.

Checked are the functions of the plug-in contract and every function that they reach, plug-ins of other packages
included; set-up helpers that they do not reach (``draw``, metadata) may use all of Python. Run over all that is
installed with ``python -m quad_core.purity``. The rules themselves stand in ``purity_rules``.
"""

import sys
from collections.abc import Callable, Iterable
from types import ModuleType
from typing import Any

from quad_core import plugins
from quad_core.cascade import GROUPS
from quad_core.purity_rules import Finding, examined


def check_plugin(group: str, module: ModuleType) -> list[Finding]:
    """Return what breaks the rules in the functions of ``module`` that ``group`` demands, and all they reach."""
    contract = GROUPS[group]
    in_flight = [getattr(module, name) for name in contract.in_flight]
    return check(in_flight, [getattr(module, name) for name in contract.before])


def check(functions: Iterable[Callable[..., Any]], before_flight: Iterable[Callable[..., Any]] = ()) -> list[Finding]:
    """Return what breaks the rules in ``functions`` and all they reach.

    Functions ``before_flight``, run once before step 0, and what only they reach may raise an error of constant text.
    """
    seen: set[Any] = set()
    findings: list[Finding] = []
    for roots, may_raise in ((functions, False), (before_flight, True)):
        waiting = list(roots)
        while waiting:
            function = waiting.pop()
            if function in seen:
                continue
            seen.add(function)
            found, reached = examined(function, may_raise)
            findings += found
            waiting += reached
    return sorted(set(findings))


def check_installed() -> list[Finding]:
    """Return the findings of every installed plug-in of every group, those with ``COMPILES = False`` left out."""
    modules = [(group, plugins.load(group, name)) for group in GROUPS for name in plugins.names(group)]
    found = [check_plugin(group, module) for group, module in modules if getattr(module, "COMPILES", True)]
    return sorted({finding for findings in found for finding in findings})


def main() -> int:
    """Check every installed plug-in; exit code 1 if something was found."""
    findings = check_installed()
    sys.stdout.writelines(f"{finding}\n" for finding in findings)
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
