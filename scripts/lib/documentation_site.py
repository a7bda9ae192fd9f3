"""The documentation as a web site: the pages of docs/, the README, and the API of the packages that need no ROS.

It is written to build/site by Sphinx, which comes with hashes from requirements/docs into .cache/docs-packages.
"""

import os
import pkgutil
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from ros_imports import imports_ros

ROOT = Path(__file__).resolve().parents[2]
SOURCE, SITE = ROOT / "build" / "site-source", ROOT / "build" / "site"
LOCK, PACKAGES = ROOT / "requirements" / "docs" / "lock.txt", ROOT / ".cache" / "docs-packages"

# Packages whose modules import no ROS, nodes aside.
PURE = (
    "quad_core", "quad_trajectory", "quad_position_ctrl", "quad_attitude_ctrl", "quad_dynamics", "quad_flight",
    "quad_commander", "quad_autopilot", "quad_px4", "quad_mavlink", "quad_crazyflie",
)  # fmt: skip
CONTENTS = {
    "Start": ("README.md", "CONTRIBUTING.md", "CHANGELOG.md"),
    "Fly and look": (
        "look_at_flights",
        "flight_log",
        "scenarios",
        "own_law",
        "own_nodes",
        "own_stage",
        "swap_the_plant",
        "px4",
        "mavlink",
        "crazyflie",
        "vehicle_without_truth",
        "safety",
        "faults",
        "performance",
    ),
    "The paper": ("paper_map", "as_printed", "comparison", "sensitivity", "stability", "real_conditions"),
    "Reference": ("topics", "parameters/README"),
    "Decisions": ("decisions/README",),
}
CONFIGURATION = """
project = "Quadrotor flight stack"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.viewcode", "sphinx.ext.mathjax"]
myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_heading_anchors = 4
html_theme = "furo"
root_doc = "index"
autodoc_member_order = "bysource"
autodoc_typehints = "description"
# Links into the source tree are for readers of the repository; test/test_docs_links.py checks them all.
# A diagram stands as its text; a field that two classes have is no link.
suppress_warnings = ["myst.xref_missing", "toc.not_included", "misc.highlighting_failure", "ref.python"]


def setup(app):
    import documentation_site

    app.connect("autodoc-process-docstring", lambda *event: documentation_site.plain_to_rst(event[-1]))
"""


def pages() -> list[str]:
    """Return the pages of docs/ that no table of contents and no page that collects them names."""
    listed = {page for part in CONTENTS.values() for page in part}
    found = (path.relative_to(ROOT / "docs").with_suffix("") for path in (ROOT / "docs").rglob("*.md"))
    collected = {path for path in found if str(path.parent) not in ("parameters", "decisions")}
    return sorted(str(path) for path in collected if str(path) not in listed)


def modules(package: str) -> list[str]:
    """Return the modules of a package that need no ROS."""
    top = ROOT / "src" / package / package
    found = pkgutil.walk_packages([str(top)], f"{package}.")
    names = [entry.name for entry in found if not entry.ispkg]
    return sorted(name for name in names if not imports_ros(_source(name)))


def _source(module: str) -> str:
    path = ROOT / "src" / module.partition(".")[0] / module.replace(".", "/")
    return path.with_suffix(".py").read_text(encoding="utf-8")


def missing() -> list[str]:
    """Return what the site would lack, a line each."""
    lines = [f"docs/{page}.md: in no table of contents of scripts/lib/documentation_site.py" for page in pages()]
    listed = [page for title, part in CONTENTS.items() if title != "Start" for page in part]
    lines += [
        f"docs/{page}.md: named by scripts/lib/documentation_site.py, but not there"
        for page in listed
        if not _is_page(page)
    ]
    return lines + [f"src/{package}: no module without ROS" for package in PURE if not modules(package)]


def _is_page(page: str) -> bool:
    return (ROOT / "docs" / f"{page}.md").is_file()


def write_source() -> None:
    """Write what Sphinx reads."""
    shutil.rmtree(SOURCE, ignore_errors=True)
    shutil.copytree(ROOT / "docs", SOURCE / "docs")
    for name in CONTENTS["Start"]:
        shutil.copyfile(ROOT / name, SOURCE / name)
    (SOURCE / "api").mkdir()
    for package in PURE:
        (SOURCE / "api" / f"{package}.rst").write_text("\n".join(api_page(package)), encoding="utf-8")
    (SOURCE / "conf.py").write_text(CONFIGURATION, encoding="utf-8")
    (SOURCE / "index.md").write_text("\n".join(index()) + "\n", encoding="utf-8")


def index() -> Iterator[str]:
    """Return the lines of the first page."""
    yield "# Quadrotor flight stack\n"
    for title, part in CONTENTS.items():
        entries = [page if title == "Start" else f"docs/{page}" for page in part]
        entries += sorted(f"docs/decisions/{path.stem}" for path in (ROOT / "docs/decisions").glob("0*.md")) * (
            title == "Decisions"
        )
        entries += sorted(
            f"docs/parameters/{path.stem}" for path in (ROOT / "docs/parameters").glob("*.md") if path.stem != "README"
        ) * (title == "Reference")
        yield from _tree(title, entries)
    yield from _tree("API", [f"api/{package}" for package in PURE])


def _tree(title: str, entries: list[str]) -> list[str]:
    return ["```{toctree}", ":maxdepth: 1", f":caption: {title}", "", *entries, "```", ""]


def api_page(package: str) -> Iterator[str]:
    """Return the lines of the API page of one package."""
    yield from (package, "=" * len(package), "", f".. automodule:: {package}", "")
    for name in modules(package):
        yield from (name, "-" * len(name), "", f".. automodule:: {name}", "   :members:", "")


def plain_to_rst(lines: list[str]) -> None:
    """Rewrite a docstring in place: it is plain text with ``code``, and indented equations shown as they stand."""
    text: list[str] = []
    indented = False
    for line in lines:
        if line.startswith("  ") and not indented:
            announced = next((earlier for earlier in reversed(text) if earlier), "").endswith("::")
            text += [""] if announced else ["", "::", ""]
        elif line and not line.startswith(" ") and indented:
            text.append("")
        indented = line.startswith(" ") or (indented and not line)
        text.append(line if indented else _escaped(line))
    lines[:] = text


def _escaped(line: str) -> str:
    parts = line.split("``")
    parts[::2] = [re.sub(r"([|*\\]|_\b)", r"\\\1", part) for part in parts[::2]]
    return "``".join(parts)


def install() -> None:
    """Fetch Sphinx if it is not here in the version that is asked for; raises CalledProcessError."""
    stamp = PACKAGES / ".lock"
    if stamp.is_file() and stamp.read_bytes() == LOCK.read_bytes():
        return
    print("scripts/docs: fetching Sphinx ...", file=sys.stderr)
    shutil.rmtree(PACKAGES, ignore_errors=True)
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-deps"]
    command += ["--require-hashes", "--only-binary", ":all:", "--target", str(PACKAGES), "--requirement", str(LOCK)]
    subprocess.run(command, check=True)
    stamp.write_bytes(LOCK.read_bytes())


def build() -> int:
    """Write the site, every warning an error; returns the exit code."""
    try:
        install()
    except subprocess.CalledProcessError as error:
        print(f"scripts/docs: pip ended with exit code {error.returncode}", file=sys.stderr)
        return 2
    write_source()
    paths = os.pathsep.join([str(PACKAGES), str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")])
    command = [sys.executable, "-m", "sphinx", "--quiet", "--fail-on-warning", "--keep-going", str(SOURCE), str(SITE)]
    code = subprocess.run(command, env={**os.environ, "PYTHONPATH": paths}, check=False).returncode
    if code == 0:
        print(f"{(SITE / 'index.html').relative_to(ROOT)}: written")
    return code
