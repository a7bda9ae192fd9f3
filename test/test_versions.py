"""All packages have the version with which the changelog and the citation begin."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = sorted(path.parent for path in ROOT.glob("src/*/package.xml"))

pytestmark = pytest.mark.unit


def released():
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    version, date = re.search(r"^## (\d+\.\d+\.\d+) \((\d{4}-\d{2}-\d{2})\)$", text, re.MULTILINE).groups()
    return version, date


@pytest.mark.parametrize("package", PACKAGES, ids=lambda path: path.name)
def test_a_package_has_the_released_version(package):
    version, _ = released()
    assert f"<version>{version}</version>" in (package / "package.xml").read_text(encoding="utf-8")
    setup = package / "setup.py"
    assert not setup.exists() or f'version="{version}"' in setup.read_text(encoding="utf-8")


def test_the_citation_names_the_release():
    text = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    version, date = released()
    assert f"\nversion: {version}\n" in text
    assert f"\ndate-released: {date}\n" in text
