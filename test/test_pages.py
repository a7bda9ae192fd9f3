"""The pages keep their size, and every link, script and module that they name exists."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")])
LINK = re.compile(r"\]\((?!https?:|mailto:)([^)#\s]*)(#[^)\s]*)?\)")
SCRIPT = re.compile(r"(?<![\w/.])((?:scripts|bench)/[\w./-]*\w)")
MODULE = re.compile(r"`(quad_[a-z_]+(?:/[a-z_0-9/]+\.py|(?:\.[a-z_0-9]+)+))(?:\(\))?`")

pytestmark = pytest.mark.unit


def words(path):
    return len(path.read_text(encoding="utf-8").split())


def test_the_readme_takes_a_minute_and_has_the_two_commands():
    assert words(ROOT / "README.md") < 700
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert "\nscripts/fly " in text
    assert "\nscripts/test " in text


@pytest.mark.parametrize("page", PAGES, ids=lambda path: str(path.relative_to(ROOT)))
def test_no_line_outside_a_table_is_longer_than_160_characters(page):
    lines = page.read_text(encoding="utf-8").splitlines()
    assert [line for line in lines if len(line) > 160 and "|" not in line] == []


def test_pages_that_are_read_in_order_stay_under_40_000_words():
    read = [path for path in ROOT.glob("docs/**/*.md") if not {"reference", "results"} & set(path.parts)]
    assert sum(map(words, read)) < 40_000


def test_at_most_20_decisions():
    assert len(list(ROOT.glob("docs/decisions/[0-9]*.md"))) <= 20


def test_the_glossary_is_in_order_and_names_each_word_once():
    text = (ROOT / "docs" / "reference" / "glossary.md").read_text(encoding="utf-8")
    terms = [term.lower() for term in re.findall(r"^\| ([^|]+) \|", text, re.MULTILINE)][1:]
    assert terms == sorted(terms)
    assert len(set(terms)) == len(terms)


def anchors(path):
    """Return the anchors of a document's headings as the usual viewers make them."""
    headings = re.findall(r"^#+ (.*)$", path.read_text(encoding="utf-8"), re.MULTILINE)
    return {"#" + re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("document", PAGES, ids=lambda path: str(path.relative_to(ROOT)))
def test_links_lead_somewhere(document):
    text = document.read_text(encoding="utf-8")
    for target, anchor in LINK.findall(text):
        path = (document.parent / target).resolve() if target else document
        assert path.exists(), f"{document.name}: {target}"
        if anchor and path.suffix == ".md":
            assert anchor in anchors(path), f"{document.name}: {target}{anchor}"
    # a decision record tells of its day: its scripts may be gone
    for name in SCRIPT.findall(text) if document.parent.name != "decisions" else ():
        assert (ROOT / name).exists(), f"{document.name}: {name}"


@pytest.mark.parametrize("document", PAGES, ids=lambda path: str(path.relative_to(ROOT)))
def test_modules_that_a_document_names_exist(document):
    """As ``quad_core.types``, a module or a name in one, or ``quad_core/types.py``."""
    text = document.read_text(encoding="utf-8") if document.parent.name != "decisions" else ""
    for name in sorted(set(MODULE.findall(text))):
        parts = name.removesuffix(".py").replace("/", ".").split(".")
        base = ROOT / "src" / parts[0] / parts[0]
        if not base.is_dir():
            continue
        known = [base.joinpath(*parts[1:end]) for end in range(len(parts), 1, -1)]
        assert any(path.with_suffix(".py").is_file() or path.is_dir() for path in known[:2]), f"{document.name}: {name}"
