"""Findings of users and attackers: what was done, what happened before, and what the tests of ``findings.yaml`` see."""

import stat
import subprocess
import sys
import tempfile
from pathlib import Path

import yaml
from figures import Figures
from flying import ROOT

TABLE = Path(__file__).with_suffix(".yaml")
FINDINGS = []


def finding(text, before):
    """Register a function that reproduces ``text`` and returns whether it is mended, and what was seen."""

    def keep(function):
        FINDINGS.append((text, before, function))
        return function

    return keep


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


def shown(table):
    """Run the tests of each row of ``table``, a path, and print what was before and what is now; the exit code."""
    figures = Figures()
    for row in yaml.safe_load(table.read_text(encoding="utf-8")):
        words = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *row["tests"]]
        done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
        last = (done.stdout.strip() or done.stderr[-200:] or "nothing").splitlines()[-1]
        now = f"{row['now']} ({last})" if "now" in row else last
        also = f"; also {row['also']}" if "also" in row else ""
        figures.check(done.returncode == 0, f"{row['finding']} | before: {row['before']} | now: {now}{also}")
    return figures.code()


def main():
    return shown(TABLE)
