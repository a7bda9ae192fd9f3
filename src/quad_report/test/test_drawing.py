"""A figure for a paper has the width asked for, embedded fonts, and what the report shows."""

import re
import warnings
import zlib

import drawn_flights
import matplotlib.figure
import numpy as np
import pytest

from quad_report.cli import main
from quad_report.drawing import figures_by_name, save
from quad_report.figures import Figure, Line, Panel

pytest.importorskip("matplotlib")


@pytest.fixture(scope="module")
def bags(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bags")
    return [drawn_flights.bag(folder / name, steps=260, scale=scale) for name, scale in (("a", 1.0), ("b", 2.0))]


def unpacked(path):
    """Return a PDF with its streams unpacked."""
    data = path.read_bytes()
    streams = [
        zlib.decompressobj().decompress(part) for part in re.findall(rb"stream\r?\n(x.*?)endstream", data, re.DOTALL)
    ]
    return data + b"".join(streams)


@pytest.mark.parametrize("figure", ["path", "error", "effort", "spectrum", "x", "yaw"])
def test_a_pdf_is_as_wide_as_asked_and_holds_its_fonts(figure, bags, tmp_path, capsys):
    out = tmp_path / "figure.pdf"
    asked = ["--figure", figure, "--out", str(out), "--width", "88mm"]
    assert main(["figure", *map(str, bags), *asked]) == 0
    assert capsys.readouterr().out == f"{out}\n"
    content = unpacked(out)
    width = float(re.search(rb"/MediaBox \[ ?0 0 ([\d.]+)", content)[1])
    assert width / 72.0 * 25.4 == pytest.approx(88.0, abs=0.01)
    assert b"/FontFile2" in content
    assert b"/Type3" not in content


def test_columns_of_dots_are_drawn_over_their_names(tmp_path):
    dots = Line("pid", "pid", (np.array([0.0, 0.1]), np.array([4.0, 5.0])), dots=True)
    save(Figure("costs", "", "", (Panel("cost", (dots,)),), x_label="", ticks=("PID",)), tmp_path / "a.svg", 88.0)
    drawn = (tmp_path / "a.svg").read_text()
    assert "<!-- PID -->" in drawn
    assert drawn.count("<use ") >= 2
    assert "<!-- pid -->" not in drawn  # no legend beside the axis that names it


@pytest.mark.parametrize("ticks", [False, True])
@pytest.mark.parametrize("width", [85.0, 170.0])
@pytest.mark.parametrize("name", ["PID", "AIBS + ABFNITSM, no disturbance observer"])
def test_long_names_of_six_controllers_stay_within_the_figure(ticks, width, name, tmp_path, monkeypatch):
    names = tuple(f"{name} {k}" for k in range(6))
    lines = tuple(Line(each, each, (np.arange(3.0), np.arange(3.0) + 1.0)) for each in names)
    figure = Figure("costs", "t", "c", (Panel("cost", lines),), "", ticks=names if ticks else ())
    drawn = []
    original = matplotlib.figure.Figure.savefig
    monkeypatch.setattr(
        matplotlib.figure.Figure,
        "savefig",
        lambda self, *given, **named: (drawn.append(self), original(self, *given, **named)),
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        save(figure, tmp_path / "costs.pdf", width)
    (canvas,) = drawn
    box, axes = canvas.get_tightbbox(), canvas.axes[0].get_position()
    assert min(box.x0, box.y0) > -0.01
    assert box.x1 < canvas.get_figwidth() + 0.01
    assert box.y1 < canvas.get_figheight() + 0.01
    assert axes.height * canvas.get_figheight() > 0.17 * canvas.get_figwidth()
    assert axes.width > 0.5


def test_a_spectrum_of_nothing_is_drawn_without_a_warning(tmp_path):
    line = Line("a", "a", (np.array([1.0, 2.0]), np.zeros(2)))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        save(Figure("spectrum", "", "", (Panel("power", (line,), logarithmic=True),)), tmp_path / "a.svg", 88.0)


def test_svg_and_png_are_as_wide(bags, tmp_path):
    found = figures_by_name([drawn_flights.run("a")])
    save(found["error"], tmp_path / "a.svg", 100.0, 50.0)
    width, height = re.search(r'width="([\d.]+)pt" height="([\d.]+)pt"', (tmp_path / "a.svg").read_text()).groups()
    assert (float(width), float(height)) == (
        pytest.approx(100 / 25.4 * 72, abs=0.01),
        pytest.approx(50 / 25.4 * 72, abs=0.01),
    )
    save(found["error"], tmp_path / "a.png", 100.0)
    assert int.from_bytes((tmp_path / "a.png").read_bytes()[16:20], "big") == round(100 / 25.4 * 300)


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        (["--figure", "lyapunov", "--out", "a.pdf"], "expected one of path, x, y"),
        (["--out", "a.doc"], "expected .pdf, .svg, .png"),
        (["--names", "a,a", "--out", "a.pdf"], "expected 2 different names"),
    ],
)
def test_what_cannot_be_drawn_is_refused_by_name(asked, said, bags, capsys):
    assert main(["figure", *map(str, bags), *asked]) == 2
    assert said in capsys.readouterr().err


@pytest.mark.parametrize("width", ["3", "88", "1mm", "9m", "mm"])
def test_a_width_needs_a_unit_and_a_size(width, bags):
    with pytest.raises(SystemExit) as ended:
        main(["figure", str(bags[0]), "--out", "a.pdf", "--width", width])
    assert ended.value.code == 2
