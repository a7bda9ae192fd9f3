"""A flight in the browser while it flies or is played: the viewer over HTTP, on the loopback interface alone.

A flight under way is read from the bag that its recorder writes, so no node notices. A browser that lost the connection
comes back by itself and gets what it missed; the server ends with the flight.
"""

import json
import os
import threading
import time
import webbrowser
from collections.abc import Callable, Iterator
from functools import partial
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from quad_analysis.metrics import thrust_and_torque
from quad_core.cascade import COMMAND
from quad_flight_log.errors import FlightLogError
from quad_flight_log.files import BagFile, Channel
from quad_flight_log.messages import message_type
from quad_report.figures import PALETTE
from quad_report.flight_figures import Run, samples
from quad_report.page import document, resource

PORT = 8790  # of the first view; others take a free one
PERIOD = 0.05  # s between two samples, and between two messages to a browser
_POLL = 0.05  # s between two looks at a file that grows
_SILENCE = 30.0  # s without a new byte: its recorder is gone
_APPEARS = 60.0  # s in which a flight begins to record
_GOODBYE = 5.0  # s in which browsers are told that the flight is over
_WIDTHS = {"t": 1, "p": 3, "q": 4, "thrust": 1, "reference": 3, "wind": 3}
_TRUTH_LATE = 500_000_000  # ns of flight time after which `state` stands for a `truth` that does not come
_UNGUIDED = 300_000_000  # ns of flight time after which places are shown for which no reference comes
_REMEMBERED = 1000  # places

Sample = dict[str, list[float | None]]  # numbers of each quantity of _WIDTHS; None where it is not known
_Message = tuple[Channel, bytes]


class Feed:
    """The samples so far, how the flight ended once it has, and how many browsers listen; any thread may ask."""

    def __init__(self, name: str) -> None:
        self.name, self.ended = name, ""
        self.listening = 0
        self._samples: list[Sample] = []
        self._changed = threading.Condition()

    def add(self, sample: Sample) -> None:
        """Take one more sample."""
        with self._changed:
            self._samples.append(sample)
            self._changed.notify_all()

    def end(self, how: str) -> None:
        """Say that no more will come, and how the flight ended."""
        with self._changed:
            self.ended = how
            self._changed.notify_all()

    def after(self, number: int) -> list[Sample]:
        """Return the samples from ``number`` on; waits up to a second for the first."""
        with self._changed:
            self._changed.wait_for(lambda: self.ended or len(self._samples) > number, timeout=1.0)
            return self._samples[number:]


def play(run: Run, feed: Feed, speed: float = 1.0) -> None:
    """Feed a recorded flight at ``speed``, 0.01 to 1000, times its own pace, once a browser listens."""
    times = run.times("truth")
    count = max(2, round((times[-1] - times[0]) / (PERIOD * speed)))
    found = samples(run, min(count, len(times)))
    while not feed.listening:
        time.sleep(_POLL)
    begin = time.monotonic()
    for at, now in enumerate(found["t"]):
        time.sleep(max(0.0, begin + (now - found["t"][0]) / speed - time.monotonic()))
        feed.add({name: _numbers(found[name][at] if name in found else None, size) for name, size in _WIDTHS.items()})
    feed.end("the bag is at its end")


def _numbers(values: Any, size: int) -> list[float | None]:
    row = np.full(size, np.nan) if values is None else np.asarray(values, dtype=float).reshape(size)
    return [round(each, 6) if np.isfinite(each) else None for each in row.tolist()]


def follow(path: Path, feed: Feed) -> None:
    """Feed the flight whose bag grows at ``path`` until it is closed or nothing comes any more."""
    file, newest, due = BagFile(path), dict[str, _Message](), 0
    places: dict[int, _Message] = {}  # of the last messages by their stamp: a reference comes after the state it is for
    for channel, log_time, data in file.messages(_growth(path)):
        topic = channel.topic.rpartition("/")[2]
        newest[topic] = channel, data
        if topic == "truth" or (topic == "state" and "truth" not in newest and log_time > _TRUTH_LATE):
            places[log_time] = channel, data
            if len(places) > _REMEMBERED:
                del places[next(iter(places))]
            stamp = log_time if log_time >= due + _UNGUIDED else -1
        elif topic == "reference" and log_time >= due:
            stamp = int(_row(channel, data)["stamp_ns"][0])
        else:
            continue
        if stamp in places:
            feed.add(_sample(stamp, places[stamp], newest, guided=topic == "reference"))
            due = stamp + round(1e9 * PERIOD)
    notes = {key: value for _, each in file.notes for key, value in each.items()}
    reason = f": {notes['reason']}" if notes.get("reason") else ""
    how = f"was not closed ({file.damage})" if file.damage else "was closed"
    feed.end(f"the flight {notes['outcome']}{reason}" if "outcome" in notes else f"its bag {how}")


def _growth(path: Path) -> Callable[[], bool]:
    """Return what waits for a file to grow: it says False once its recorder renamed it, or nothing came for long."""
    state = {"size": 0, "since": time.monotonic()}

    def grows() -> bool:
        time.sleep(_POLL)
        if not path.exists():
            return False
        size = path.stat().st_size
        if size != state["size"]:
            state.update(size=size, since=time.monotonic())
        return time.monotonic() - state["since"] < _SILENCE

    return grows


def _sample(stamp: int, place: _Message, newest: dict[str, _Message], *, guided: bool) -> Sample:
    def field(name: str, key: str) -> Any:
        table = _row(*newest[name]) if name in newest else None
        return table[key][0] if table is not None and key in (table.dtype.names or ()) else None

    row = _row(*place)
    found = {"t": stamp * 1e-9, "p": row["p_w"][0], "q": row["q_wb"][0], "wind": field("disturbance", "wind_w")}
    found |= {"reference": field("reference", "p_w") if guided else None, "thrust": field("actuation", "thrust")}
    if found["thrust"] is None and COMMAND in newest:
        found["thrust"] = thrust_and_torque(_row(*newest[COMMAND]))[0][0]
    return {name: _numbers(found[name], size) for name, size in _WIDTHS.items()}


def _row(channel: Channel, data: bytes) -> Any:
    kind = message_type(channel.type, channel.definition.decode("utf-8", errors="replace"))
    return kind.table([data], [0], channel.topic)


def under_way(bag: Path | None) -> Path:
    """Return the file that a flight records into: of the directory ``bag``, or the newest below flights/.

    Waits until it is there; raises FlightLogError if it does not come or the flight is over.
    """
    end = time.monotonic() + _APPEARS
    while True:
        folders = [bag] if bag else [Path("flights")]
        found = [each for folder in folders for each in folder.glob("*.mcap.part" if bag else "**/*.mcap.part")]
        found = [each for each in found if each.stat().st_size > 0]
        if found:
            return max(found, key=lambda each: each.stat().st_mtime)
        if bag is None or any(bag.glob("*.mcap")) or time.monotonic() > end:
            raise FlightLogError(f"{bag or 'flights'}: no flight is under way: no *.mcap.part; log play shows a bag")
        time.sleep(_POLL)


def page(name: str) -> str:
    """Return the page of a flight whose samples come one by one."""
    body = '<main><h1></h1><p class="note"></p><div class="viewer"></div></main>'
    data = {"name": name, "flights": [{"name": name, "colour": PALETTE[0]}]}
    text = document(name, body, [resource("viewer.js"), resource("live.js")], data, "; connect-src 'self'")
    return text.replace("<body>", '<body class="live">')


class _Handler(BaseHTTPRequestHandler):
    """Answers the page and the stream of samples of ``feed``; nothing else is served, to no other host name."""

    feed: Feed

    def do_GET(self) -> None:
        if self.headers.get("Host", "").rpartition(":")[0] not in ("127.0.0.1", "localhost"):
            self.send_error(403)  # a page of the net that points its own name here
        elif self.path == "/":
            self._begin("text/html; charset=utf-8")
            self.wfile.write(page(self.feed.name).encode())
        elif self.path == "/events":
            self._begin("text/event-stream")
            self._stream()
        else:
            self.send_error(404)

    def _begin(self, kind: str) -> None:
        self.send_response(200)
        for name, value in (("Content-Type", kind), ("Cache-Control", "no-store"), ("X-Frame-Options", "DENY")):
            self.send_header(name, value)
        self.end_headers()

    def _stream(self) -> None:
        feed, last = self.feed, self.headers.get("Last-Event-ID", "")
        sent = int(last) if last.isdecimal() else 0
        feed.listening += 1
        try:
            for part in _events(feed, sent):
                self.wfile.write(part.encode())
        except OSError:  # the browser has left
            pass
        finally:
            feed.listening -= 1

    def log_message(self, *_: Any) -> None:
        """Say nothing: the terminal is the flight's."""


def _events(feed: Feed, sent: int) -> Iterator[str]:
    """Yield the samples from number ``sent`` on as server-sent events, at most every PERIOD, then the end."""
    while True:
        over, fresh = feed.ended, feed.after(sent)
        if fresh:
            sent += len(fresh)
            columns = {name: list(chain.from_iterable(each[name] for each in fresh)) for name in _WIDTHS}
            yield f"id: {sent}\ndata: {json.dumps(columns, allow_nan=False)}\n\n"
        elif over:
            yield f"event: end\ndata: {json.dumps(over)}\n\n"
            return
        else:
            yield ": nothing new\n\n"
        time.sleep(PERIOD)


_tell = partial(print, flush=True)


def serve(feed: Feed, source: Callable[[], None], said: Callable[[str], None] = _tell) -> None:
    """Show in browsers what ``source`` feeds, until it ends; opens one where there is a screen.

    ``said`` gets the address, and how the flight ended. Raises what ``source`` raises.
    """
    handler = type("Handler", (_Handler,), {"feed": feed})
    try:
        server = ThreadingHTTPServer(("127.0.0.1", PORT), handler)
    except OSError:  # another view has it
        server = ThreadingHTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    address = f"http://127.0.0.1:{server.server_port}/"
    said(f"view: {address} (this machine alone)")
    if any(name in os.environ for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")):
        webbrowser.open(address)
    try:
        source()
        said(f"view: {feed.ended}")
    finally:
        feed.end(feed.ended or "the view was ended")
        end = time.monotonic() + _GOODBYE
        while feed.listening and time.monotonic() < end:
            time.sleep(_POLL)
        server.shutdown()
        server.server_close()
