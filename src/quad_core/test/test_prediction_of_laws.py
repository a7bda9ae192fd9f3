"""A law on predicted states: its own text, memory, parameters and internals."""

import pickle
from types import ModuleType
from typing import NamedTuple

import pytest

from quad_core import plugins
from quad_core.parameters import flatten
from quad_core.plugins import law_of
from quad_core.prediction import Prediction, Shown, with_prediction
from quad_core.records import leaves
from quad_core.resolution import resolve
from quad_core.types import Actuation, PositionInputs, Quat, TrajectoryPoint, Vec3, VehicleState
from quad_core.vehicle import Vehicle

VEHICLE = Vehicle()
ROLE = "position_controller"
ON = {"prediction.enabled": True, "prediction.position_age": 0.02}

needs_plugins = pytest.mark.skipif(
    not plugins.names(plugins.POSITION_LAW), reason="plug-ins are not installed: run scripts/setup"
)


class Parameters(NamedTuple):
    gain: float = 2.0


class Memory(NamedTuple):
    steps: float = 0.0


class Internals(NamedTuple):
    seen: float = 0.0


def spy():
    """Return a law that answers with the x that it saw, times its gain."""
    module = ModuleType("spy")

    def init(parameters, vehicle):
        return Memory(parameters.gain)

    def step(parameters, vehicle, memory, inputs, dt):
        x = inputs.state.p_w.x
        return parameters.gain * x, Memory(memory.steps + 1.0), Internals(x)

    vars(module).update(Parameters=Parameters, Memory=Memory, Internals=Internals, init=init, step=step)
    return module


def inputs(x):
    state = VehicleState(Vec3(x, 0.0, 0.0), Vec3(5.0, 0.0, 0.0), Quat(0.0, 0.0, 0.0, 1.0), Vec3(0.0, 0.0, 0.0))
    return PositionInputs(state, TrajectoryPoint(), Actuation(thrust=5.488))


def test_the_law_gets_the_state_where_the_vehicle_is_now():
    module = with_prediction(law_of(spy()), PositionInputs)
    parameters = module.Parameters(Parameters(3.0), Prediction(enabled=True, position_age=0.02))
    memory = module.init(parameters, VEHICLE)
    assert memory.law.steps == 3.0
    output, memory, internals = module.step(parameters, VEHICLE, memory, inputs(1.0), 0.01)
    # 5 m/s for 20 ms
    assert internals.seen == pytest.approx(1.1)
    assert output == pytest.approx(3.3)
    assert internals.predicted_shift_w.x == pytest.approx(0.1)
    assert memory.law.steps == 4.0
    assert memory.known.initialised is True
    assert next(leaf.name for leaf in leaves(module.Internals)) == "seen"
    assert module.Internals._fields[1:] == Shown._fields


@needs_plugins
def test_a_node_flies_the_bare_law_unless_it_is_told_to_predict():
    bare, resolved = resolve(ROLE, {}), resolve(ROLE, {**ON, "aibs.x.position_gain": 3.5})
    assert bare.law.parameters is bare.plugins["law"].parameters
    assert resolved.law.module is not resolved.plugins["law"].module
    assert resolved.law.module == resolve(f"shadow_{ROLE}", ON).law.module
    assert resolved.law.parameters.law.x.position_gain == 3.5
    assert resolved.law.parameters.prediction.position_age == 0.02
    # names and files stay those of the law
    assert flatten(resolved.plugins["law"].parameters)["x.position_gain"] == 3.5
    names = [field.name for field in resolved.all_fields()]
    assert "prediction.position_age" in names
    assert len(names) == len(set(names)) == len(bare.all_fields())
    assert resolve(ROLE, {field.name: field.default for field in resolved.all_fields()}) == resolved


@needs_plugins
@pytest.mark.parametrize("name", ["Parameters", "Memory", "Internals"])
def test_its_types_are_the_same_after_pickling_as_numba_s_file_cache_needs(name):
    kind = getattr(resolve(ROLE, {"law": "aibs", **ON}).law.module, name)
    assert pickle.loads(pickle.dumps(kind)) is kind
    assert kind.__name__ == name
