"""A list of findings: what was done, what happened before, and the reproduction that says what happens now."""

import stat
import subprocess
import sys
import tempfile
from pathlib import Path

from figures import Figures
from flying import ROOT

FINDINGS = []


def finding(text, before):
    """Register a function that reproduces ``text`` and returns whether it is mended, and what was seen."""

    def keep(function):
        FINDINGS.append((text, before, function))
        return function

    return keep


def by_tests(text, before, *tests, also=""):
    """Register a finding that ``tests`` of the suite reproduce; ``also``: longer runs that do, for people."""

    @finding(text, before)
    def passed(_folder):
        words = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *tests]
        done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
        last = done.stdout.strip().splitlines()[-1] if done.stdout.strip() else done.stderr.strip()[-200:]
        return done.returncode == 0, f"{last}{f'; also {also}' if also else ''}"


def reproduce():
    """Reproduce all that is registered, each in an empty folder of its own; returns the exit code."""
    figures = Figures()
    for text, before, function in FINDINGS:
        with tempfile.TemporaryDirectory(prefix="finding-") as name:
            folder = Path(name)
            folder.chmod(stat.S_IRWXU)
            good, seen = function(folder)
        figures.check(good, f"{text} | before: {before} | now: {seen}")
    return figures.code()
