"""The compiled engine: its cache knows its sources, and what cannot be compiled is named."""

import importlib
import sys
import time
from enum import IntEnum

import numpy as np
import pytest
import stand_in
from stand_in import small_flight, with_stages

from quad_flight import engine, flight
from quad_flight.flight import fly

PLUGIN = """
from stand_in import *
class position(position):
    @staticmethod
    def step(parameters, vehicle, memory, inputs, dt):
        return answer(parameters, inputs), memory, Internals(dt, 0.0)
def answer(parameters, inputs):
    return AttitudeThrust(Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0),
                          Quat(0.0, 0.0, 0.0, 1.0), helped(parameters.gain), 0.0)
"""
HELPER = "def helped(gain):\n    return gain * {factor}\n"


def load_plugin(directory, factor):
    (directory / "foreign_helper.py").write_text(HELPER.format(factor=factor))
    (directory / "foreign_law.py").write_text("from foreign_helper import helped\n" + PLUGIN)
    for name in ("foreign_helper", "foreign_law"):
        sys.modules.pop(name, None)
    importlib.invalidate_caches()
    return with_stages(position_controller=importlib.import_module("foreign_law").position)


def test_cache_is_used_again_and_knows_every_source_that_it_holds(tmp_path, monkeypatch):
    monkeypatch.setenv("QUAD_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    monkeypatch.syspath_prepend(str(tmp_path))
    hits, logged, thrusts = [], [], []
    for factor in ("1.0", "1.0", "3.0"):
        modules = load_plugin(tmp_path, factor)
        result = fly(small_flight(modules=modules), compiled=True)
        thrusts.append(result.topics["wrench_setpoint"]["thrust"][0])
        fly(small_flight(modules=modules), compiled=True, logging=False)
        hits.append(sum(engine.compiled_engine(modules).fly.stats.cache_hits.values()))
        logged.append(sum(engine.compiled_engine(modules).fly_logged.stats.cache_hits.values()))
    assert thrusts == [4.0, 4.0, 12.0]
    assert hits == [0, 1, 0]
    assert logged == [0, 1, 0]
    assert len(list((tmp_path / "cache").iterdir())) == 2


def kinds(value):
    return set().union(*map(kinds, value)) if isinstance(value, tuple) else {type(value)}


@pytest.mark.parametrize("case", ["case2", "flight"])
def test_what_the_compiled_loop_is_given_is_plain(case, monkeypatch):
    given = []
    made = engine.python_engine

    def watched(modules):
        return made(modules)._replace(fly=lambda *values: given.append(values) or values[2]._replace(outcome=1))

    monkeypatch.setattr(flight, "python_engine", watched)
    fly(flight.from_names(case, duration=1.0), logging=False)
    # with an enumeration Numba finds all types in Python: 2 ms a flight
    assert kinds(given[0]) <= {int, float, bool, str, np.ndarray}


def test_a_plugin_that_cannot_be_compiled_is_named():
    class Difficult(stand_in.plant):
        @staticmethod
        def observe(parameters, vehicle, state):
            return {"no": "state"}.get(state.z, stand_in.plant.observe(parameters, vehicle, state))

    with pytest.raises(engine.EngineError, match="Difficult"):
        fly(small_flight(modules=stand_in.MODULES._replace(plant=Difficult)), compiled=True)


@pytest.mark.parametrize("value", ["", "relative/cache"])
def test_no_cache_in_the_working_directory(tmp_path, monkeypatch, value):
    """The XDG specification: an empty or relative XDG_CACHE_HOME counts as none."""
    monkeypatch.delenv("QUAD_CACHE_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", value)
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    assert engine.cache_root() == tmp_path / ".cache" / "quad_campaign"


def test_a_chosen_cache_that_all_may_write_is_refused(tmp_path, monkeypatch):
    (tmp_path / "shared").mkdir()
    (tmp_path / "shared").chmod(0o777)
    monkeypatch.setenv("QUAD_CACHE_DIR", str(tmp_path / "shared"))
    with pytest.raises(PermissionError, match="shared: found mode 0777"):
        engine.cache_root()


@pytest.mark.parametrize("what", ["no folder", "read-only"])
def test_without_a_folder_that_can_be_written_the_flight_is_compiled_all_the_same(what, monkeypatch, capsys):
    def no_locator(*_):
        raise RuntimeError("cannot cache function 'take_off': no locator available")

    if what == "no folder":
        monkeypatch.setenv("QUAD_CACHE_DIR", "/dev/null/cache")
    else:
        monkeypatch.setattr(engine, "_cached", no_locator)
    found = engine._compiled_engine.__wrapped__(stand_in.MODULES)
    assert found.fly == engine.compiled(engine.python_engine(stand_in.MODULES).fly)
    assert "QUAD_CACHE_DIR names a folder that can be written" in capsys.readouterr().err


LIMIT = 2.0
Form = IntEnum("Form", {"ROUND": 0, "SQUARE": 1})


def chosen(form: int) -> float:
    """Return what depends on both."""
    return LIMIT if form == Form.SQUARE else 0.0


def test_a_constant_an_enum_and_what_a_closure_holds_count(monkeypatch):
    def holder(number):
        return lambda form: chosen(form) + number

    def lines(number):
        return "".join(engine.reached(holder(number), set(), set()))

    before = lines(1.0)
    assert lines(1.0) == before
    monkeypatch.setitem(globals(), "LIMIT", 3.0)
    other = lines(1.0)
    monkeypatch.undo()
    monkeypatch.setitem(globals(), "Form", IntEnum("Form", {"SQUARE": 0, "ROUND": 1}))
    turned = lines(1.0)
    monkeypatch.undo()
    assert len({before, other, turned, lines(2.0)}) == 4


def test_a_long_first_flight_shows_signs_of_life(monkeypatch, capsys):
    monkeypatch.setattr(engine, "_SIGN_EVERY", 0.01)
    with engine.signs_of_life("first of the test"):
        deadline = time.monotonic() + 60.0
        said = ""
        while said.count("s so far\n") < 2 and time.monotonic() < deadline:
            time.sleep(0.01)
            said += capsys.readouterr().err
    assert said.startswith("\rcompiling the flight: 0 s so far\n")
    time.sleep(0.05)
    capsys.readouterr()  # a line may have been on its way
    with engine.signs_of_life("first of the test"):
        time.sleep(0.05)
    assert capsys.readouterr().err == ""
