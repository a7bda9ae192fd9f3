"""Renew requirements/lock.txt: every version and hash that scripts/setup installs where ROS 2 comes as wheels.

One file serves Python 3.10 to 3.13 on Linux, x86-64 and ARM64. It is resolved by `uv pip compile` from the other files
of requirements/ and holds no address: pip asks the registry that it is set up for, and takes only files with these
hashes.
"""

import argparse
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
REQUIREMENTS = ROOT / "requirements"
GROUPS = {
    "lock": ("ros", "runtime", "build", "extras", "dev"),
    "lock-minimal": ("ros", "runtime"),
    "docs/lock": ("docs/packages",),
    "vehicles/lock": ("vehicles/packages",),
}
APART = {"docs/lock": [], "vehicles/lock": ["--no-deps"]}
"""Locks of folders of their own, which change no other version, with further options of uv."""
HEAD = """# Written by scripts/lib/lock.py; to renew: change the other files here and run it again.
# Linux x86-64 and ARM64, Python 3.10 to 3.13. pip refuses a file whose hash is not here.
"""
PLATFORM = "sys_platform == 'linux' and platform_python_implementation == 'CPython' and python_version < '3.14'"
MACHINES = ("x86_64", "aarch64")
PROJECT = f"""[project]
name = "lock"
version = "0"
requires-python = ">=3.10,<3.14"
[tool.uv]
environments = ["{PLATFORM}"]
required-environments = {[f"{PLATFORM} and platform_machine == '{machine}'" for machine in MACHINES]}
"""
# True wherever the file is used.
_ALWAYS = re.compile(
    r"python_full_version < '3\.14'|platform_python_implementation == 'CPython'|sys_platform == 'linux'"
)


def resolved(names: tuple[str, ...]) -> str:
    """Return what uv finds for the files ``names``, with hashes; raises CalledProcessError."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "pyproject.toml").write_text(PROJECT, encoding="utf-8")
        command = [sys.executable, "-m", "uv", "pip", "compile", "--project", folder, "--universal", "--quiet"]
        command += ["--python-version", "3.10", "--generate-hashes", "--no-emit-index-url", "--no-header"]
        command += ["--no-annotate"]
        apart = next((options for name, options in APART.items() if GROUPS[name] == names), None)
        command += ["--constraint", str(REQUIREMENTS / "constraints.txt")] if apart is None else apart
        files = [str(REQUIREMENTS / f"{name}.txt") for name in names]
        return subprocess.run([*command, *files], check=True, stdout=subprocess.PIPE, text=True).stdout


def shortened(text: str) -> str:
    """Return ``text`` without the conditions that hold wherever it is read."""
    lines = []
    for whole in text.splitlines():
        pin, mark, condition = whole.partition(" ; ")
        line = whole
        if mark:
            end = " \\" if condition.endswith("\\") else ""
            left = [part for part in condition.removesuffix(end).split(" and ") if not _ALWAYS.fullmatch(part.strip())]
            line = pin + (f" ; {' and '.join(left)}" if left else "") + end
        lines.append(line)
    return "\n".join(lines) + "\n"


def main() -> int:
    """Write the locks, or say why not."""
    parser = argparse.ArgumentParser(prog="scripts/lib/lock.py", description=__doc__)
    parser.add_argument("--only", choices=sorted(GROUPS), help="one of the files")
    options = parser.parse_args()
    for name in [options.only] if options.only else GROUPS:
        try:
            text = resolved(GROUPS[name])
        except subprocess.CalledProcessError as error:
            print(
                f"lock: uv ended with exit code {error.returncode} (is it installed? pip install uv)", file=sys.stderr
            )
            return 2
        if "://" in text:
            print(f"lock: {name}.txt would hold an address, expected none", file=sys.stderr)
            return 2
        (REQUIREMENTS / f"{name}.txt").write_text(HEAD + shortened(text), encoding="utf-8")
        print(f"lock: requirements/{name}.txt: {len(re.findall('^[^ #]', text, re.MULTILINE))} versions")
    return 0


if __name__ == "__main__":
    sys.exit(main())
