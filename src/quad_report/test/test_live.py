"""A flight under way, or a bag that is played, reaches browsers sample by sample, and those that come back."""

import http.client
import json
import re
import socket
import subprocess
import sys
import threading
import time

import drawn_flights
import flight_samples
import numpy as np
import pytest
from headless_browser import Browser, browser_path

from quad_flight_log.errors import FlightLogError
from quad_flight_log.writer import BagWriter
from quad_report import live
from quad_report.cli import main
from quad_report.flight_figures import samples
from quad_report.live import Feed, follow, page, play, serve, under_way


def served(feed, source):
    """Start a server of what ``source`` feeds; returns its thread and its port, once it said it."""
    said, ready = [], threading.Event()

    def hear(line):
        said.append(line)
        ready.set()

    thread = threading.Thread(target=serve, args=(feed, source, hear))
    thread.start()
    assert ready.wait(10.0)
    return thread, int(said[0].split(":")[3].partition("/")[0]), said


def got(port, path, **headers):
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=20.0)
    connection.request("GET", path, headers=headers)
    return connection.getresponse()


def events(port, least=None, **headers):
    """Return the last id, the columns and the end (None) that a browser gets; it leaves after ``least`` samples."""
    last, found, how = "", {}, None
    with got(port, "/events", **headers) as answer:
        assert answer.getheader("Content-Type") == "text/event-stream"
        for block in iter(lambda: answer.readline(), b""):
            name, _, value = block.decode().strip().partition(": ")
            if name == "id":
                last = value
            elif name == "data" and value.startswith("{"):
                for key, values in json.loads(value).items():
                    found.setdefault(key, []).extend(values)
            elif name == "data":
                how = json.loads(value)
            if how or (least and len(found.get("t", ())) >= least):
                break
    return last, found, how


@pytest.fixture(scope="module")
def run():
    return drawn_flights.run("circle", steps=600)


def test_two_browsers_and_one_that_comes_back_get_the_whole_flight(run):
    feed = Feed("circle")
    thread, port, said = served(feed, lambda: play(run, feed, 4.0))
    results = {}
    watching = threading.Thread(target=lambda: results.update(whole=events(port)))
    watching.start()
    last, first, how = events(port, least=5)
    assert how is None, "it left before the end"
    _, rest, how = events(port, **{"Last-Event-ID": last})
    watching.join()
    thread.join()
    _, whole, _ = results["whole"]
    expected = samples(run, len(whole["t"]))
    for name in ("t", "p", "q", "thrust", "reference"):
        np.testing.assert_allclose(whole[name], expected[name].ravel(), atol=1e-6)
        assert first[name] + rest[name] == whole[name], "what it missed and no more"
    assert whole["wind"] == [None] * len(whole["p"])
    assert len(whole["t"]) == pytest.approx(6.0 / 4.0 * 20.0, abs=1), "20 in a second"
    assert how == "the bag is at its end" == said[1].removeprefix("view: ")


def stamp_of(message):
    stamp = getattr(message, "stamp", None) or getattr(getattr(message, "header", None), "stamp", None)
    return 0 if stamp is None else stamp.sec * 1_000_000_000 + stamp.nanosec


def record(directory, flown):
    """Record messages slowly enough for several chunks, and return the open writer."""
    writer = BagWriter(directory, metadata={"run_id": "test"}, flush_period=0.05)
    handles = {}
    for index, (topic, message) in enumerate(flown):
        if topic not in handles:
            handles[topic] = writer.add_topic(topic, flight_samples.definition(message.__msgtype__))
        writer.write(handles[topic], flight_samples.encoded(message), stamp_of(message))
        if index % 100 == 99:
            time.sleep(0.02)
    return writer


@pytest.mark.parametrize("namespace", ["", "/second"])
def test_a_flight_is_followed_while_it_is_recorded_to_its_end(namespace, tmp_path):
    tables = drawn_flights.tables(200)
    flown = [(namespace + topic, message) for topic, message in drawn_flights.messages(tables)]
    feed, bag = Feed("bag"), tmp_path / "bag"
    recording = threading.Thread(target=lambda: record(bag, flown).close({"outcome": "ended"}))
    recording.start()
    follow(under_way(bag), feed)
    recording.join()
    found = feed.after(0)
    assert feed.ended == "the flight ended"
    times = np.array([each["t"] for each in found]).ravel()
    np.testing.assert_allclose(times, np.arange(0.0, 2.0, 0.05), atol=1e-9)
    places = np.array([each["p"] for each in found])
    np.testing.assert_allclose(places, tables["truth"]["p_w"][::5], atol=1e-6)
    wanted = np.array([each["reference"] for each in found])
    np.testing.assert_allclose(wanted, tables["reference"]["p_w"][::5], atol=1e-6, err_msg="of the same stamp")
    assert found[-1]["thrust"] == [5.25]


def test_a_vehicle_without_truth_or_reference_is_shown_by_its_state(tmp_path):
    flown = [
        ("/state" if topic == "/truth" else topic, message)
        for topic, message in drawn_flights.messages(drawn_flights.tables(200))
        if topic != "/reference"
    ]
    record(tmp_path / "bag", flown).close()
    feed = Feed("bag")
    follow(next((tmp_path / "bag").glob("*.mcap")), feed)
    found = feed.after(0)
    assert len(found) >= 4
    assert found[0]["t"][0] > 0.5
    assert {tuple(each["reference"]) for each in found} == {(None, None, None)}
    assert feed.ended == "its bag was closed"


def test_a_recorder_that_is_gone_ends_the_view(tmp_path, monkeypatch):
    monkeypatch.setattr(live, "_SILENCE", 0.3)
    flown = drawn_flights.messages(drawn_flights.tables(50))
    path = flight_samples.write_bag(
        tmp_path / "bag", flown, close=False, pause_every=100, log_ns=lambda _, message: stamp_of(message)
    )
    feed = Feed("bag")
    follow(path, feed)
    assert feed.ended.startswith("its bag was not closed (ends within a record")
    assert len(feed.after(0)) == 10, "0.5 s"


def test_no_flight_under_way_is_said(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["view", "--live"]) == 2
    assert "no flight is under way" in capsys.readouterr().err
    bag = drawn_flights.bag(tmp_path / "closed", steps=5)
    assert main(["view", str(bag)]) == 2
    assert "a bag: log play BAG" in capsys.readouterr().err
    with pytest.raises(FlightLogError, match="log play"):
        under_way(bag)


def test_the_address_is_told_at_once_to_a_file_too():
    program = "from quad_report.live import Feed, serve; import time; serve(Feed('circle'), lambda: time.sleep(60.0))"
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True) as serving:
        try:
            assert re.fullmatch(r"view: http://127\.0\.0\.1:\d+/ \(this machine alone\)\n", serving.stdout.readline())
            assert serving.poll() is None
        finally:
            serving.kill()


def test_only_this_machine_is_answered_and_only_the_page():
    asked = threading.Event()
    thread, port, _ = served(Feed("circle"), lambda: asked.wait(20.0))
    assert got(port, "/").status == 200
    assert got(port, "/", Host="evil.example:80").status == 403
    assert got(port, "/../etc/passwd").status == 404
    asked.set()
    thread.join()


def test_a_view_has_the_port_that_a_tunnel_was_made_for_unless_another_has_it(monkeypatch):
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        wanted = probe.getsockname()[1]
    monkeypatch.setattr(live, "PORT", wanted)
    asked = threading.Event()
    views = [served(Feed(name), lambda: asked.wait(20.0)) for name in ("one", "two")]
    asked.set()
    for thread, _, _ in views:
        thread.join()
    assert views[0][1] == wanted
    assert views[1][1] not in (wanted, 0)


def test_a_name_of_a_bag_is_no_script():
    assert "<script>alert" not in page("</script><script>alert(1)</script>")


@pytest.mark.skipif(browser_path() is None, reason="no Chromium is installed")
def test_a_browser_shows_the_newest_lets_scrub_and_keeps_the_flight(run, tmp_path):
    pytest.importorskip("websockets")
    feed = Feed("circle <b>")
    thread, port, _ = served(feed, lambda: play(run, feed, 1.0))
    with Browser(tmp_path / "profile") as browser:
        browser.open(f"http://127.0.0.1:{port}/")
        state = "window.flightViewers[0].state"
        browser.wait(f"{state}.live && {state}.t > -1.5")
        assert browser.value("document.querySelector('h1').textContent") == "circle <b>"
        browser.value("window.flightViewers[0].seek(-1.6)")
        assert browser.value(f"{state}.live") is False
        browser.value("window.flightViewers[0].seek(1e9)")
        assert browser.value(f"{state}.live") is True
        thread.join()
        browser.wait(f"{state}.ended === 'the bag is at its end'")
        assert browser.value(f"{state}.high") == pytest.approx(3.99, abs=0.06)
        assert browser.problems == []
