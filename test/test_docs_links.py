"""Every relative link exists, and every script that the documents name."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
DOCUMENTS = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")])
LINK = re.compile(r"\]\((?!https?:|mailto:)([^)#\s]*)(#[^)\s]*)?\)")
SCRIPT = re.compile(r"(?<![\w/.])((?:scripts|bench)/[\w./-]*\w)")
MODULE = re.compile(r"`(quad_[a-z_]+(?:/[a-z_0-9/]+\.py|(?:\.[a-z_0-9]+)+))(?:\(\))?`")

pytestmark = pytest.mark.unit


def anchors(path):
    """Return the anchors of a document's headings as the usual viewers make them."""
    headings = re.findall(r"^#+ (.*)$", path.read_text(encoding="utf-8"), re.MULTILINE)
    return {"#" + re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
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


def test_readme_has_the_two_commands():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert "\nscripts/fly " in text
    assert "\nscripts/test " in text


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
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
