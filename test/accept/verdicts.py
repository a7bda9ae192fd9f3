"""Recordings cut in flight, none of which is good, and whole ones, which are what the original is.

``scripts/accept verdicts --each N``: N of each, by default 40, at random places of five flights (two fail), in every
form of ``other_recorders.FORMS`` and as our own recorder leaves them.
"""

import contextlib
import io
import random
from collections import Counter

import flying
import other_recorders

from quad_analysis.flight_checks import judgement
from quad_analysis.tables import measured
from quad_flight_log.reader import open_flight
from quad_report import cli

FLIGHTS = {
    "hover": ("hover", "--duration", "3"),
    "case2": ("case2", "--duration", "4"),
    "mission": ("--mission", "takeoff:1,hold:3,land"),
    "limit": ("hover", "--duration", "3", "--limits", "position_rmse=0.0001"),
    "fell": ("hover", "--duration", "9", "--scenario", "./link.yaml"),
}
LOST = """/**/simulator:
  ros__parameters:
    disturbance: timeline
    timeline:
      events: |
        link start=4 drop=1
"""
COMMANDS = ("check", "metrics", "hash", "replay", "report")


def run(figures):
    (figures.folder / "link.yaml").write_text(LOST)
    bags = {}
    for name, words in FLIGHTS.items():
        bags[name] = figures.folder / name
        done = flying.finish(flying.start(*words, "--out", bags[name], cwd=figures.folder), 900.0)
        figures.check((done.returncode == 0) == (name not in ("limit", "fell")), f"{name}: exit code {done.returncode}")
    draw, each, found = random.Random(40), figures.each(40), Counter()
    for number in range(each):
        name, form = draw.choice(list(bags)), draw.choice(["ours", *other_recorders.FORMS])
        cut, whole = (made(bags[name], figures.folder, number, form, draw, cut=cut) for cut in (True, False))
        limits = noted_limits(bags[name])
        original = verdict(bags[name], limits)
        found[f"cut: {verdict(cut, limits)[0]}"] += 1
        found["whole: as the original"] += verdict(whole, limits) == original
        good = [command for command in COMMANDS if code(command, cut) == 0]
        figures.check(not good, f"{number}: {form} of {name}, cut: exit code 0 of {good}")
        figures.check(
            verdict(whole, limits) == original, f"{number}: {form} of {name}, whole: {verdict(whole, limits)}"
        )
    figures.check(not found["cut: good"], f"{each} cut recordings: {dict(found)}")


def made(bag, folder, number, form, draw, *, cut):
    """Return the path of a recording of ``bag``, cut between its first and last step or whole."""
    path = folder / f"{number}-{form.replace(' ', '-')}-{'cut' if cut else 'whole'}"
    if form == "ours":
        if not cut:
            return bag
        data = next(bag.glob("*.mcap")).read_bytes()
        path.mkdir()
        (path / "bag_0.mcap").write_bytes(data[: int(len(data) * draw.uniform(0.2, 0.8))])
        return path
    sent = other_recorders.received(bag)
    steps = [place for place, one in enumerate(sent) if one.topic == "/truth"]
    until = steps[int(len(steps) * draw.uniform(0.02, 0.999))] if cut else len(sent)
    return other_recorders.FORMS[form](path, sent[:until])


def noted_limits(bag):
    """Return what a flight was held to, which only our recorder notes."""
    flight = open_flight(bag)
    return judgement(flight, measured(flight)).limits


def verdict(bag, limits):
    """Return the verdict on a bag and what speaks against the flight."""
    flight = open_flight(bag)
    judged = judgement(flight, measured(flight), limits)
    return judged.verdict, judged.problems


def code(command, bag):
    """Return the exit code of a command of ``log``."""
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        return cli.main([command, str(bag)])
