"""Logs are checked before anything is fitted to them."""

import numpy as np
import pytest

from quad_identify.record import Flight, RecordError, Samples, checked, gridded, held

RNG = np.random.default_rng(1)
T = np.arange(0.0, 20.0, 0.002)


def samples(columns, scale=1.0, t=T):
    return Samples(t, scale * RNG.random((len(t), columns)))


GOOD = Flight(samples(4), samples(3, 9.8), samples(3))


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ({"motors": samples(3)}, "motors: found 3 columns, expected 4"),
        ({"motors": samples(4, 60000.0)}, "motors: found .*, expected commands in 0..1"),
        ({"motors": samples(4, t=T[::100])}, "motors: found 5 Hz, expected at least 20 Hz"),
        ({"body_rates": samples(3, t=T[:1000])}, "body_rates: found 2.0 s that can be used"),
        ({"specific_force": samples(3, np.nan)}, "specific_force: found 0.0 s that can be used"),
        ({"body_rates": samples(3, 0.0)}, "body_rates: found one value all along"),
    ],
)
def test_a_log_that_cannot_be_used_is_refused_by_signal(change, problem):
    with pytest.raises(RecordError, match=problem):
        checked(GOOD._replace(**change))


def test_spikes_numbers_that_are_none_and_steps_back_in_time_are_left_out_and_counted():
    t, motors = T.copy(), samples(4).values
    t[50] = 0.0
    motors[100], motors[200, 2] = np.nan, 2e6
    found, notes = checked(GOOD._replace(motors=Samples(t, motors)))
    assert len(found.motors.t) == len(T) - 3
    assert "3 of 10000 rows left out" in notes[0]


def test_gaps_in_time_take_no_memory_and_are_bridged_by_no_window():
    whole = gridded(GOOD)[0]
    t = T + 3600.0 * (T > 12.0)
    t[-1] = 1e9  # damaged
    pieces = gridded(Flight(samples(4, t=t), samples(3, 9.8, t=t), samples(3, t=t)))
    assert [len(grid.command) for grid in pieces] == pytest.approx([6000, 4000], abs=10)
    assert sum(len(grid.windows) for grid in pieces) == len(whole.windows) - 5  # the second piece's first second
    assert pieces[1].t[0] - pieces[0].t[0] == pytest.approx(3612.0, abs=0.1)


def test_a_log_that_asks_for_too_much_memory_is_refused():
    sparse = np.cumsum(np.where(np.arange(len(T)) % 3, 0.002, 0.9))
    flight = Flight(samples(4, t=sparse), samples(3, 9.8, t=sparse), samples(3, t=sparse))
    with pytest.raises(RecordError, match="samples, expected at most 1000000: a damaged time"):
        gridded(flight)


def test_a_command_holds_until_the_next():
    signal = Samples(np.array([0.0, 1.0, 2.0]), np.array([[1.0], [2.0], [3.0]]))
    assert held(signal, np.array([0.0, 0.99, 1.0, 5.0]))[:, 0].tolist() == [1.0, 1.0, 2.0, 3.0]


def test_windows_leave_out_gaps_and_what_is_near_the_ground():
    motors = 0.5 + 0.01 * RNG.random((len(T), 4))
    motors[: len(T) // 4] = 0.0
    there = (T < 12.0) | (T > 13.0)
    flight = GOOD._replace(motors=Samples(T, motors), body_rates=Samples(T[there], GOOD.body_rates.values[there]))
    first, second = (grid.t[grid.windows].ravel() for grid in gridded(flight))
    assert second.min() - first.max() >= 1.98
    assert np.ptp(first) < 12.0 - 6.4
