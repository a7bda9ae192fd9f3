"""The report in a real browser: every figure is drawn, the console stays clean, the switches switch."""

import drawn_flights
import flight_samples
import metric_tables
import numpy as np
import pytest
from headless_browser import Browser, browser_path

from quad_analysis.tables import Takeover
from quad_flight_log.reader import open_flight
from quad_report.figures import REFERENCE, Figure, Line, Panel
from quad_report.flight_figures import Playback, Run, inside_figures, paper_figures, playback, with_bands
from quad_report.page import Page, report_page, write_page

pytest.importorskip("plotly")
pytest.importorskip("websockets")
pytestmark = pytest.mark.skipif(browser_path() is None, reason="no Chromium is installed")

VISIBLE = """(run) => [...document.querySelectorAll('.plot')].flatMap(plot =>
    plot._fullData.filter(trace => trace.meta.run === run).map(trace => trace.visible === true))"""


@pytest.fixture(scope="module")
def figures():
    one = [drawn_flights.run("proposed"), drawn_flights.run("pid <b>", scale=2.0)]
    two = [drawn_flights.run("proposed", "case2"), drawn_flights.run("pid <b>", "case2", scale=2.0)]
    return [*playback(one), *paper_figures(one), *inside_figures(one)[:2], *playback(two), *paper_figures(two)]


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    with Browser(tmp_path_factory.mktemp("browser")) as browser:
        yield browser


def opened(browser, path, size=(1200, 900), theme="light"):
    """Return the browser once it has drawn a page."""
    browser.open("about:blank")  # a report loads itself again when the theme changes
    browser.show_as(size, theme)
    browser.open(path.as_uri())
    browser.wait("document.body.dataset.drawn")
    return browser


@pytest.fixture(scope="module")
def page(figures, browser, tmp_path_factory):
    return opened(
        browser, write_page(Page("Title", "command", (), figures), tmp_path_factory.mktemp("p") / "page.html")
    )


def visible(page, run):
    return page.value(f"({VISIBLE})({run!r})")


def test_everything_is_drawn(page, figures):
    assert page.value("document.body.dataset.drawn") == str(len(figures))
    assert page.value("document.title") == "Title"
    curves = page.value("document.querySelectorAll('.scatterlayer .trace path.js-line').length")
    expected = sum(len(panel.lines) for f in figures if not isinstance(f, Playback) for panel in f.panels)
    assert curves == expected


VIEWER = "window.flightViewers[0]"
COLOURS = """(async () => {
    const canvas = document.querySelector('.viewer canvas'), flat = document.createElement('canvas');
    flightViewers[0].ask();
    await new Promise(requestAnimationFrame);
    Object.assign(flat, {width: canvas.width, height: canvas.height});
    const ink = flat.getContext('2d');
    ink.drawImage(canvas, 0, 0);
    const data = ink.getImageData(0, 0, flat.width, flat.height).data, found = new Map();
    for (let i = 0; i < data.length; i += 4) if (data[i + 3] > 200) {
        const colour = [data[i], data[i + 1], data[i + 2]].map(each => each >> 4).join();
        found.set(colour, (found.get(colour) || 0) + 1);
    }
    return Object.fromEntries(found);
})()"""


def test_a_flight_plays_pauses_and_scrubs_with_one_cursor_in_all_figures(page):
    page.value(f"{VIEWER}.seek(0.5)")
    page.click(".viewer .play")
    page.wait(f"{VIEWER}.state.t > 0.7")
    page.click(".viewer .play")
    stopped = page.value(f"{VIEWER}.state.t")
    assert page.value("new Promise(d => setTimeout(() => d(flightViewers[0].state.t), 300))") == stopped
    scrub = "(slider) => { slider.value = 2; slider.dispatchEvent(new Event('input')); }"
    page.value(f"({scrub})(document.querySelector('.viewer input'))")
    page.wait(f"{VIEWER}.state.t === 2")
    page.value("document.querySelector('#figure-06-case1-x').scrollIntoView()")
    offset = """(() => { const p = document.querySelector('#figure-06-case1-x .plot'), a = p._fullLayout.xaxis;
        const x = p.querySelector('.cursor').getBoundingClientRect().left - p.getBoundingClientRect().left;
        return Math.abs(a.p2d(x - a._offset) - 2); })()"""
    page.wait(f"{offset} < 0.03")
    page.value("document.querySelector('.viewer').focus()")
    keys = [(" ", "playing"), (" ", "playing === false"), ("3", "view === 'top'"), ("Home", "t === 0")]
    for key, done in (*keys, ("2", "view === 'follow'"), ("1", "view === 'orbit'")):
        page.value(f"document.querySelector('.viewer').dispatchEvent(new KeyboardEvent('keydown', {{key: '{key}'}}))")
        page.wait(f"{VIEWER}.state.{done}")


def test_the_viewer_draws_the_flight_its_ghost_and_its_thrust(page):
    page.value(f"{VIEWER}.seek(3)")
    page.value(f"{VIEWER}.look('follow')")
    orange = "13,5,0"  # of #d55e00: the second flight and every thrust
    both = page.value(COLOURS)
    assert both[orange] > 50
    page.click("#bar input[data-run='pid <b>']")
    alone = page.value(COLOURS)
    assert 0 < alone[orange] < both[orange]
    page.click("#bar input[data-run='pid <b>']")
    assert page.value(COLOURS)[orange] == both[orange]


def test_console_is_clean_and_nothing_is_fetched(page):
    assert page.problems == []
    fetched = [url for url in page.requests if not url.startswith(("data:", "blob:", "about:"))]
    assert [url.rsplit("/", 1)[-1] for url in fetched] == ["page.html"]
    assert fetched[0].startswith("file://")


@pytest.mark.parametrize("run", ["proposed", "pid <b>", REFERENCE])
def test_a_box_hides_its_run_in_all_figures(page, run):
    box = f"#bar input[data-run='{run}']"
    others = [name for name in ("proposed", "pid <b>", REFERENCE) if name != run]
    before = visible(page, run)
    assert len(before) >= 6
    assert all(before)
    page.click(box)
    page.wait(f"!({VISIBLE})({run!r}).includes(true)")
    assert all(all(visible(page, name)) for name in others)
    page.click(box)
    page.wait(f"!({VISIBLE})({run!r}).includes(false)")


def test_a_click_on_the_legend_does_the_same(page):
    page.click("#figure-06-case1-x .legendtoggle")
    page.wait(f"!({VISIBLE})('proposed').includes(true)")
    assert page.value("document.querySelector(\"#bar input[data-run='proposed']\").checked") is False
    page.click("#bar input[data-run='proposed']")
    page.wait(f"!({VISIBLE})('proposed').includes(false)")


def test_zoomed_time_is_shared(page):
    ranges = "[...document.querySelectorAll('.plot')].filter(p => p.layout.xaxis).map(p => p.layout.xaxis.range)"
    page.value(
        "Plotly.relayout(document.querySelector('#figure-07-case1-y .plot'), {'xaxis.range': [1, 2]}).then(() => 1)"
    )
    page.wait(f"{ranges}.every(r => r[0] === 1 && r[1] === 2)")
    assert len(page.value(ranges)) == 14
    assert page.value(f"[{VIEWER}.state.low, {VIEWER}.state.high]") == [1, 2], "the viewer plays what the figures show"


PHONE, DESK = (390, 844), (1150, 900)
OVERLAPPING = """(() => {
    const boxes = [...document.querySelectorAll('.annotation-text')].map(each => each.getBoundingClientRect());
    return boxes.flatMap((one, at) => boxes.slice(at + 1).filter(other =>
        one.left < other.right && other.left < one.right && one.top < other.bottom && other.top < one.bottom)).length;
})()"""


LEAST_CONTRAST = """(() => {
    const light = (text) => {
        const parts = text.match(/[\\d.]+/g).slice(0, 3).map(part => part / 255)
            .map(part => part <= 0.03928 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4);
        return 0.2126 * parts[0] + 0.7152 * parts[1] + 0.0722 * parts[2];
    };
    const sheet = light(getComputedStyle(document.querySelector('figure')).backgroundColor);
    const texts = [...document.querySelectorAll('figure h3, figcaption')].map(each => getComputedStyle(each).color);
    texts.push(...[...document.querySelectorAll('.plot .xtick text')].map(each => getComputedStyle(each).fill));
    return Math.min(...texts.map(light).map(ink => (Math.max(ink, sheet) + 0.05) / (Math.min(ink, sheet) + 0.05)));
})()"""


@pytest.mark.parametrize("size", [PHONE, DESK])
def test_labels_of_short_modes_do_not_overlap_and_nothing_is_wider_than_the_screen(size, browser, tmp_path):
    times = np.array([0.0, 1.0, 2.0, 2.3, 2.6, 5.5, 5.8, 6.2, 8.0])
    modes = np.array([0, 1, 2, 4, 3, 4, 5, 6, 0], dtype=np.uint8)
    names = np.array(["DISARMED", "ARMING", "TAKEOFF", "HOLD", "MISSION", "HOLD", "RETURN", "LAND", "DISARMED"], object)
    flown = {"flight/mode": metric_tables.table(metric_tables.seconds(*times), mode=modes, name=names)}
    takeover = Takeover("descend", "no good wrench", 1500, 3_000_000_000, 4_000_000_000)
    line = Line("a", "a", (times, times))
    figure = Figure("height", "Height", "", (Panel("z [m]", (line,)),), span=(0.0, 8.0))
    figures = with_bands([figure], [Run("a", "hover", flown, (takeover,))])
    path = write_page(Page("Title", "command", (), figures), tmp_path / "page.html")
    opened(browser, path, size)
    assert browser.value("document.querySelectorAll('.annotation-text').length") == 7
    assert browser.value(OVERLAPPING) == 0
    assert browser.value("document.documentElement.scrollWidth") == size[0]


@pytest.mark.parametrize(("size", "theme"), [(PHONE, "dark"), (DESK, "light")])
def test_the_first_screen_of_a_flight_is_verdict_numbers_and_path(size, theme, browser, tmp_path):
    flight = open_flight(drawn_flights.bag(tmp_path / "bag", steps=400))
    path = write_page(report_page([flight], ["circle"], "command"), tmp_path / "page.html")
    opened(browser, path, size, theme)
    places = "[...document.querySelectorAll('.verdict, .numbers b, figure:first-of-type .viewer')]"
    tops = browser.value(f"{places}.slice(0, 5).map(each => each.getBoundingClientRect().top)")
    assert len(tops) == 5
    assert tops == sorted(tops)
    assert tops[-1] < 0.6 * size[1]
    assert browser.value("document.documentElement.scrollWidth") == size[0]
    assert browser.value("[...document.querySelectorAll('details')].every(each => !each.open)")
    assert browser.value(LEAST_CONTRAST) > 4.5


@pytest.mark.parametrize("kind", ["event", "parameter", "name of a bag", "trajectory", "note"])
def test_a_script_in_a_text_of_a_bag_does_not_run(kind, browser, tmp_path):
    evil = "</script><script>window.evil = 1</script><img src=x onerror='window.evil = 1'>"
    texts = {kind: evil}
    made = drawn_flights.messages(drawn_flights.tables(60), texts.get("trajectory", "case1"))
    said = {"node": "/simulator", "parameters": f"a: {texts.get('parameter', 'b')}", "role": "simulator"}
    made.insert(0, ("/flight/parameters", flight_samples.message("quad_msgs/msg/NodeParameters", **said)))
    event = {"node": "/n", "kind": "k", "text": texts.get("event", "fine")}
    made.insert(0, ("/flight/events", flight_samples.message("quad_msgs/msg/FlightEvent", **event)))
    bag = flight_samples.write_bag(tmp_path / "bag", made, notes={"commit": texts.get("note", "none")})
    name = texts.get("name of a bag", "bag")
    path = write_page(report_page([open_flight(bag)], [name], name), tmp_path / "page.html")
    opened(browser, path)
    assert evil in browser.value("document.documentElement.textContent")
    assert browser.value("typeof window.evil") == "undefined"
    assert browser.value("document.images.length") == 0
