"""ARM64 by emulation: unit tests and digests of flights under qemu-user with Debian's libraries, beside this machine's.

Needs ``qemu-aarch64`` (Debian: qemu-user), ``apt-get`` and ``dpkg-deb``. Nothing of ROS is emulated: it has no wheels
for ARM64. Kept in .cache/arm64 for the next time.
"""

import os
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
CACHE = ROOT / ".cache" / "arm64"
PYTHON = "3.11"
DEBS = """
python3.11-minimal libpython3.11-minimal libpython3.11-stdlib libc6 libgcc-s1 libstdc++6 gcc-12-base zlib1g libexpat1
libffi8 libssl3 libbz2-1.0 liblzma5 libsqlite3-0 libuuid1 libcrypt1 libreadline8 libtinfo6 libncursesw6 libdb5.3
libzstd1 media-types
"""
GLIBCS = ("trixie", "sid")
KEYRING = "/usr/share/keyrings/debian-archive-keyring.gpg"
WHEELS = """
hypothesis iniconfig llvmlite lz4 mcap mpmath numba numpy packaging pluggy pygments pytest pytest-timeout
pyyaml scipy sortedcontainers sympy zstandard pandas python-dateutil pytz tzdata six pyarrow
"""
PACKAGES = ("quad_core", "quad_dynamics", "quad_trajectory", "quad_position_ctrl", "quad_attitude_ctrl", "quad_guard")
TESTS = [f"src/{package}/test" for package in PACKAGES]
EVERY_PLANT = "test_every_installed_plugin_is_complete_and_its_defaults_and_presets_are_in_range[quad.plant]"
MUJOCO = ("--deselect", f"src/quad_core/test/test_plugins.py::{EVERY_PLANT}")
COMPILING = [  # Numba takes some twenty times as long here
    *(f"src/quad_core/test/test_{name}.py" for name in ("compilation", "records", "types", "prediction_of_laws")),
    "src/quad_dynamics/test/test_plants_compiled.py",
    "src/quad_guard/test/test_guard_compiled.py",
    "src/quad_trajectory/test/test_trajectory_numba.py",
]


def run(figures):
    for tool in ("qemu-aarch64", "apt-get", "dpkg-deb"):
        if shutil.which(tool) is None:
            raise SystemExit(f"arm64: found no {tool}, expected it (Debian: apt install qemu-user)")
    began = time.monotonic()
    system()
    wheels()
    figures.show(f"system and packages for ARM64: {time.monotonic() - began:.0f} s")
    for line in python("-c", "import platform as p, numpy, numba; print(p.machine(), p.libc_ver(), numba.__version__)"):
        figures.show(line)
        figures.check("aarch64" in line, "the emulated machine is an aarch64")
    for name, options in (
        ("short flights, plain", ()),
        ("whole cases, plain", ("--whole",)),
        ("one short flight, compiled", ("--compiled", "--only", "^case2$")),
    ):
        if figures.wants(name):
            digests(figures, name, options)
    for release in GLIBCS:
        if figures.wants("other glibc"):
            root = with_glibc(release)
            version = next(iter(python("-c", "import os; print(os.confstr('CS_GNU_LIBC_VERSION'))", root=root)))
            digests(figures, f"other glibc, {version} of Debian {release}", (), root=root)
    if figures.wants("unit tests, plain"):
        figures.show(f"not run, for MuJoCo starts a process when it is imported: {MUJOCO[1]}")
        unit_tests(figures, "unit tests, plain", *TESTS, *(f"--ignore={path}" for path in COMPILING))
    if figures.wants("unit tests, compiled"):
        unit_tests(figures, "unit tests, compiled", *COMPILING)
    if figures.wants("whole lock"):
        whole_lock(figures)


def digests(figures, name, options, root="root"):
    began = time.monotonic()
    told = [line for line in python("test/digests.py", *options, root=root) if line.startswith(("ok  ", "FAIL"))]
    for line in told:
        figures.check(line.startswith("ok"), f"{name}: {line[5:]}")
    figures.check(bool(told), f"{name}: {len(told)} flights flown")
    figures.show(f"{name}: {time.monotonic() - began:.0f} s under emulation")


def unit_tests(figures, name, *chosen):
    """Run unit tests under emulation; their limit of time is for this machine's own speed."""
    began, last = time.monotonic(), "no test ran"
    options = "-o timeout=0 -p no:cacheprovider -c pyproject.toml --ignore-glob=*_node.py"
    for line in python("-m", "pytest", "-q", *options.split(), "-m", "not ros and not wall_clock", *MUJOCO, *chosen):
        if line.startswith(("FAILED", "ERROR")) or line.endswith("%]"):
            figures.show(line)
        last = line if re.search(r"\d+ passed", line) else last
    figures.check("failed" not in last and "error" not in last and "passed" in last, f"{name}: {last}")
    figures.show(f"{name}: {time.monotonic() - began:.0f} s under emulation")


def python(*words, root="root"):
    """Yield the lines of ARM64's Python under emulation, run in the checkout with the packages of src."""
    system = CACHE / root
    paths = [str(CACHE / "wheels"), *(path for path in os.environ["PYTHONPATH"].split(os.pathsep) if "/build/" in path)]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT / "test"), *paths])}
    for name in ("LD_LIBRARY_PATH", "AMENT_PREFIX_PATH"):
        environment.pop(name, None)
    environment["PYTHONHOME"] = str(system / "usr")
    command = ["qemu-aarch64", "-L", str(system), str(system / "usr/bin" / f"python{PYTHON}"), *words]
    with subprocess.Popen(command, cwd=ROOT, env=environment, stdout=subprocess.PIPE, text=True) as process:
        for line in process.stdout:
            yield line.rstrip()


def system():
    """Unpack Debian's ARM64 Python and its libraries to .cache/arm64/root, unless they are there."""
    unpacked("root", DEBS.split(), ())


def with_glibc(release):
    """Return the folder of the same system with the C library of another release of Debian."""
    address = next(
        line.split()[0]
        for line in said("apt-get", "indextargets", "--format", "$(REPO_URI) $(CODENAME)", "Created-By: Packages")
        if "security" not in line and "debian" in line
    )
    sources = CACHE / f"{release}.list"
    sources.write_text(f"deb [signed-by={KEYRING}] {address} {release} main\n")
    unpacked(release, ["libc6"], ("-o", f"Dir::Etc::sourcelist={sources}", "-o", "Dir::Etc::sourceparts=-"))
    return release


def unpacked(name, packages, sources):
    """Download ARM64 packages and unpack them to .cache/arm64/NAME, over a copy of root, unless it is there."""
    root, apt, debs = CACHE / name, CACHE / f"apt-{name}", CACHE / f"debs-{name}"
    if (root / "done").exists():
        return
    for folder in (apt / "status.d", apt / "lists/partial", apt / "cache/archives/partial", debs):
        folder.mkdir(parents=True, exist_ok=True)
    (apt / "status").touch()
    options = [
        *("-o", "APT::Architecture=arm64", "-o", "APT::Architectures=arm64", "-o", f"Dir::State={apt}"),
        *("-o", f"Dir::State::status={apt / 'status'}", "-o", f"Dir::Cache={apt / 'cache'}"),
        *("-o", "APT::Sandbox::User=root", *sources),
    ]
    logged("apt-get", *options, "update", cwd=CACHE)
    logged("apt-get", *options, "download", *packages, cwd=debs)
    shutil.rmtree(root, ignore_errors=True)
    if name != "root":
        shutil.copytree(CACHE / "root", root, symlinks=True)
        (root / "lib").unlink()
    for deb in sorted(debs.glob("*.deb")):
        logged("dpkg-deb", "-x", str(deb), str(root), cwd=CACHE)
    if (root / "lib").is_dir():  # one folder of libraries, as newer releases have it
        shutil.copytree(root / "lib", root / "usr/lib", symlinks=True, dirs_exist_ok=True)
        shutil.rmtree(root / "lib")
    (root / "lib").symlink_to("usr/lib")
    (root / "done").touch()


def wheels():
    """Install ARM64's wheels of the lock to .cache/arm64/wheels, unless they are there."""
    target, chosen = CACHE / "wheels", "".join(pin for name, pin in pins().items() if name in WHEELS.split())
    stamp = CACHE / "wheels.txt"
    if stamp.exists() and stamp.read_text() == chosen:
        return
    shutil.rmtree(target, ignore_errors=True)
    (CACHE / "asked.txt").write_text(chosen)
    logged(*pip("install", "--target", str(target)), cwd=CACHE)
    stamp.write_text(chosen)


def pip(*words):
    """Return the command that takes what .cache/arm64/asked.txt names, as wheels for ARM64 alone."""
    tags = ["manylinux2014_aarch64", *(f"manylinux_2_{n}_aarch64" for n in (17, 24, 26, 27, 28, 31, 34))]
    platforms = [word for tag in tags for word in ("--platform", tag)]
    own = ["--no-deps", "--require-hashes", "--only-binary", ":all:"]
    own += ["--python-version", PYTHON, "--implementation", "cp"]
    return [sys.executable, "-m", "pip", *words, *own, *platforms, "-r", str(CACHE / "asked.txt")]


def whole_lock(figures):
    """Show for which versions of the lock there is no wheel for ARM64."""
    found = pins()
    missing = []
    for name, pin in found.items():
        (CACHE / "asked.txt").write_text(pin)
        words = pip("download", "--dest", str(CACHE / "downloads"))
        done = subprocess.run(words, cwd=CACHE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
        missing += [name] if done.returncode else []
    figures.show(
        f"wheels for ARM64: {len(found) - len(missing)} of {len(found)} versions of the lock beside those of ROS"
    )
    figures.show(f"no wheel, built by pip from source: {', '.join(missing) or 'none'}")
    shutil.rmtree(CACHE / "downloads", ignore_errors=True)


def pins():
    """Return {name: its lines} of the lock for Python 3.11 on ARM64, without conditions."""
    text = (ROOT / "requirements/lock.txt").read_text(encoding="utf-8")
    found = {}
    for pin in re.split(r"(?m)^(?=[a-z])", text):
        name = re.split("[= ;]", pin)[0].lower()
        if "==" in pin and "platform_machine == 'x86_64' \\" not in pin and python_fits(pin):
            found[name] = re.sub(r" ; [^\\\n]*", " ", pin)
    return found


def python_fits(pin):
    """Return whether a pin of the lock is for Python 3.11."""
    condition = re.search(r"python_full_version ([<>=]+) '(3\.\d+)'", pin.partition("\\")[0])
    if condition is None:
        return True
    bound, ours = (int(text.split(".")[1]) for text in (condition[2], PYTHON))
    return {"<": ours < bound, ">=": ours >= bound, "==": ours == bound}[condition[1]]


def said(*words):
    """Return the lines that a command prints."""
    return subprocess.run(words, stdout=subprocess.PIPE, text=True, check=True).stdout.splitlines()


def logged(*words, cwd):
    """Run a command, show its output only if it fails."""
    done = subprocess.run(words, cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    if done.returncode:
        raise SystemExit(f"arm64: {' '.join(words[:3])} ended with exit code {done.returncode}:\n{done.stdout[-2000:]}")
