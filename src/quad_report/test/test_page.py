"""The page holds its data, escapes what it is given and needs no other file."""

import base64
import hashlib
import json
import re

import drawn_flights
import numpy as np
import pytest

from quad_flight_log.errors import FlightLogError
from quad_flight_log.reader import open_flight
from quad_report.cli import main
from quad_report.figures import REFERENCE, Band, Figure, Line, Panel
from quad_report.flight_figures import playback
from quad_report.page import Page, folded, heading, page_text, report_page, table, verbatim, write_page

plotly = pytest.importorskip("plotly.graph_objects")


def data_of(text):
    found = re.search(r'<script type="application/json" id="report-data">(.*?)</script>', text, re.DOTALL)
    return json.loads(found[1])


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    return drawn_flights.bag(tmp_path_factory.mktemp("report") / "circle", steps=260)


@pytest.fixture(scope="module")
def text(bag):
    return page_text(report_page([open_flight(bag)], ["circle"], "log report circle"))


def test_flight_page_tells_what_the_bag_holds(text):
    data = data_of(text)
    assert next(iter(data)) == "figure-05-case1-path"
    assert sum(key.startswith("figure-") for key in data) == 7
    assert [flight["name"] for flight in data["figure-05-case1-path"]["scene"]["flights"]] == ["circle"]
    error = next(trace for trace in data["figure-06-case1-x"]["data"] if trace["yaxis"] == "y2")
    np.testing.assert_allclose(drawn_flights.decoded(error["y"]), 0.3, rtol=1e-5)
    assert "seed: 7" in text
    assert "position_rmse" in text
    assert "0.37417" in text  # sqrt(0.3^2 + 0.2^2 + 0.1^2)
    assert "<pre>log report circle</pre>" in text
    assert "&lt;b&gt;gust&lt;/b&gt; &amp; 1" in text
    assert "<b>gust" not in text


def test_page_is_alone(text):
    page = text.replace(re.search(r"<script>(?!\")(.{1000000,}?)</script>", text, re.DOTALL)[0], "")
    assert len(page) < len(text) - 1_000_000
    assert not re.search(r"""(?:src|href)\s*=\s*["'](?!data:|#)""", page)
    assert "@import" not in page
    assert "default-src 'none'" in page


def test_the_page_opens_with_the_verdict_and_the_limits(bag):
    flight = open_flight(bag)
    flight.metadata["limit.position_rmse"] = "0.5"
    good = page_text(report_page([flight], ["circle"], "c"))
    head = good[good.index("</h1>") : good.index("<pre>")]
    assert '<p class="verdict good">Good: ended as planned, within its limits (position_rmse at most 0.5 m)</p>' in head
    flight.metadata["limit.position_rmse"] = "0.25"
    bad = page_text(report_page([flight], ["circle"], "c"))
    assert '<p class="verdict failed">Failed: position_rmse: found 0.3742, expected at most 0.25 m</p>' in bad
    assert "<th>limit</th>" in bad


EVIL = "</script><script>window.evil = 1</script><img src=x onerror='window.evil = 1'><b>"


def test_text_of_others_stays_text_in_every_part_of_a_page():
    line = Line(EVIL, EVIL, (np.arange(2.0), np.arange(2.0)))
    figure = Figure("k", EVIL, EVIL, (Panel(EVIL, (line,)),), bands=(Band(0.0, 1.0, EVIL),))
    body = [heading(EVIL, EVIL), table((EVIL,), ((EVIL,),)), folded(EVIL, verbatim(EVIL)), figure]
    body += playback([drawn_flights.run(EVIL, EVIL)])
    found = page_text(Page(EVIL, EVIL, ((EVIL, EVIL),), body, ("good", EVIL), ((EVIL, EVIL),)))
    assert "<img" not in found
    assert found.count("<script") == 4, "viewer, plotly, page and their data"
    shown = data_of(found)["k"]
    assert "<" not in shown["data"][0]["name"] + shown["layout"]["annotations"][0]["text"], "Plotly reads HTML"
    assert shown["data"][0]["meta"]["run"] == EVIL


def test_no_script_runs_but_those_of_the_page(text):
    scripts = re.findall(r"<script>(.*?)</script>", text, re.DOTALL)
    hashes = {base64.b64encode(hashlib.sha256(each.encode()).digest()).decode() for each in scripts}
    allowed = re.search(r"script-src ([^;]*);", text)[1].split()
    assert {each.strip("'").removeprefix("sha256-") for each in allowed} == hashes


def test_two_figures_of_one_key_are_refused():
    figure = Figure("k", "", "", (Panel("", ()),))
    with pytest.raises(ValueError, match="'k'"):
        page_text(Page("t", "c", (), (figure, figure)))


def test_unwritable_place_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(FlightLogError, match="file"):
        write_page(Page("t", "c", (), ()), tmp_path / "file" / "page.html")


def test_commands_write_where_they_say(bag, tmp_path, capsys):
    assert main(["report", str(bag), "--out", str(tmp_path)]) == 0
    assert capsys.readouterr().out.strip() == str(tmp_path / "circle.html")
    assert (tmp_path / "circle.html").stat().st_size > 1_000_000
    assert main(["report", str(bag), str(bag), "--names", "one,reference", "--out", str(tmp_path)]) == 0
    assert re.search(r"position_rmse +0\.37417 +0\.37417 +m", capsys.readouterr().out)
    drawn = data_of((tmp_path / "comparison.html").read_text())["figure-06-case1-x"]["data"]
    assert {trace["meta"]["run"] for trace in drawn} == {"one", "reference", REFERENCE}
    assert len({trace["line"]["color"] for trace in drawn}) == 3


def test_a_comparison_opens_on_its_answer_and_then_the_error_and_the_paths(bag, tmp_path):
    other = drawn_flights.bag(tmp_path / "other", steps=260, scale=1.5)
    text = page_text(report_page([open_flight(bag), open_flight(other)], ["circle", "other"], "c"))
    row = re.search(r"<tr><td>position_rmse</td>(.*?)</tr>", text)[1]
    assert row == '<td class="best">0.37417</td><td>0.56125 (+50 %)</td><td>m</td>'
    assert 'class="best"' not in re.search(r"<tr><td>duration</td>(.*?)</tr>", text)[1]
    keys = ["position_rmse</td>", 'id="case1-error"', 'id="figure-05-case1-path"', "The paper&#x27;s figures"]
    places = [text.index(key) for key in [*keys, 'id="figure-06-case1-x"', "Inside the flight"]]
    assert places == sorted(places)


def test_several_flights_have_names_of_their_own_and_one_trajectory(bag, tmp_path, capsys):
    other = drawn_flights.bag(tmp_path / "other", "case2", steps=20)
    for bags, said in (((bag, bag), "expected 2 different names"), ((bag, other), "'case1', 'case2', expected one")):
        assert main(["report", *map(str, bags), "--out", str(tmp_path)]) == 2
        assert said in capsys.readouterr().err
