"""The libraries of the bridges to vehicles, fetched with their hashes when a test first asks for them."""

import fcntl
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LOCK, PACKAGES = ROOT / "requirements/vehicles/lock.txt", ROOT / ".cache" / "vehicle-packages"


def vehicle_packages() -> Path:
    """Return the folder that holds them; it is no part of the environment that flies."""
    PACKAGES.parent.mkdir(exist_ok=True)
    with PACKAGES.with_suffix(".busy").open("w") as busy:
        fcntl.flock(busy, fcntl.LOCK_EX)
        stamp = PACKAGES / f".lock-{sys.version_info.minor}"
        if not (stamp.is_file() and stamp.read_bytes() == LOCK.read_bytes()):
            shutil.rmtree(PACKAGES, ignore_errors=True)
            command = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-deps"]
            command += ["--require-hashes", "--only-binary", ":all:", "--target", PACKAGES, "--requirement", LOCK]
            subprocess.run(list(map(str, command)), check=True, timeout=300)
            stamp.write_bytes(LOCK.read_bytes())
    return PACKAGES
