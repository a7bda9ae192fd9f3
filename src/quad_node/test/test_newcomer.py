"""Who comes into a domain leaves the queues of dead processes alone, and comes while nobody else does."""

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


@pytest.mark.parametrize("age", [5.0, 0.0])
def test_the_locks_of_the_dead_are_held_while_a_participant_is_made(lock, age):
    """Who dies in the first second of a flight leaves a lock that is as young as that of who is just starting."""
    dead = lock("fastrtps_port8160_el", age)
    with newcomer.apart_from_the_dead(3):
        assert not is_free(dead)
    assert is_free(dead)


@pytest.mark.parametrize(
    "name",
    [
        "fastrtps_port8400_el",  # of domain 4
        "fastrtps_port8149_el",  # of domain 2
        "fastrtps_port8150_sl",  # many may hold it
        "fastrtps_0123456789abcdef_el",
    ],
)
def test_other_locks_are_left_alone(lock, name):
    other = lock(name)
    with newcomer.apart_from_the_dead(3):
        assert is_free(other)


def test_the_lock_of_who_lives_is_no_trouble(lock):
    living = lock("fastrtps_port8160_el")
    with living.open() as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        with newcomer.apart_from_the_dead(3):
            pass
        assert not is_free(living)


QUEUE = ("fastrtps_port8160", "fastrtps_port8160_el", "sem.fastrtps_port8160_mutex")


def test_where_nobody_lives_the_queues_of_the_dead_are_removed(lock, tmp_path):
    # a queue without a lock: its reader left while somebody sent to it
    gone = [lock(name) for name in (*QUEUE, "fastrtps_port8150", "fastrtps_port8150_sl", "fastrtps_port8161")]
    other = [lock(name) for name in ("fastrtps_port8400", "fastrtps_port8400_el", "fastrtps_0123456789abcdef")]
    with newcomer.apart_from_the_dead(3):
        assert [path for path in gone if path.exists()] == []
        assert set(tmp_path.iterdir()) == set(other)


@pytest.mark.parametrize("kind", ["_el", "_sl"])
def test_where_somebody_lives_no_queue_is_removed(lock, kind):
    dead = [lock(name) for name in QUEUE]
    living = lock(f"fastrtps_port8170{kind}")
    with living.open() as file:
        fcntl.flock(file, fcntl.LOCK_SH if kind == "_sl" else fcntl.LOCK_EX)
        with newcomer.apart_from_the_dead(3):
            assert all(path.exists() for path in dead)
            assert not is_free(dead[1])


def test_where_somebody_is_just_starting_no_queue_is_removed(lock):
    dead = [lock(name) for name in QUEUE]
    lock("fastrtps_port8170_el", 0.0)
    with newcomer.apart_from_the_dead(3):
        assert all(path.exists() for path in dead)


def test_a_queue_that_was_just_made_is_kept(lock):
    dead, young = lock("fastrtps_port8160"), lock("fastrtps_port8161", 0.0)
    with newcomer.apart_from_the_dead(3):
        assert not dead.exists()
        assert young.exists()


def test_who_holds_the_folder_s_lock_for_long_stops_nobody(lock, tmp_path, monkeypatch):
    monkeypatch.setattr(newcomer, "_PATIENCE", 0.05)
    dead = lock("fastrtps_port8160")
    folder = os.open(tmp_path, os.O_RDONLY)
    fcntl.flock(folder, fcntl.LOCK_EX)
    try:
        with newcomer.apart_from_the_dead(3):
            assert dead.exists()
    finally:
        os.close(folder)


def test_nobody_comes_while_another_does(lock, monkeypatch):
    """Who comes while a queue of the dead is there may be just opening it."""
    monkeypatch.setattr(newcomer, "_PATIENCE", 0.05)
    with newcomer.apart_from_the_dead(3):
        dead = lock("fastrtps_port8160")
        with newcomer.alone() as is_alone:
            assert not is_alone
        with newcomer.apart_from_the_dead(3):
            assert dead.exists()
    with newcomer.alone() as is_alone:
        assert is_alone


def test_a_place_that_is_missing_below_others_is_nobody_s(lock, tmp_path):
    """Who took the place of a dead process has left again, and taken queue and lock with it."""
    living = lock("fastrtps_port8164_el")
    with living.open() as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        with newcomer.apart_from_the_dead(3):
            assert list(tmp_path.iterdir()) == [living]
        with newcomer.apart_from_the_dead(3, at_the_end=True):
            held = sorted(path.name for path in tmp_path.iterdir())
            assert held == [f"fastrtps_port{port}_el" for port in range(8160, 8165)]
            assert not any(is_free(path) for path in tmp_path.iterdir())
        assert list(tmp_path.iterdir()) == [living]


def test_the_queues_from_which_names_are_learned_are_those_of_the_whole_machine(lock):
    """Where somebody lives, in whatever domain, a newcomer avoids the dead; where nobody does they are removed."""
    dead = [lock("fastrtps_port7001"), lock("fastrtps_port7001_el")]
    living = lock("fastrtps_port7002_el")
    with living.open() as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        with newcomer.apart_from_the_dead(3):
            assert not is_free(dead[1])
    with newcomer.apart_from_the_dead(3):
        assert not any(path.exists() for path in dead)


def test_some_of_the_numbers_for_names_are_left(lock, monkeypatch):
    monkeypatch.setattr(newcomer, "_MOST_NAMES", 3)
    living, *dead = [lock(f"fastrtps_port{7000 + age}_el", 10.0 + age) for age in range(4)]
    with living.open() as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        with newcomer.apart_from_the_dead(3):
            assert [is_free(path) for path in dead] == [False, False, True]
