"""What a flight compiles before it starts, and what it says of it."""

import pytest

from quad_bringup import preparation
from quad_bringup.flight_setup import Request, resolve_flight
from quad_core import programs
from quad_core.machine_code import library_path
from quad_core.program import Call, Program


def halved(number: float) -> float:
    return 0.5 * number


def written(number: float) -> float:
    return float.fromhex(number.hex())


def program(name, function):
    return Program(name, {"number": float}, {"step": (Call(function, ("number",), ("number",)),)})


GOOD, BAD = program("good", halved), program("bad", written)
LAWS = {"position_controller": GOOD, "attitude_controller": BAD}


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("QUAD_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(programs, "of_node", lambda node: LAWS.get(node.role))
    return tmp_path


def nodes(*settings):
    return list(resolve_flight(Request("hover", settings=settings), {}).values())


def test_what_lacks_is_built_once_and_what_cannot_be_is_told(cache, capfd):
    preparation.prepare(nodes())
    told = capfd.readouterr().err
    assert "compiling good, bad" in told
    assert "compiled 1 of 2" in told
    assert "interpreted: bad: " in told
    assert [path.name for path in cache.rglob("*.so")] == [library_path(GOOD).name]
    made = library_path(GOOD).stat().st_mtime_ns
    preparation.prepare([node for node in nodes() if node.role == "position_controller"])
    assert capfd.readouterr().err == ""
    assert library_path(GOOD).stat().st_mtime_ns == made


def test_nothing_is_built_for_who_does_not_want_it(cache, capfd):
    preparation.prepare(nodes("flight.machine_code=false"))
    assert capfd.readouterr().err == ""
    assert list(cache.rglob("*.so")) == []


def test_a_program_belongs_to_laws_and_plants_that_are_made_for_numba():
    made = {node.role: programs.of_node(node) for node in nodes()}
    assert {role for role, found in made.items() if found} == {
        "simulator",
        "position_controller",
        "attitude_controller",
    }
    foreign = resolve_flight(Request("hover", plant="mujoco"), {})["simulator"]
    assert programs.of_node(foreign) is None
