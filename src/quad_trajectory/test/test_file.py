"""A trajectory from a file: against the curve that was written to it, and what is refused by line."""

import math
import re

import numpy as np
import pandas as pd
import pytest

from quad_core.parameters import ParameterError, build
from quad_core.types import Vec3, VehicleState
from quad_core.vehicle import Vehicle
from quad_trajectory import file

OMEGA = 0.8
AMPLITUDES = (4.0, 2.0, 0.5)


def curve(t, order):
    """Return derivative ``order`` of x, y, z at ``t`` s: sines of frequency OMEGA, 2 OMEGA, OMEGA."""
    return np.stack(
        [
            a * (k * OMEGA) ** order * np.sin(k * OMEGA * t + order * math.pi / 2)
            for a, k in zip(AMPLITUDES, (1, 2, 1), strict=True)
        ],
        axis=-1,
    )


def written(path, rows, header="t,x,y,z"):
    path.write_text("\n".join([header, *(",".join(map(repr, row)) for row in rows)]) + "\n", encoding="utf-8")
    return str(path)


def planned(path, **values):
    parameters = build(file.Parameters, {"path": str(path), "start": "printed", **values})
    file.check(parameters)
    return parameters, file.plan(parameters, Vehicle(), VehicleState())


@pytest.mark.parametrize(
    ("step", "digits", "bounds"),
    [(0.01, 12, (1e-8, 1e-6, 1e-5, 1e-3)), (0.01, 3, (1e-3, 0.01, 0.2, 4.0)), (0.25, 12, (1e-3, 0.01, 0.1, 1.5))],
)
def test_the_derivatives_are_those_of_the_curve_that_was_written(tmp_path, step, digits, bounds):
    t = np.arange(0.0, 20.0, step)
    rows = np.column_stack([t + 100.0, curve(t, 0).round(digits)]).tolist()
    parameters, plan = planned(written(tmp_path / "plan.csv", rows))
    for time in np.linspace(1.0, t[-1] - 1.0, 57):
        found = file.sample(parameters, plan, float(time))
        for order, name in enumerate(("p_w", "v_w", "a_w", "jerk_w")):
            assert np.abs(np.array(getattr(found, name)) - curve(time, order)).max() < bounds[order], (name, time)
    assert plan.duration == pytest.approx(t[-1])
    assert file.sample(parameters, plan, plan.duration + 1.0).v_w == Vec3()
    assert file.duration(parameters, plan) == pytest.approx(t[-1])


def test_given_velocities_and_accelerations_count_where_positions_are_rare(tmp_path):
    t = np.arange(0.0, 21.0, 1.25)
    columns = {"t": t, **dict(zip(("x", "y", "z"), curve(t, 0).T, strict=True))}
    more = {
        name: values
        for order, letter in ((1, "v"), (2, "a"))
        for name, values in zip((f"{letter}x", f"{letter}y", f"{letter}z"), curve(t, order).T, strict=True)
    }
    errors = []
    for name, table in (("without", columns), ("with", columns | more)):
        pd.DataFrame(table).to_parquet(tmp_path / f"{name}.parquet")
        parameters, plan = planned(tmp_path / f"{name}.parquet", thrust=1.0, tilt=1.4, body_rate=30.0)
        times = np.linspace(3.0, 17.0, 50)
        found = np.array([file.sample(parameters, plan, float(time)).p_w for time in times])
        errors.append(np.abs(found - curve(times, 0)).max())
    assert errors[1] < 0.3 * errors[0]
    assert errors[1] < 0.02


def test_a_heading_that_turns_over_half_a_turn_goes_on(tmp_path):
    t = np.arange(0.0, 10.0, 0.05)
    yaw = (0.9 * t + math.pi) % (2.0 * math.pi) - math.pi
    rows = np.column_stack([t, 0.0 * t, 0.0 * t, 2.0 + 0.0 * t, yaw]).tolist()
    parameters, plan = planned(written(tmp_path / "plan.csv", rows, "time,x,y,z,yaw"))
    found = file.sample(parameters, plan, 7.0)
    assert (found.yaw, found.yaw_rate, found.yaw_acceleration) == pytest.approx((6.3, 0.9, 0.0), abs=1e-6)


GOOD = [[0.0, 0.0, 0.0, 2.0], [1.0, 0.1, 0.0, 2.0], [2.0, 0.1, 0.0, 2.0]]
REFUSED = {
    "no column": (GOOD, "t,x,y,height", "found columns t, x, y, height, expected"),
    "twice": ([[0.0, *row] for row in GOOD], "x,t,x,y,z", "found columns x, t, x, y, z, expected"),
    "text": ([GOOD[0], [1.0, "east", 0.0, 2.0]], "t,x,y,z", "line 3: found x = .*east.*, expected a number"),
    "not finite": ([GOOD[0], [1.0, 0.0, math.nan, 2.0]], "t,x,y,z", "line 3: found y = 'nan', expected a number"),
    "far": ([GOOD[0], [1.0, 2e4, 0.0, 2.0]], "t,x,y,z", "line 3: found x = '20000.0', expected a number within 10000"),
    "short line": ([GOOD[0], [1.0, 0.0]], "t,x,y,z", "line 3: found 2 values, expected 4"),
    "backwards": ([GOOD[1], GOOD[0], GOOD[1], GOOD[2]], "t,x,y,z", "line 3: found t = 0 s, expected a later time"),
    "one row": (GOOD[:1], "t,x,y,z", "found 1 rows, expected at least 4"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_path_is_refused_by_line(tmp_path, name):
    rows, header, message = REFUSED[name]
    path = written(tmp_path / "plan.csv", rows, header)
    with pytest.raises(ParameterError, match=message) as caught:
        file.check(build(file.Parameters, {"path": path}))
    assert path in str(caught.value)


@pytest.mark.parametrize(
    "content", [None, b"", b"\x00\xff\xfe", b"PAR1", "t,x,y,z,\u00fc".encode("latin-1"), "t,x,y,z".encode("utf-16")]
)
@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_a_file_that_cannot_be_read_is_named(tmp_path, content, suffix):
    path = tmp_path / f"plan{suffix}"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ParameterError, match=re.escape(str(path))):
        file.check(build(file.Parameters, {"path": str(path)}))


def test_a_path_beyond_the_limits_or_off_its_positions_is_refused_by_line(tmp_path):
    t = np.arange(0.0, 10.0, 0.01)
    rows = np.column_stack([t, curve(t, 0)])
    path = written(tmp_path / "plan.csv", rows.tolist())
    with pytest.raises(ValueError, match=r"plan.csv line \d+: the path has to be 2\.\d+ times as slow"):
        planned(path, speed=2.0)
    rows[500, 1] += 0.6
    with pytest.raises(ValueError, match=r"plan.csv line 502: the smooth path is 0\.\d+ m away"):
        planned(written(tmp_path / "plan.csv", rows.tolist()))


def test_a_path_that_ends_at_rest_is_stayed_at_and_what_is_flown_is_said(tmp_path):
    path = written(tmp_path / "plan.csv", [[time, 1.0, 0.0, 2.0] for time in (0.0, 1.0, 1.5, 2.0)])
    parameters, plan = planned(path)
    assert file.duration(parameters, plan) == pytest.approx(4.0)
    (said,) = file.remarks(build(file.Parameters, {"path": path}))
    assert re.fullmatch(
        rf"file {re.escape(path)}: 4 rows, path at most 0\.0 mm from them, 0\.000 m from the lines between them", said
    )


@pytest.mark.parametrize(("steps", "sagitta"), [(16, 3.0 * (1.0 - math.cos(math.pi / 16))), (400, 0.0)])
def test_rows_too_far_apart_for_straight_legs_are_told(tmp_path, steps, sagitta):
    """A circle of 3 m through so many rows: midway between two of them it is r (1 - cos(half the angle)) off."""
    angle = np.linspace(0.0, 2.0 * math.pi, steps + 1)
    rows = np.column_stack([2.0 * angle, 3.0 * np.cos(angle), 3.0 * np.sin(angle), 0.0 * angle + 2.0])
    (said,) = file.remarks(build(file.Parameters, {"path": written(tmp_path / "circle.csv", rows.tolist())}))
    assert float(re.search(r", ([\d.]+) m from the lines", said)[1]) == pytest.approx(sagitta, abs=0.01)
