"""Who comes into a domain leaves the queues of dead processes alone."""

import fcntl
import os

import pytest

from quad_node import newcomer

pytestmark = pytest.mark.unit


@pytest.fixture
def lock(tmp_path, monkeypatch):
    """Return a function that makes a lock file of a port and returns its path, ``age`` s old."""
    monkeypatch.setattr(newcomer, "_SHARED_MEMORY", tmp_path)

    def made(name, age=5.0):
        path = tmp_path / name
        path.touch()
        written = path.stat().st_mtime - age
        os.utime(path, (written, written))
        return path

    return made


def is_free(path):
    """Tell whether a lock can be had."""
    with path.open() as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        return True


def test_the_locks_of_the_dead_are_held_while_a_participant_is_made(lock):
    dead = lock("fastrtps_port8160_el")
    with newcomer.apart_from_the_dead(3):
        assert not is_free(dead)
    assert is_free(dead)


@pytest.mark.parametrize(
    ("name", "age"),
    [
        ("fastrtps_port8400_el", 5.0),  # of domain 4
        ("fastrtps_port8149_el", 5.0),  # of domain 2
        ("fastrtps_port8160_el", 0.0),  # who is starting may not have locked it yet
        ("fastrtps_port8150_sl", 5.0),  # many may hold it
        ("fastrtps_0123456789abcdef_el", 5.0),
    ],
)
def test_other_locks_are_left_alone(lock, name, age):
    other = lock(name, age)
    with newcomer.apart_from_the_dead(3):
        assert is_free(other)


def test_the_lock_of_who_lives_is_no_trouble(lock):
    living = lock("fastrtps_port8160_el")
    with living.open() as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        with newcomer.apart_from_the_dead(3):
            pass
        assert not is_free(living)
