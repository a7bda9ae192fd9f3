"""The robustness map: what counts as borne, where a lost flight shows, and that the picture has a square for each."""

import numpy as np
import pytest
import robustness
from robustness import DELAYS, SHARES, Map, borne, draw, main


def flown(limit_of_row):
    """RMSE 0.1 m up to a delay index that depends on the row, lost beyond."""
    rmse = np.full((len(SHARES), len(DELAYS)), np.nan)
    for row in range(len(SHARES)):
        rmse[row, : limit_of_row(row)] = 0.1
    return Map("a+b", "mass error", rmse)


def test_the_delay_alone_is_read_where_there_is_no_error():
    assert SHARES[len(SHARES) // 2] == 0.0
    assert borne(flown(lambda row: 4 if row == 5 else 1), 0.25) == (DELAYS[3], 4 + 10)
    assert borne(flown(lambda row: len(DELAYS)), 0.25) == (DELAYS[-1], len(SHARES) * len(DELAYS))
    delay, squares = borne(flown(lambda row: 3), 0.05)
    assert np.isnan(delay)
    assert squares == 0


def test_every_square_is_the_worst_seed_and_lost_if_one_is(monkeypatch):
    def noted(flight, compiled):
        delay, mass = flight.setup.sensing.delay, flight.setup.plant.mass_error
        if flight.seed == 2 and delay > 0.03:
            return float("nan")
        return flight.seed * (0.01 + delay) + abs(mass)

    monkeypatch.setattr(robustness, "_rmse", noted)
    gains, masses = robustness.maps("aibs+abfnitsm", [1, 2], compiled=False)
    assert (gains.what, masses.what) == ("effectiveness error", "mass error")
    assert gains.rmse[0, 2] == pytest.approx(2 * (0.01 + DELAYS[2]))
    assert masses.rmse[0, 2] == pytest.approx(2 * (0.01 + DELAYS[2]) + 0.5 * 0.56)
    assert np.isnan(gains.rmse[:, 7:]).all()
    assert not np.isnan(gains.rmse[:, :7]).any()


def test_the_picture_is_written_and_a_pair_that_is_not_there_is_named(tmp_path, capsys):
    path = tmp_path / "map.png"
    draw([flown(lambda row: row), flown(lambda row: 2)._replace(what="effectiveness error")], path)
    assert path.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    assert main(["--pairs", "lqr+abfnitsm", "--out", str(path)]) == 2
    assert "lqr" in capsys.readouterr().err
