"""What is compiled after a flight for the next one, and what is said of it."""

import fcntl
import math

import pytest

from quad_bringup import preparation
from quad_flight.set_up import Request, resolve_flight
from quad_native import library_path


def halved(number: float) -> float:
    return 0.5 * number


def written(number: float) -> float:
    return float.fromhex(number.hex())


LAWS = {"position_controller": [halved], "attitude_controller": [written]}


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("QUAD_CACHE_DIR", str(tmp_path))
    return tmp_path


@pytest.fixture
def laws(monkeypatch):
    monkeypatch.setattr(preparation, "functions_of", lambda node: LAWS.get(node.role, []))


def nodes(*settings, **request):
    return list(resolve_flight(Request("hover", settings=settings, **request), {}).values())


def test_what_lacks_is_built_once_and_what_cannot_be_is_named(cache, laws, capfd):
    preparation.build_lacking(nodes(), "fly")
    printed = capfd.readouterr().err
    assert "compiling test_preparation:halved, test_preparation:written" in printed
    assert "compiled 1 of 2" in printed
    assert "run by CPython: test_preparation.written: " in printed
    assert [path.name for path in cache.rglob("*.so")] == [library_path(halved).name]
    made = library_path(halved).stat().st_mtime_ns
    preparation.build_lacking([node for node in nodes() if node.role == "position_controller"], "fly")
    assert capfd.readouterr().err == ""
    assert library_path(halved).stat().st_mtime_ns == made


def test_nothing_is_built_for_nodes_that_run_without(cache, capfd):
    preparation.build_lacking(nodes("flight.machine_code=false"), "fly")
    assert capfd.readouterr().err == ""
    assert list(cache.rglob("*.so")) == []


def test_steps_of_laws_and_plants_are_built_unless_they_are_not_made_for_numba():
    def named(node):
        functions = preparation.functions_of(node)
        return {f"{function.__module__.partition('.')[0]}.{function.__name__}" for function in functions}

    laws = {"quad_position_ctrl.step", "quad_attitude_ctrl.step"}
    assert set.union(*map(named, nodes())) == {"quad_dynamics.step", "quad_dynamics.lumped", "quad_core.step"} | laws
    foreign = next(node for node in nodes(plant="mujoco") if node.role == "simulator")
    assert named(foreign) == {"quad_core.step"}, "the guard alone"


def test_a_process_that_nobody_waits_for_builds_what_lacks(cache, monkeypatch, capfd):
    law = next(node for node in nodes() if node.role == "attitude_controller")
    step = law.plugins["law"].module.step
    process = preparation.build_in_background([law], "fly")
    assert f"compiling {step.__module__}:step in the background" in capfd.readouterr().err
    assert process.wait(240.0) == 0
    assert library_path(step).is_file()
    assert preparation.build_in_background([law], "fly") is None


def test_one_process_builds_at_a_time(cache, monkeypatch, capfd):
    built = []
    monkeypatch.setattr(preparation, "build", built.append)
    monkeypatch.setattr(preparation.os, "nice", lambda _: 0)
    with (cache / "building.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        assert preparation.main(["math:sqrt"]) == 1
        assert "another process compiles now" in capfd.readouterr().err
    assert built == []
    assert preparation.main(["math:sqrt"]) == 0
    assert built == [math.sqrt]


def test_compiling_by_hand_says_why_not(cache, monkeypatch, capfd):
    monkeypatch.setattr(preparation.os, "nice", lambda _: 0)
    assert preparation.main([f"{__name__}:written"]) == 1
    printed = capfd.readouterr().err
    assert f"run by CPython: {__name__}.written: " in printed
    assert "\x1b" not in printed


def test_what_could_not_be_compiled_is_named_by_the_next_flight_and_not_tried_again(cache, laws, monkeypatch, capfd):
    monkeypatch.setattr(preparation.os, "nice", lambda _: 0)
    node = [node for node in nodes() if node.role == "attitude_controller"]
    assert preparation.main([f"{__name__}:written"]) == 1
    capfd.readouterr()
    assert preparation.build_in_background(node, "fly") is None
    printed = capfd.readouterr().err
    assert f"fly: run by CPython: {__name__}.written: " in printed
    assert f"to compile it again: python -m quad_bringup.preparation {__name__}:written" in printed
    assert "in the background" not in printed


def test_a_reason_is_forgotten_once_the_function_compiles(cache, laws, monkeypatch):
    monkeypatch.setattr(preparation.os, "nice", lambda _: 0)
    reason = library_path(halved).with_suffix(".reason")
    reason.parent.mkdir(parents=True)
    reason.write_text("no C compiler to link it with")
    assert preparation.main([f"{__name__}:halved"]) == 0
    assert not reason.exists()


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("not_there:step", "not_there:step: module 'not_there' cannot be imported: No module named 'not_there'"),
        ("math:step", "math:step: module 'math' has no function 'step'"),
        ("math", "found 'math', expected MODULE:FUNCTION"),
        ("math:pi", "found 'math:pi', expected MODULE:FUNCTION"),
    ],
)
def test_what_is_no_function_is_refused_in_one_line(cache, capfd, name, said):
    assert preparation.main(["math:sqrt", name]) == 2
    assert capfd.readouterr().err == f"compile: {said}\n"
