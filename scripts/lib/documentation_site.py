"""The documentation as a web site: the pages of docs/, the README, and the API of the packages that need no ROS.

It is written to build/site by Sphinx, which comes with hashes from requirements/docs into .cache/docs-packages.
"""

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ros_imports import imports_ros

ROOT = Path(__file__).resolve().parents[2]
SOURCE, SITE = ROOT / "build" / "site-source", ROOT / "build" / "site"
LINK = re.compile(r"\]\(([^)#\s]+\.md)")
LOCK, PACKAGES = ROOT / "requirements" / "docs" / "lock.txt", ROOT / ".cache" / "docs-packages"

WITH_ROS = ("quad_bringup", "quad_msgs", "quad_node")
PURE = [path.name for path in sorted((ROOT / "src").glob("quad_*")) if path.name not in WITH_ROS]
"""Packages whose modules import no ROS, nodes aside."""
TOP = ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")
SECTIONS = {
    "Tutorials": "tutorials",
    "How to": "how_to",
    "Reference": "reference",
    "Explanation": "explanation",
    "Results": "results",
    "Decisions": "decisions",
}
"""{caption: folder of docs/}; docs/README.md is the first page and names every page but parameters and decisions."""
SOURCES: set[str] = set()
STYLE = """.table-wrapper{overflow-x:auto}table.docutils{font-size:.85em}
td{overflow-wrap:anywhere;min-width:5em}td:nth-child(2){min-width:5.4em}td:first-child:has(code){min-width:7em}
article img{max-width:100%;height:auto}.equation{overflow-x:auto;margin:.9em 0}
pre{overflow-x:auto}
@media(max-width:700px){table:has(th:nth-child(5)){min-width:46em}article h1{font-size:1.8em}}
@media(max-width:700px){article p:has(img[src$=svg]){overflow-x:auto}article img[src$=svg]{max-width:none;width:720px}}
"""
VIEWPORT = '<meta name="viewport" content="width=device-width, initial-scale=1">'
TITLE = 'style="font: bold 1em monospace; overflow-wrap: anywhere"'
CONFIGURATION = """
project = "Quadrotor flight stack"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.viewcode"]
myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_heading_anchors = 4
html_theme = "furo"
highlight_language = "none"
root_doc = "index"
autodoc_member_order = "bysource"
autodoc_typehints = "description"
html_math_renderer = "mathml"
html_static_path = ["_static"]
html_css_files = ["site.css"]
# A field that two classes have is no link.
suppress_warnings = ["toc.not_included", "misc.highlighting_failure", "ref.python"]


def setup(app):
    import documentation_site

    app.connect("autodoc-process-docstring", lambda *event: documentation_site.plain_to_rst(event[-1]))
    app.add_html_math_renderer("mathml", (documentation_site.inline_math, None), (documentation_site.block_math, None))
"""


def pages(folder: str) -> list[str]:
    """Return the pages of one section in the order in which its README or docs/README.md names them, then the rest."""
    top = ROOT / "docs"
    found = {path.relative_to(top).as_posix(): path for path in (top / folder).rglob("*.md")}
    listed = []
    for index in (top / folder / "README.md", top / "README.md"):
        if index.is_file():
            for target in LINK.findall(index.read_text(encoding="utf-8")):
                path = (index.parent / target).resolve()
                if path.suffix == ".md" and path.is_relative_to(top / folder):
                    listed.append(path.relative_to(top).as_posix())
    return [
        name
        for name in dict.fromkeys([*sorted(n for n in found if n.endswith("/README.md")), *listed, *sorted(found)])
        if name in found
    ]


def modules(package: str) -> list[str]:
    """Return the modules of a package that need no ROS."""
    top = ROOT / "src" / package
    found = [path for path in (top / package).rglob("*.py") if not path.name.startswith("__")]
    names = [".".join(path.relative_to(top).with_suffix("").parts) for path in found]
    return sorted(name for name, path in zip(names, found, strict=True) if not imports_ros(path.read_text("utf-8")))


def missing() -> list[str]:
    """Return what the site would lack, a line each: a page outside of every section, or that no index names."""
    top = ROOT / "docs"
    named = {path for index in top.rglob("README.md") for path in _named(index)}
    lines = []
    for path in sorted(top.rglob("*.md")):
        name = path.relative_to(top)
        if name.parts[0] not in (*SECTIONS.values(), "README.md"):
            lines.append(f"docs/{name}: in no section of scripts/lib/documentation_site.py")
        elif path not in named and path != top / "README.md":
            lines.append(f"docs/{name}: named by no README.md of docs")
    return lines + [f"src/{package}: no module without ROS" for package in PURE if not modules(package)]


def _named(index: Path) -> list[Path]:
    return [(index.parent / target).resolve() for target in LINK.findall(index.read_text(encoding="utf-8"))]


def write_source() -> None:
    """Write what Sphinx reads."""
    shutil.rmtree(SOURCE, ignore_errors=True)
    shutil.copytree(ROOT / "docs", SOURCE / "docs")
    for name in TOP:
        shutil.copyfile(ROOT / name, SOURCE / name)
    (SOURCE / "api").mkdir()
    for package in PURE:
        (SOURCE / "api" / f"{package}.rst").write_text("\n".join(api_page(package)), encoding="utf-8")
    (SOURCE / "conf.py").write_text(CONFIGURATION, encoding="utf-8")
    (SOURCE / "docs" / "README.md").unlink()
    (SOURCE / "index.md").write_text("\n".join(index()) + "\n", encoding="utf-8")
    (SOURCE / "_static").mkdir()
    (SOURCE / "_static" / "site.css").write_text(STYLE, encoding="utf-8")
    link_sources()
    (SOURCE / "sources.json").write_text(json.dumps(sorted(SOURCES)), encoding="utf-8")


def index() -> Iterator[str]:
    """Return the lines of the first page: docs/README.md, and the tables of contents."""
    text = (ROOT / "docs" / "README.md").read_text(encoding="utf-8")
    yield re.sub(r"\]\((?![a-z]+:|#)", "](docs/", text)
    yield from _tree("Project", list(TOP))
    for caption, folder in SECTIONS.items():
        yield from _tree(caption, [f"docs/{page}" for page in pages(folder)])
    yield from _tree("API", [f"api/{package}" for package in PURE])


def link_sources() -> None:
    """Make each link to a file that is no page lead to a coloured copy of it in the site; a folder is no link there."""
    for page in SOURCE.rglob("*.md"):
        here = page.relative_to(SOURCE).parent
        up = "../" * len(here.parts)

        def replaced(match: re.Match[str], here: Path = here, up: str = up) -> str:
            words, target = match[1], match[2]
            path = Path(os.path.normpath(ROOT / here / target))
            if path == ROOT / "docs" / "README.md":
                return f"[{words}]({up}index.md)"
            if not path.exists() or path.suffix in (".md", ".svg", ".png", ".gif"):
                return match[0]
            shown = re.sub(r"`([^`]*)`", r"<code>\1</code>", words)
            if path.is_dir():
                return shown
            name = path.relative_to(ROOT).as_posix()
            SOURCES.add(name)
            return f'<a href="{up}source/{name}.html">{shown}</a>'

        text = page.read_text(encoding="utf-8")
        page.write_text(
            re.sub(
                r"(?<!!)\[([^]]*)\]\(((?![a-z]+:|#)[^)#\s]+)(?:#[^)\s]*)?\)",
                lambda m: replaced(m) if not m[2].endswith(".md") or "README" in m[2] else m[0],
                text,
            ),
            encoding="utf-8",
        )


def write_sources() -> None:
    """Write the coloured copies of the files that pages link to; runs where Pygments can be imported."""
    from pygments import highlight
    from pygments.formatters import HtmlFormatter
    from pygments.lexers import TextLexer, get_lexer_for_filename
    from pygments.util import ClassNotFound

    for name in sorted(json.loads((SOURCE / "sources.json").read_text(encoding="utf-8"))):
        try:
            lexer = get_lexer_for_filename(name)
        except ClassNotFound:
            lexer = TextLexer()
        target = SITE / "source" / f"{name}.html"
        target.parent.mkdir(parents=True, exist_ok=True)
        text = (ROOT / name).read_text(encoding="utf-8")
        form = HtmlFormatter(full=True, title=name, linenos="inline", lineanchors="L", cssstyles="overflow-x: auto")
        page = (
            highlight(text, lexer, form).replace("<head>", f"<head>{VIEWPORT}", 1).replace("<h2>", f"<h2 {TITLE}>", 1)
        )
        target.write_text(page, encoding="utf-8")


def inline_math(visitor: Any, node: Any) -> None:
    """Write an equation within a line as MathML, which browsers draw without a script."""
    _math(visitor, node, "inline")


def block_math(visitor: Any, node: Any) -> None:
    """Write an equation on a line of its own."""
    _math(visitor, node, "block")


def _math(visitor: Any, node: Any, display: str) -> None:
    from docutils.nodes import SkipNode
    from latex2mathml.converter import convert

    equation = convert(node.astext(), display=display)
    visitor.body.append(f'<div class="equation">{equation}</div>' if display == "block" else equation)
    raise SkipNode


def _tree(title: str, entries: list[str]) -> list[str]:
    return ["```{toctree}", ":hidden:", ":maxdepth: 1", f":caption: {title}", "", *entries, "```", ""]


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
    surroundings = {**os.environ, "PYTHONPATH": paths}
    code = subprocess.run(command, env=surroundings, check=False).returncode
    if code == 0:
        copied = [sys.executable, "-c", "import documentation_site; documentation_site.write_sources()"]
        code = subprocess.run(copied, env=surroundings, check=False).returncode
    if code == 0:
        print(f"{(SITE / 'index.html').relative_to(ROOT)}: written")
    return code
