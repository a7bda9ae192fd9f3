#!/usr/bin/env python3
"""Make the CMake exports of the ROS wheels name this environment instead of the machine that built them.

The wheels carry ``/opt/python/cp312-cp312/...`` in the text files under ``share``. Each is rewritten once to
this interpreter's include folder, this environment's site-packages, or its prefix. Running it again changes nothing.
"""

import re
import sys
import sysconfig
from pathlib import Path

FOREIGN = re.compile(
    r"/opt/python/cp\d+-cp\d+t?(/include/python[\d.]+t?|/lib/python[\d.]+t?/site-packages)?(?=[^\w.-]|$)"
)


def mend(text: str, prefix: str, include: str, site_packages: str) -> str:
    """Return ``text`` with every path of a build machine replaced by the one that stands for it here."""

    def here(found: re.Match[str]) -> str:
        part = found.group(1) or ""
        if part.startswith("/include"):
            return include
        return site_packages if part else prefix

    return FOREIGN.sub(here, text)


def main() -> int:
    """Mend the environment of the running interpreter; 1 if a path of a build machine is left."""
    paths = sysconfig.get_paths()
    left = []
    for file in sorted(Path(sys.prefix, "share").rglob("*")):
        if not file.is_file() or (file.suffix != ".cmake" and file.parent.name != "parent_prefix_path"):
            continue
        text = file.read_text(encoding="utf-8")
        if "/opt/python/" not in text:
            continue
        mended = mend(text, sys.prefix, paths["include"], paths["purelib"])
        if mended != text:
            file.write_text(mended, encoding="utf-8")
        left += [f"{file}: {line.strip()}" for line in mended.splitlines() if "/opt/python/" in line]
    for line in left:
        print(f"mend_wheels: a path of the machine that built the wheel is left: {line}", file=sys.stderr)
    return 1 if left else 0


if __name__ == "__main__":
    sys.exit(main())
