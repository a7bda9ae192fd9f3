"""The modes of a flight with a commander over its figures."""

from itertools import pairwise

import numpy as np
from metric_tables import seconds, table

from quad_flight_log.analysis.takeovers import Exchange, Takeover
from quad_flight_log.report.figures import Figure, Line, Panel
from quad_flight_log.report.interactive_figures import colours, specification
from quad_flight_log.report.run import Run, mode_bands, with_bands

MODES = np.array([0, 1, 2, 2, 4, 3, 3, 5, 0], dtype=np.uint8)
NAMES = np.array(
    ["DISARMED", "ARMING", "TAKEOFF", "TAKEOFF", "HOLD", "MISSION", "MISSION", "LAND", "DISARMED"], dtype=object
)
FLOWN = {"flight/mode": table(seconds(*range(9)), mode=MODES, name=NAMES)}
TIMES = np.linspace(0.0, 8.0, 9)
HEIGHT = Figure("height", "Height", "", (Panel("z [m]", (Line("a", "a", (TIMES, TIMES)),)),))


def test_each_mode_in_the_air_is_a_band_from_its_entry_to_the_next():
    bands = mode_bands(Run("a", "hover", FLOWN))
    assert [(band.begin, band.end, band.label) for band in bands] == [
        (2.0, 4.0, "TAKEOFF"),
        (4.0, 5.0, "HOLD"),
        (5.0, 7.0, "MISSION"),
        (7.0, 8.0, "LAND"),
    ]
    assert all(one.opacity != other.opacity for one, other in pairwise(bands))


def test_a_flight_without_a_commander_has_none():
    assert mode_bands(Run("a", "hover", {})) == ()


def test_modes_and_takeovers_shade_the_figures_of_one_flight_and_takeovers_alone_those_of_several():
    run = Run("a", "hover", FLOWN, (Takeover("descend", "no good wrench", 1500, 3_000_000_000, 4_000_000_000),))
    [alone] = with_bands([HEIGHT], [run])
    assert [band.label for band in alone.bands] == ["TAKEOFF", "HOLD", "MISSION", "LAND", "guard in descend"]
    shapes = specification(alone, colours(["a"]))["layout"]["shapes"]
    assert [shape["opacity"] for shape in shapes] == [band.opacity for band in alone.bands]
    [both] = with_bands([HEIGHT], [run, run._replace(name="b")])
    assert [band.label for band in both.bands] == ["a: guard in descend", "b: guard in descend"]


def test_a_standby_that_flies_is_a_band_to_the_end():
    exchange = Exchange("attitude_controller", "silent for 3 cycles", 2500, 5_000_000_000, 8_000_000_000)
    [figure] = with_bands([HEIGHT], [Run("a", "hover", {}, exchanges=(exchange,))])
    assert [tuple(band)[:3] for band in figure.bands] == [(5.0, 8.0, "standby attitude_controller flies")]
