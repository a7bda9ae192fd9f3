"""The study of assumed values: each moves only its own parameters, lost flights stay visible, the files are written."""

import math

import pytest
import sensitivity
from sensitivity import ASSUMED, Job, Outcome, curve, jobs, middle, overrides

from quad_core import plugins
from quad_core.parameters import fields
from quad_flight.flight import flight_from_parameters

pytestmark = pytest.mark.skipif(
    not plugins.names(plugins.PLANT), reason="plug-ins are not installed: run scripts/setup"
)


def described(job):
    flight = flight_from_parameters(overrides(job))
    return {
        f"{role}.{field.name}": field.default
        for role, resolved in flight.resolved.items()
        for field in resolved.all_fields()
    }


@pytest.mark.parametrize("assumed", ASSUMED, ids=lambda assumed: assumed.symbol)
def test_a_factor_moves_its_own_parameters_and_nothing_else(assumed):
    plain = described(Job("minimal", "case1", "", 0.0, 1))
    moved = described(Job("minimal", "case1", assumed.symbol, 0.5, 1))
    changed = {name for name, value in moved.items() if value != plain[name]}
    assert changed == {f"{assumed.role}.{name}" for name in assumed.names}
    for name in changed:
        assert moved[name] == 0.5 * (plain[name] or assumed.unit)


def test_every_value_that_a_parameter_calls_assumed_is_in_the_study():
    studied = {name for assumed in ASSUMED for name in assumed.names}
    for group, law in ((plugins.POSITION_LAW, "aibs"), (plugins.ATTITUDE_LAW, "abfnitsm")):
        module = plugins.load(group, law)
        marked = [f"{law}.{field.name}" for field in fields(module.Parameters) if "assumed," in field.spec.source]
        assert marked
        assert set(marked) <= studied


def test_the_preset_is_flown_once_and_stands_for_factor_one():
    found = jobs(["minimal"], ["case1"], seeds=2)
    assert len(set(found)) == len(found)
    assert sum(job.symbol == "" for job in found) == 2
    factors = [job.factor for job in found if job.symbol == "rho_1" and job.seed == 1]
    assert factors == [0.25, 2**-1.5, 0.5, 2**-0.5, 2**0.5, 2.0, 2**1.5, 4.0]
    assert 1.0 in [job.factor for job in found if job.symbol == "Q_hat(0)"]


def outcome(symbol, factor, seed, rmse):
    return Outcome(Job("minimal", "case1", symbol, factor, seed), "ended", rmse, 2.0 * rmse)


def test_a_curve_holds_medians_and_a_lost_flight_is_not_sorted_away():
    flown = [outcome("", 0.0, seed, rmse) for seed, rmse in ((1, 0.1), (2, 0.3), (3, 0.2))]
    flown += [outcome("rho_1", 4.0, seed, rmse) for seed, rmse in ((1, 0.5), (2, math.nan), (3, 0.4))]
    flown += [outcome("rho_2", 4.0, 1, 9.0)]
    rho_1 = next(assumed for assumed in ASSUMED if assumed.symbol == "rho_1")
    points = curve(flown, "minimal", "case1", rho_1, "position_rmse")
    assert points[1.0] == 0.2
    assert math.isnan(points[4.0])
    assert curve(flown, "minimal", "case1", rho_1, "attitude_rmse")[1.0] == 0.4
    assert curve(flown, "tuned", "case1", rho_1, "position_rmse") == {}
    assert middle([3.0, 1.0, 2.0]) == 2.0


def test_table_and_picture_are_written(tmp_path, monkeypatch, capsys):
    pytest.importorskip("matplotlib")
    monkeypatch.setattr(sensitivity, "fly_job", lambda job: Outcome(job, "ended", 0.1 + job.factor, 0.2))
    assert sensitivity.main(["--out", str(tmp_path), "--preset", "minimal", "--case", "case2", "--seeds", "1"]) == 0
    rows = (tmp_path / "sensitivity.csv").read_text(encoding="utf-8").splitlines()
    assert rows[0] == "preset,case,symbol,factor,seed,outcome,position_rmse,attitude_rmse"
    assert len(rows) == 1 + len(jobs(["minimal"], ["case2"], 1))
    assert (tmp_path / "sensitivity-minimal.png").read_bytes()[:4] == b"\x89PNG"
    assert "| rho_1 (Eq. 53) | 0.3500 / 0.2000 | 0.1000 / 0.2000 | 4.1000 / 0.2000 | 0 |" in capsys.readouterr().out
