"""Machine code does what CPython does, to the bit; where there is none, nothing changes."""

import math
import random
import subprocess
import sys
from functools import partial
from typing import NamedTuple, get_type_hints

import pytest

from quad_core import plugins
from quad_core.types import Conditions, Payload, Quat, Rotors, Vec3, Wrench
from quad_core.vehicle import Vehicle
from quad_native import NativeError, library_path, native, signature_of
from quad_native import build as build_module
from quad_native.build import CompilationError, build

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


def unannotated(gain):
    return gain


def stubborn(gain: float) -> float:
    return float.fromhex(gain.hex())


def careless(memory: Inside) -> Inside:
    return Inside(memory.level, memory.count + 0.5, memory.high)


@pytest.fixture(scope="module")
def toy():
    build(change)
    return native(change)


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """An empty cache of compiled code."""
    monkeypatch.setenv("QUAD_CACHE_DIR", str(tmp_path))
    return tmp_path


def test_a_signature_is_read_from_the_annotations():
    assert signature_of(change) == ((Value, float), (Value, Wrench), False)
    assert signature_of(length) == ((Value,), (float,), True)
    assert signature_of(change).cells == 6 + 1 + 6 + 4


@pytest.mark.parametrize(("function", "said"), [(unannotated, "gain: found no annotation"), (max, "a plain function")])
def test_what_has_no_signature_of_numbers_is_refused_by_name_and_left_to_cpython(function, said):
    with pytest.raises(TypeError, match=said):
        signature_of(function)
    assert native(function) is None
    with pytest.raises(CompilationError, match=said):
        build(function)
    assert native(partial(max, 0.0)) is None


def test_classes_and_types_come_back(toy):
    value = Value(Vec3(0.1, -0.2, 1e-300), Inside(math.pi, -(2**62) - 1, True))
    after, wrench = toy(value, 0.5)
    assert (type(after), type(after.torque), type(after.inside), type(wrench)) == (Value, Vec3, Inside, Wrench)
    assert [type(number) for number in after.inside] == [float, int, bool]
    assert (after.inside.count, after.inside.high) == (-(2**62), False)


def test_every_bit_is_that_of_cpython(toy):
    chance = random.Random(3)
    fast = slow = Value(Vec3(0.3, -0.7, 1.9), Inside(0.25, 4, True))
    for _ in range(200):
        gain = chance.uniform(-2.0, 2.0)
        fast, slow = toy(fast, gain)[0], change(slow, gain)[0]
        assert repr(fast) == repr(slow)


def test_a_single_result_stands_alone():
    build(length)
    assert native(length)(Value(Vec3(3.0, 0.0, 4.0))) == 5.0


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ((Value(),), "found 1 arguments, expected 2"),
        ((1.0, 2.0), "found float, expected Value"),
        ((Value(torque=(1.0, 2.0)), 1.0), "found tuple, expected Vec3"),
        ((Value(inside=Inside(count=0.5)), 1.0), "float"),
        ((Value(), "much"), "real number"),
    ],
)
def test_what_is_not_what_it_is_said_to_be_is_refused(toy, given, said):
    with pytest.raises(TypeError, match=said):
        toy(*given)
    assert toy(Value(), 1.0) == change(Value(), 1.0)


def test_nothing_leaks(toy):
    value = Value(Vec3(0.1, 0.2, 0.3))
    counts = [sys.getrefcount(part) for part in (value, Value, Wrench, Vec3)]
    for _ in range(1000):
        toy(value, 1.0)
        with pytest.raises(TypeError):
            toy(value, "much")
    assert [sys.getrefcount(part) for part in (value, Value, Wrench, Vec3)] == counts


def test_without_a_library_there_is_none(cache):
    assert native(change) is None


def test_a_library_that_cannot_be_loaded_is_refused_aloud(cache):
    path = library_path(change)
    path.parent.mkdir(parents=True)
    path.write_bytes(b"not a library")
    with pytest.raises(NativeError, match=f"{path}: cannot be used"):
        native(change)


def test_a_library_without_its_module_is_refused_aloud(cache, tmp_path):
    path, source = library_path(change), tmp_path / "empty.c"
    path.parent.mkdir(parents=True)
    source.write_text("int nothing;\n")
    subprocess.run(["cc", "-shared", "-fPIC", "-o", path, source], check=True)
    with pytest.raises(NativeError, match="cannot be used"):
        native(change)


def test_what_is_built_is_kept_and_another_text_is_another_library(toy, monkeypatch):
    before = library_path(change)
    made = before.stat().st_mtime_ns
    assert build(change) == before
    assert before.stat().st_mtime_ns == made
    assert library_path(length) != before
    monkeypatch.setattr(sys.modules[__name__], "SCALE", 4.0)
    assert library_path(change) != before


@pytest.mark.parametrize("function", [stubborn, careless])
def test_what_numba_cannot_compile_or_would_cut_is_named(cache, function):
    with pytest.raises(CompilationError, match=f"{function.__name__}: "):
        build(function)


def test_without_a_compiler_nothing_is_built(cache, monkeypatch):
    monkeypatch.setenv("CC", "no-such-compiler")
    with pytest.raises(CompilationError, match="change: no C compiler"):
        build(change)
    assert list(cache.rglob("*.so")) == []


def test_a_library_with_an_undefined_symbol_is_refused_aloud(cache, monkeypatch):
    called = "{ %x = call i32 @nowhere()\n ret i32 %x }\ndeclare i32 @nowhere()"
    text = f"define i32 @dynamic_entry(ptr %r, ptr %e, ptr %p) {called}"
    monkeypatch.setattr(build_module, "_compiled_text", lambda *_: text)
    with pytest.raises(CompilationError, match="nowhere"):
        build(change)
    assert list(cache.rglob("*.so")) == []


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
    ("group", "name", "function"),
    [
        (plugins.ATTITUDE_LAW, "abfnitsm", "step"),
        (plugins.POSITION_LAW, "aibs", "step"),
        (plugins.PLANT, "rigid_body", "step"),
        (plugins.PLANT, "rigid_body", "lumped"),
    ],
)
def test_the_paper_s_laws_and_plant_are_those_of_cpython(group, name, function):
    module, chance = plugins.load(group, name), random.Random(11)
    slow = getattr(module, function)
    build(slow)
    fast = native(slow)
    kinds = get_type_hints(slow)
    given = {"parameters": module.Parameters(), "vehicle": Vehicle(), "dt": 0.002}
    state_name = "state" if group == plugins.PLANT else "memory"
    given[state_name] = module.init(module.Parameters(), Vehicle())
    names = slow.__code__.co_varnames[: slow.__code__.co_argcount]
    for _ in range(300):
        given |= {slot: _inputs(kinds[slot], chance) for slot in names if slot in ("inputs", "wrench", "conditions")}
        arguments = [given[name] for name in names]
        found, expected = fast(*arguments), slow(*arguments)
        assert repr(found) == repr(expected)
        if function == "step":
            given[state_name] = found[0 if group == plugins.PLANT else 1]


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
