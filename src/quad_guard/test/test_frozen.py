"""The grain of a number: its smallest change so far."""

from quad_guard.frozen import smaller


def test_a_number_that_stays_the_same_does_not_tell_its_grain():
    assert [smaller(0.5, 1.0, after) for after in (1.0, 1.25, 0.0)] == [0.5, 0.25, 0.5]
