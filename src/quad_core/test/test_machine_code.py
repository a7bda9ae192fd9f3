"""Machine code does what CPython does, to the bit; where there is none, CPython does it."""

import math
import random
import sys
from functools import partial
from typing import NamedTuple

import pytest

from quad_core import machine_code_build, plugins, programs
from quad_core.machine_code import MachineCode, library_path, stepper
from quad_core.machine_code_build import CompilationError, build
from quad_core.program import Call, Interpreted, Program, leaves
from quad_core.types import Conditions, Payload, Quat, Rotors, Vec3, Wrench
from quad_core.vehicle import Vehicle

SCALE = 3.0


class Inside(NamedTuple):
    level: float = 0.0
    count: int = 0
    high: bool = False


class Value(NamedTuple):
    torque: Vec3 = Vec3()
    inside: Inside = Inside()


def change(value: Value, gain: float) -> tuple[Value, Wrench]:
    inside = value.inside
    level = inside.level + gain * math.tanh(value.torque.x) ** 2
    count = inside.count + 1 if inside.high else inside.count - 1
    turned = Vec3(value.torque.y, -value.torque.z, SCALE * value.torque.x)
    return Value(turned, Inside(level, count, not inside.high)), Wrench(level, turned)


def length(value: Value) -> float:
    v = value.torque
    return math.sqrt(v.x * v.x + v.y * v.y + v.z * v.z)


def stubborn(gain: float) -> float:
    return float.fromhex(gain.hex())


SLOTS = {"value": Value, "spare": Value, "gain": float, "out": Wrench, "length": float}
PROGRAM = Program(
    "toy",
    SLOTS,
    {
        "step": (Call(change, ("value", "gain"), ("value", "out")), Call(length, ("value",), ("length",))),
        "measure": (Call(length, ("spare",), ("length",)),),
    },
)
STUBBORN = Program("stubborn", {"gain": float}, {"step": (Call(stubborn, ("gain",), ("gain",)),)})


@pytest.fixture(scope="module")
def toy():
    build(PROGRAM)
    return stepper(PROGRAM, True, {})


def test_values_go_in_and_out_with_their_types(toy):
    value = Value(Vec3(0.1, -0.2, 1e-300), Inside(math.pi, -(2**62) - 1, True))
    toy.put("spare", value)
    assert isinstance(toy, MachineCode)
    assert repr(toy.get("spare")) == repr(value)
    assert toy.numbers("spare") == (0.1, -0.2, 1e-300, math.pi, -(2**62) - 1, True)


def test_every_bit_is_that_of_cpython(toy):
    chance, runners = random.Random(3), (toy, Interpreted(PROGRAM))
    for runner in runners:
        runner.put("value", Value(Vec3(0.3, -0.7, 1.9), Inside(0.25, 4, True)))
    for _ in range(200):
        gain, found = chance.uniform(-2.0, 2.0), []
        for runner in runners:
            runner.put("gain", gain)
            runner.run("step")
            found.append(repr([runner.get(name) for name in ("value", "out", "length")]))
        assert found[0] == found[1]


def test_a_value_is_copied_and_other_entries_see_it(toy):
    toy.put("value", Value(Vec3(3.0, 0.0, 4.0)))
    toy.copy("value", "spare")
    toy.run("measure")
    assert toy.get("length") == 5.0


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_what_is_not_finite_is_seen(toy, bad):
    toy.put("spare", Value(Vec3(1e308, 1e308, 1e308)))
    assert toy.is_finite("spare")
    toy.put("spare", Value(Vec3(1.0, bad, 1.0)))
    assert not toy.is_finite("spare")


def test_without_a_library_or_the_wish_cpython_runs_it(toy, monkeypatch, tmp_path):
    assert isinstance(stepper(PROGRAM, False, {}), Interpreted)
    monkeypatch.setenv("QUAD_CACHE_DIR", str(tmp_path))
    assert isinstance(stepper(PROGRAM, True, {}), Interpreted)


def test_a_library_that_cannot_be_loaded_is_not_used(monkeypatch, tmp_path):
    monkeypatch.setenv("QUAD_CACHE_DIR", str(tmp_path))
    path = library_path(PROGRAM)
    path.parent.mkdir(parents=True)
    path.write_bytes(b"not a library")
    assert isinstance(stepper(PROGRAM, True, {}), Interpreted)


def test_what_is_built_is_kept_and_another_text_is_another_library(toy, monkeypatch):
    before = library_path(PROGRAM)
    made = before.stat().st_mtime_ns
    assert build(PROGRAM) == before
    assert before.stat().st_mtime_ns == made
    other = Program("toy", SLOTS, {"step": PROGRAM.entries["measure"]})
    assert library_path(other) != before
    monkeypatch.setattr(sys.modules[__name__], "SCALE", 4.0)
    assert library_path(PROGRAM) != before


def test_what_numba_cannot_compile_is_named():
    with pytest.raises(CompilationError, match="stubborn: "):
        build(STUBBORN)


def test_what_is_no_plain_function_is_interpreted_and_not_built():
    odd = Program("odd", {"gain": float}, {"step": (Call(partial(max, 0.0), ("gain",), ("gain",)),)})
    runner = stepper(odd, True, {"gain": -2.0})
    runner.run("step")
    assert runner.get("gain") == 0.0
    with pytest.raises(CompilationError, match="expected a plain function"):
        build(odd)


class Careless(NamedTuple):
    count: int = 0


def gather(memory: Careless) -> Careless:
    return Careless(memory.count + 0.5)


CARELESS = Program("careless", {"memory": Careless}, {"step": (Call(gather, ("memory",), ("memory",)),)})


def test_a_number_that_is_not_what_it_is_said_to_be_is_never_cut(monkeypatch, tmp_path):
    monkeypatch.setenv("QUAD_CACHE_DIR", str(tmp_path))
    with pytest.raises(CompilationError, match="careless: "):
        build(CARELESS)


def test_a_start_that_is_not_what_it_is_said_to_be_is_interpreted(toy):
    runner = stepper(PROGRAM, True, {"value": Value(inside=Inside(count=0.5))})
    assert isinstance(runner, Interpreted)
    assert runner.get("value").inside.count == 0.5


def test_without_a_compiler_nothing_is_built(monkeypatch, tmp_path):
    monkeypatch.setenv("QUAD_CACHE_DIR", str(tmp_path))
    monkeypatch.setenv("CC", "no-such-compiler")
    with pytest.raises(CompilationError, match="toy: no C compiler"):
        build(PROGRAM)
    assert list(tmp_path.rglob("*.so")) == []


def test_an_undefined_symbol_is_found_when_it_is_linked(monkeypatch, tmp_path):
    monkeypatch.setenv("QUAD_CACHE_DIR", str(tmp_path))
    called = "{ %x = call i32 @nowhere()\n ret i32 %x }\ndeclare i32 @nowhere()"
    text = f"define i32 @dynamic_entry(ptr %r, ptr %e, ptr %p) {called}"
    monkeypatch.setattr(machine_code_build, "_compiled_text", lambda *_: text)
    with pytest.raises(CompilationError, match="nowhere"):
        build(PROGRAM)
    assert list(tmp_path.rglob("*.so")) == []


def scattered(kind, chance):
    """Return a value of ``kind`` near its default; quaternions of length 1, numbers that choose stay."""
    if kind is Quat:
        parts = [chance.gauss(0.0, 0.2) for _ in range(3)]
        norm = math.sqrt(1.0 + sum(part * part for part in parts))
        return Quat(*(part / norm for part in parts), 1.0 / norm)
    default = kind()
    return kind(
        *(
            scattered(type(part), chance)
            if isinstance(part, tuple)
            else part + chance.gauss(0.0, 0.3)
            if isinstance(part, float)
            else part
            for part in default
        )
    )


@pytest.mark.parametrize(
    ("group", "name"),
    [(plugins.ATTITUDE_LAW, "abfnitsm"), (plugins.POSITION_LAW, "aibs"), (plugins.PLANT, "rigid_body")],
)
def test_the_paper_s_laws_and_plant_are_those_of_cpython(group, name):
    module, chance = plugins.load(group, name), random.Random(11)
    program = programs.plant(module) if group == plugins.PLANT else programs.law(group, module)
    build(program)
    parameters = module.Parameters()
    begin = {"parameters": parameters, "vehicle": Vehicle(), "dt": 0.002}
    begin["state" if group == plugins.PLANT else "memory"] = module.init(parameters, Vehicle())
    runners = [stepper(program, wanted, begin) for wanted in (True, False)]
    assert [type(runner) for runner in runners] == [MachineCode, Interpreted]
    varied = [slot for slot in ("inputs", "applied", "commanded", "conditions") if slot in program.slots]
    for _ in range(300):
        values = {slot: _inputs(program.slots[slot], chance) for slot in varied}
        for runner in runners:
            for slot, value in values.items():
                runner.put(slot, value)
            for entry in program.entries:
                runner.run(entry)
        for slot in program.slots:
            assert repr(runners[0].get(slot)) == repr(runners[1].get(slot)), slot
        if group != plugins.PLANT:
            for runner in runners:
                runner.copy("next", "memory")


def _inputs(kind, chance):
    if kind is Conditions:
        return _weather(chance)
    required = [name for name in kind._fields if name not in kind._field_defaults]
    if required:
        return kind(*(scattered(kind.__annotations__[name], chance) for name in required))
    return scattered(kind, chance)


def _weather(chance):
    def vector(size):
        return Vec3(*(chance.gauss(0.0, size) for _ in range(3)))

    rotors = Rotors(*(chance.uniform(0.3, 1.0) for _ in range(4)))
    carried = chance.random() < 0.5
    payload = Payload(0.1, vector(0.01), Vec3(1e-3, 2e-3, 3e-3)) if carried else Payload()
    return Conditions(vector(1.0), vector(0.01), vector(2.0), payload, rotors, chance.uniform(0.5, 1.0))


def test_leaves_of_the_contract_s_values_are_numbers():
    for group in (plugins.ATTITUDE_LAW, plugins.POSITION_LAW):
        for name in plugins.names(group):
            for kind in programs.law(group, plugins.load(group, name)).slots.values():
                assert leaves(kind)
