"""The compiled engine: its cache knows its sources, and what cannot be compiled is named."""

import importlib
import sys

import pytest
import stand_in
from stand_in import Internals, small_flight, with_stages

from quad_flight import engine
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


def test_a_plugin_that_cannot_be_compiled_is_named():
    class Difficult(stand_in.position):
        @staticmethod
        def step(parameters, vehicle, memory, inputs, dt):
            return {"no": "answer"}[dt], memory, Internals(dt, 0.0)

    with pytest.raises(engine.EngineError, match="Difficult"):
        fly(small_flight(modules=with_stages(position_controller=Difficult)), compiled=True)
