"""Every declared mistake still fits the sources; running them is the business of scripts/mutate."""

from pathlib import Path

import pytest
from mutation_engine import Mutation, MutationError, mutated, source_file
from mutation_list import MUTATIONS

pytestmark = pytest.mark.unit
ROOT = Path(__file__).resolve().parents[2]
SOURCE = '''"""Doc."""


def area(a, b):
    """Return a * b."""
    # a comment with a * b in it
    return (a
        * b)
'''


@pytest.mark.parametrize("mutation", MUTATIONS, ids=str)
def test_mutation_applies(mutation):
    file = source_file(ROOT, mutation)
    assert file.exists(), f"{mutation}: no file {file}"
    source = file.read_text(encoding="utf-8")
    compile(mutated(source, mutation), str(file), "exec")


def test_there_are_enough_and_none_twice():
    assert len(MUTATIONS) >= 70
    assert len(set(MUTATIONS)) == len(MUTATIONS)


def test_layout_and_comments_do_not_matter():
    text = mutated(SOURCE, Mutation("eq. 0", "pkg.mod.area", "a * b", "a + b"))
    scope = {}
    exec(text, scope)
    assert scope["area"](2, 3) == 5


@pytest.mark.parametrize(
    ("function", "old", "new", "complaint"),
    [
        ("pkg.mod.volume", "a * b", "a + b", "0 functions"),
        ("pkg.mod.area", "a / b", "a + b", "0 times"),
        ("pkg.mod.area", "a", "c", "times"),
        ("pkg.mod.area", "a * b", "a *", "not Python"),
        ("pkg.mod.area", "a * b", "a  *  b", "changes nothing"),
    ],
)
def test_a_mutation_that_does_not_fit_is_refused(function, old, new, complaint):
    with pytest.raises(MutationError, match=complaint):
        mutated(SOURCE, Mutation("eq. 0", function, old, new))
