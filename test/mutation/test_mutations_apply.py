"""Every declared mistake still fits the sources; running them is the business of scripts/mutate."""

import ast
import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import mutation_engine
import pytest
from mutation_engine import Mutation, MutationError, mutated, source_file
from mutation_list import MUTATIONS, read_mistakes

pytestmark = pytest.mark.unit
ROOT = Path(__file__).resolve().parents[2]
SOURCE = '''"""Doc."""


def area(a, b):
    """Return a * b."""
    # a comment with a * b in it
    return (a
        * b)
'''


@pytest.mark.parametrize(
    "file", sorted({source_file(ROOT, mutation) for mutation in MUTATIONS}), ids=lambda path: path.stem
)
def test_every_mistake_in_a_file_applies(file):
    assert file.exists()
    source = file.read_text(encoding="utf-8")
    for mutation in MUTATIONS:
        if source_file(ROOT, mutation) == file:
            mutated(source, mutation)


def test_there_are_enough_and_none_twice():
    assert len(MUTATIONS) >= 70
    assert len(set(MUTATIONS)) == len(MUTATIONS)


@pytest.mark.parametrize("line", ["  eq. 1: `a` -> b", "  eq. 1: a -> `b`", "  `a` -> `b`"])
def test_a_line_that_is_no_mistake_is_named(tmp_path, line):
    (tmp_path / "pkg.txt").write_text(f"pkg.mod.area\n  eq. 1: `a * b` -> ``\n{line}\n")
    with pytest.raises(MutationError, match=r"pkg.txt:3: found .*expected a function or a mistake"):
        list(read_mistakes(tmp_path / "pkg.txt"))


def test_what_unit_tests_read_of_the_root_is_copied():
    reached = re.compile(r'parents\[3\]((?: / "[^"]+")+)')
    for file in sorted((ROOT / "src").glob("*/test/*.py")):
        for words in reached.findall(file.read_text(encoding="utf-8")):
            path = "/".join(re.findall(r'"([^"]+)"', words))
            copied = [name for name in mutation_engine.COPIED if f"{path}/".startswith(f"{name}/")]
            assert copied, f"{file.relative_to(ROOT)} reads {path}, which scripts/mutate does not copy"


def test_what_unit_tests_import_of_the_root_is_copied():
    folders = [ROOT / name for name in mutation_engine.COPIED]
    for file in sorted([*(ROOT / "src").glob("*/test/*.py"), *(ROOT / "studies/test").glob("*.py")]):
        nodes = ast.walk(ast.parse(file.read_text(encoding="utf-8")))
        for name in {node.module for node in nodes if isinstance(node, ast.ImportFrom) and not node.level}:
            spec = find_spec(name.partition(".")[0])
            origin = Path(spec.origin).resolve() if spec and spec.origin and spec.has_location else Path("/")
            if origin.is_relative_to(ROOT) and origin.relative_to(ROOT).parts[0] not in (".venv", "build", "install"):
                known = any(origin.is_relative_to(folder) for folder in folders)
                assert known, f"{file.relative_to(ROOT)} imports {name}, which scripts/mutate does not copy"


def test_layout_and_comments_do_not_matter():
    text = mutated(SOURCE, Mutation("eq. 0", "pkg.mod.area", "a * b", "a + b"))
    scope = {}
    exec(text, scope)
    assert scope["area"](2, 3) == 5


LOOP = "def count(n):\n    while n > 0:\n        n -= 1\n    return n\n"
LOOP_TEST = "from pkg.mod import count\ndef test_it():\n    assert count(3) == 0\n"
TEXT_TEST = "def test_text():\n    assert 'n -= 1' in open('src/pkg/pkg/mod.py').read()\n"
CONFTEST = """
import sys
from hypothesis import settings
sys.path.insert(0, "src/pkg")
settings.register_profile("mutation")
"""


HASTY = """
import sys
sys.path.insert(0, {folder!r})
import hypothesis, pytest
import mutation_engine as engine
engine.SECONDS_PER_MUTANT = 1
"""


JUDGE = """
from pathlib import Path
tree, seen = Path(sys.argv[1]), []
for stages in ([["test_a.py"]], [["test_a.py"], ["test_b.py"]]):
    engine.test_paths = lambda *_: stages
    outcome = engine.judge(tree, engine.Mutation("eq. 0", "pkg.mod.count", "n -= 1", "n -= 0"))
    seen += [bool(outcome.killed_by), outcome.timed_out]
print(*seen)
"""


def test_tests_that_find_no_end_have_noticed_nothing(tmp_path):
    (tmp_path / "src/pkg/pkg").mkdir(parents=True)
    (tmp_path / "src/pkg/pkg/mod.py").write_text(LOOP)
    (tmp_path / "conftest.py").write_text(CONFTEST)
    (tmp_path / "test_a.py").write_text(LOOP_TEST)
    (tmp_path / "test_b.py").write_text(TEXT_TEST)
    # the engine forks, and a process with threads, as that of these tests, must not
    words = [sys.executable, "-c", HASTY.format(folder=str(Path(mutation_engine.__file__).parent)) + JUDGE]
    done = subprocess.run([*words, str(tmp_path)], capture_output=True, text=True, timeout=120, check=True)
    assert done.stdout.splitlines()[-1] == "False True True False"


@pytest.mark.parametrize(("function", "old", "new", "complaint"), [
    ("pkg.mod.volume", "a * b", "a + b", "0 functions"),
    ("pkg.mod.area", "a / b", "a + b", "0 times"),
    ("pkg.mod.area", "a", "c", "times"),
    ("pkg.mod.area", "a * b", "a *", "not Python"),
    ("pkg.mod.area", "a * b", "a  *  b", "changes nothing"),
])  # fmt: skip
def test_a_mutation_that_does_not_fit_is_refused(function, old, new, complaint):
    with pytest.raises(MutationError, match=complaint):
        mutated(SOURCE, Mutation("eq. 0", function, old, new))
