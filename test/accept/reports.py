"""The reports of a flight, a comparison and a study of whole flights: size, time to build, look in a browser."""

import json
import sys
import tempfile
import time
from pathlib import Path

import flying
import numpy as np
import pandas
from figures import Figures

sys.path.insert(0, str(flying.ROOT / "scripts" / "lib"))
sys.path.insert(0, str(flying.ROOT / "studies"))
from headless_browser import Browser, browser_path
from study_report import write_report

from quad_flight_log.analysis.metrics import METRICS
from quad_flight_log.analysis.tables import TOPICS
from quad_flight_log.bag.reader import open_flight
from quad_flight_log.report.flight_figures import run_from_flight
from quad_flight_log.report.page import write_page
from quad_flight_log.report.pages import comparison_page, flight_page

CASES = ("case1", "case2")
CONTROLLERS = ("first", "second", "third", "fourth")
SEEDS = 50
LARGEST = 15.0  # MB
LONGEST = 60.0  # s
PATIENCE = 900.0  # s for one flight


def main():
    figures = Figures()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for case in CASES:
            done = flying.finish(flying.start(case, "--out", folder / case), PATIENCE)
            assert done.returncode == 0, done.stdout + done.stderr
        flights = {case: open_flight(folder / case) for case in CASES}
        pages = {
            "flight": lambda: write_page(flight_page(flights["case1"], "case1", ""), folder / "flight.html"),
            "comparison": lambda: write_page(
                comparison_page(list(flights.values()), list(flights), ""), folder / "both.html"
            ),
            "study": lambda: write_report(study(folder / "study", flights)),
        }
        for title, build in pages.items():
            began = time.monotonic()
            page = build()
            figures.at_most(f"{title}: time to build", time.monotonic() - began, LONGEST, "s")
            figures.at_most(f"{title}: size", page.stat().st_size / 1e6, LARGEST, "MB")
            if browser_path():
                seen(figures, title, page, folder / f"profile-{title}")
        if not browser_path():
            print("     no Chromium is installed: the pages were not opened")
    return figures.code()


def seen(figures, title, page, profile):
    """Open a page and check what a reader would notice."""
    with Browser(profile, patience=300.0) as browser:
        began = time.monotonic()
        browser.open(page.as_uri())
        browser.wait("document.body.dataset.drawn")
        drawn = int(browser.value("document.body.dataset.drawn"))
        print(f"     {title}: {drawn} figures drawn in {time.monotonic() - began:.1f} s without a graphics card")
        figures.check(drawn == browser.value("document.querySelectorAll('figure').length"), f"{title}: all are drawn")
        figures.check(not browser.problems, f"{title}: {len(browser.problems)} errors in the console")
        others = [url for url in browser.requests if not url.startswith(("data:", "blob:"))]
        figures.check(others == [page.as_uri()], f"{title}: {len(others)} file loaded")


def study(folder, flights):
    """Write the files of a study of the usual size, made of the two flights again and again."""
    if not (folder / "study.json").exists():
        (folder / "examples").mkdir(parents=True)
        rows, summary = [], []
        for case, flight in flights.items():
            values = {name: value or 0.0 for name, value in run_from_flight(flight, case).metrics._asdict().items()}
            tables = flat(flight)
            for controller in CONTROLLERS:
                np.savez(folder / "examples" / f"{controller}-{case}.npz", **tables)
                key = {"controller": controller, "case": case, "plant": "rigid_body"}
                rows += [{**key, "seed": seed, "outcome": "ended", "steps": 1, **values} for seed in range(SEEDS)]
                numbers = dict.fromkeys(("difference", "difference_low", "difference_high"), 0.0)
                summary += [
                    {**key, "metric": name, "median": value, "low": value, "high": value, **numbers}
                    for name, value in values.items()
                ]
        pandas.DataFrame(rows).to_parquet(folder / "flights.parquet")
        pandas.DataFrame(summary).to_parquet(folder / "summary.parquet")
        facts = {
            "name": "size", "command": "scripts/accept reports", "cases": list(flights), "plants": ["rigid_body"],
            "seeds": list(range(SEEDS)), "controllers": {name: {"title": name} for name in CONTROLLERS},
            "metrics": {name: list(about) for name, about in METRICS.items()},
        }  # fmt: skip
        (folder / "study.json").write_text(json.dumps(facts))
    return folder


def flat(flight):
    """Return the step topics as the ROS-free loop gives them: the wrench as thrust and torque, no texts."""
    tables = flight.arrays(*(topic for topic in TOPICS if flight.has(topic)))
    wrench = tables["wrench_setpoint"]
    made = np.empty(len(wrench), [("stamp_ns", "i8"), ("thrust", "f8"), ("torque_b", "f8", 3)])
    made["stamp_ns"], made["thrust"] = wrench["stamp_ns"], wrench["wrench"]["force"]["z"]
    made["torque_b"] = np.stack([wrench["wrench"]["torque"][axis] for axis in "xyz"], axis=1)
    tables["wrench_setpoint"] = made
    return {name: table[[f for f in table.dtype.names if table.dtype[f].kind != "O"]] for name, table in tables.items()}
