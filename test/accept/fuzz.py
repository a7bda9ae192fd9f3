"""Every command of `log` on bags drawn by Hypothesis: no traceback, no hang, one line of complaint."""

import contextlib
import io
import os
import resource
import shutil
import signal
import tempfile
import time
import traceback
import warnings
from collections import Counter
from itertools import pairwise
from pathlib import Path

import fuzz_bags
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st

from quad_flight_log import cli

LONGEST = 20  # s of computing for one verb
MEMORY = 4 << 30  # bytes
ALWAYS = (
    ["info"], ["metrics", "--json"], ["check", "--limits", "position_rmse=1"],
    ["hash", "--topics"], ["export", "--out", "csv"],
)  # fmt: skip
SOMETIMES = (["replay"],)
SELDOM = (["report", "--out", "report"], ["view", "--out", "view"])


class HangError(BaseException):
    """A verb computes for too long."""


def hung(_number, _frame):
    raise HangError


class Findings:
    """What went wrong, one bag kept of each kind."""

    def __init__(self, folder):
        self.folder, self.kinds, self.runs = folder, {}, Counter()

    def note(self, kind, bag):
        if kind not in self.kinds:
            kept = self.folder / f"found-{len(self.kinds)}.mcap"
            shutil.copy(bag, kept)
            self.kinds[kind] = kept


def told(words, bag, out):
    """Return (exit code, stdout, stderr) of a verb, or what it raised as one line."""
    places = [str(out / word) if before == "--out" else word for before, word in pairwise(words)]
    command = [words[0], str(bag), *places]
    said, complained = io.StringIO(), io.StringIO()
    signal.setitimer(signal.ITIMER_VIRTUAL, LONGEST)
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(complained), warnings.catch_warnings():
            warnings.simplefilter("default")
            code = cli.main(command)
    except HangError:
        return f"hang: more than {LONGEST} s", "", ""
    except BaseException as error:
        frame = traceback.extract_tb(error.__traceback__)[-1]
        return f"{type(error).__name__}: {str(error)[:100]} at {Path(frame.filename).name}:{frame.lineno}", "", ""
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
    return code, said.getvalue(), complained.getvalue()


def problem_of(words, code, said, complained):
    """Return what is wrong with how a verb ended."""
    if code not in (0, 1, 2):
        return f"{' '.join(words)}: {code}"
    lines = len(complained.splitlines())
    if lines != (1 if code == 2 else 0):
        return f"{' '.join(words)}: exit code {code} with {lines} lines of complaint: {complained[:200]!r}"
    if "\x1b" in said + complained:
        return f"{' '.join(words)}: an escape byte"
    return ""


def one(findings, bag, choice):
    """Write a bag and try every verb on it."""
    with tempfile.TemporaryDirectory(prefix="fuzz-") as name:
        path, out = Path(name, "bag.mcap"), Path(name, "out")
        out.mkdir()
        try:
            fuzz_bags.write(bag, path)
        except (UnicodeEncodeError, OverflowError, ValueError):
            return
        findings.runs["bags"] += 1
        verbs = [*ALWAYS, SOMETIMES[choice % len(SOMETIMES)]]
        verbs += [SELDOM[choice // 8 % len(SELDOM)]] if choice % 8 == 0 else []
        for words in verbs:
            code, said, complained = told(words, path, out)
            findings.runs[words[0]] += 1
            problem = problem_of(words, code, said, complained)
            if problem:
                findings.note(problem, path)


def run(figures):
    findings = Findings(Path(tempfile.mkdtemp(prefix="fuzz-found-")))
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, resource.RLIM_INFINITY))
    signal.signal(signal.SIGVTALRM, hung)
    os.nice(19 - os.nice(0))
    until, rounds = time.monotonic() + figures.seconds(1800.0), 0
    while time.monotonic() < until:

        @seed(rounds)
        @settings(max_examples=40, phases=[Phase.generate], database=None, deadline=None,
                  suppress_health_check=list(HealthCheck))  # fmt: skip
        @given(bag=fuzz_bags.bags(), choice=st.integers(0, 63))
        def some(bag, choice):
            if time.monotonic() < until:
                one(findings, bag, choice)

        some()
        rounds += 1
    figures.show(f"{findings.runs['bags']} bags, {sum(findings.runs.values())} runs: {dict(findings.runs)}")
    for kind, kept in findings.kinds.items():
        figures.check(False, f"{kind} ({kept})")
    figures.check(not findings.kinds, f"tracebacks, hangs and lines too many: {len(findings.kinds)} kinds, 0 wanted")
    if not findings.kinds:
        findings.folder.rmdir()
