"""scripts/setup and scripts/env.sh refuse at once what would be mixed up or ignored; nothing is built here."""

import os
import re
import shutil
import signal
import subprocess
import sys
import time

import pytest
import yaml
from flying import ROOT

pytestmark = pytest.mark.unit

QUICK = 5.0  # s; about 0.1 s on an idle machine


@pytest.fixture
def checkout(tmp_path):
    """Return a folder with what scripts/setup reads before it builds anything."""
    top = tmp_path / "here"
    for name in ("scripts", "requirements"):
        shutil.copytree(ROOT / name, top / name)
    package = top / "src" / "some"
    (package / "msg").mkdir(parents=True)
    (package / "srv").mkdir()
    for name in ("package.xml", "setup.py", "setup.cfg", "CMakeLists.txt", "msg/Some.msg", "srv/Some.srv"):
        (package / name).touch()
    return top


@pytest.fixture
def other(tmp_path):
    """Return another checkout that was set up, as its environment names it."""
    install = tmp_path / "there" / "install"
    (install / "quad_core").mkdir(parents=True)
    (install / "env.bash").touch()
    (install / ".quad").touch()
    return tmp_path / "there"


def run(words, **environment):
    """Run ``words`` in a shell that has sourced nothing; returns exit code, what it complained of, seconds."""
    clean = {"PATH": "/usr/local/bin:/usr/bin:/bin", "HOME": os.environ["HOME"], **environment}
    began = time.monotonic()
    done = subprocess.run(words, capture_output=True, text=True, env=clean, timeout=60, check=False)
    return done.returncode, done.stderr, time.monotonic() - began


@pytest.mark.parametrize("name", ["python9", "/no/such/python", "false"])
def test_a_python_that_does_not_run_is_refused(checkout, name):
    code, said, seconds = run([checkout / "scripts/setup"], PYTHON=name)
    assert (code, "PYTHON" in said, name in said) == (2, True, True), said
    assert seconds < QUICK


def test_a_set_up_needs_no_home(checkout):
    words = ["env", "-i", "PATH=/usr/bin:/bin", "PYTHON=python9", checkout / "scripts/setup"]
    code, said, _ = run(words)
    assert (code, "unbound" in said, "python9" in said) == (2, False, True), said
    script = (checkout / "scripts/setup").read_text(encoding="utf-8")
    assert "$HOME" not in script


@pytest.mark.parametrize("sourced", [False, True])
def test_a_computer_without_ros_wheels_is_told_to_source_ros(checkout, tmp_path, sourced):
    (tmp_path / "bin").mkdir()
    uname = tmp_path / "bin" / "uname"
    uname.write_text("#!/bin/sh\necho aarch64\n", encoding="utf-8")
    uname.chmod(0o755)
    ros = tmp_path / "ros" / "share" / "rclpy"
    ros.mkdir(parents=True)
    (ros / "package.xml").touch()
    more = {"AMENT_PREFIX_PATH": str(tmp_path / "ros"), "ROS_DISTRO": "jazzy"} if sourced else {}
    code, said, _ = run([checkout / "scripts/setup"], PATH=f"{tmp_path / 'bin'}:/usr/bin:/bin", PYTHON="false", **more)
    assert (code, "of kind aarch64" in said, "PYTHON" in said) == (2, not sourced, sourced), said


@pytest.mark.parametrize("where", ["scripts/setup", "scripts/fly"])
def test_another_checkout_s_environment_is_named_at_once(checkout, other, where):
    code, said, seconds = run([checkout / where], AMENT_PREFIX_PATH=f"{other}/install/quad_core:{other}/.venv")
    assert code == 2
    assert f"another checkout ({other})" in said
    assert str(checkout) in said
    assert seconds < QUICK


def test_env_refuses_a_shell_with_another_checkout_s_environment(checkout, other):
    (checkout / "install").mkdir()
    (checkout / "install" / "env.bash").write_text("QUAD_ROS=\n", encoding="utf-8")
    words = ["bash", "-c", 'source "$0"; echo "code $?, ${VIRTUAL_ENV:-none}" >&2', str(checkout / "scripts/env.sh")]
    _, said, seconds = run(words, AMENT_PREFIX_PATH=f"{other}/install/quad_core")
    assert "code 2, none" in said
    assert f"another checkout ({other})" in said
    assert seconds < QUICK


def test_ctrl_c_ends_a_set_up_that_a_flight_began(checkout, tmp_path):
    """For scripts/fly signals wait, but not for minutes."""
    python = tmp_path / "python"
    python.write_text(
        f"""#!/bin/sh
case "$*" in
    -m\\ venv*) : >{tmp_path}/began; exec sleep 60 ;;
    *sys.executable\\)*) echo "$0" ;;
    *) exec {sys.executable} "$@" ;;
esac
""",
        encoding="utf-8",
    )
    python.chmod(0o755)
    environment = {"PATH": os.environ["PATH"], "HOME": os.environ["HOME"], "PYTHON": str(python)}
    flight = subprocess.Popen(
        [checkout / "scripts/fly"], stderr=subprocess.PIPE, text=True, env=environment, start_new_session=True
    )
    while not (tmp_path / "began").exists():
        assert flight.poll() is None, flight.communicate()
    os.killpg(flight.pid, signal.SIGINT)
    _, said = flight.communicate(timeout=10)
    assert (flight.returncode, said.splitlines()[-1]) == (1, "fly: interrupted before the flight")


def test_a_package_that_lost_a_message_is_told_from_one_that_changed(checkout):
    script = (checkout / "scripts/setup").read_text(encoding="utf-8")
    function = script[script.index("packages_with_losses() {") : script.index("# What sourcing install/")]
    (checkout / "install").mkdir()
    (checkout / "install/.quad").write_text("1  src/some/msg/Some.msg\n2  src/some/setup.py\n3  src/other/setup.py\n")
    kept = "1  src/some/msg/Some.msg\n4  src/some/setup.py\n"
    for build, lost in ((f"{kept}3  src/other/setup.py", []), (kept, ["other"]), ("3  src/other/setup.py", ["some"])):
        script = f"cd {checkout}; build=$0; {function}\npackages_with_losses >&2"
        _, said, _ = run(["bash", "-c", script, build])
        assert said.split() == lost


def test_a_copied_environment_is_told_from_one_made_here(checkout, tmp_path):
    """A copy runs, but the first line of its pip names the place that it was copied from."""
    made = tmp_path / "made"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(made)], check=True, timeout=120)
    (made / "bin" / "pip").write_text(f"#!{made}/bin/python\n", encoding="utf-8")
    shutil.copytree(made, checkout / ".venv", symlinks=True)
    script = (checkout / "scripts/setup").read_text(encoding="utf-8")
    functions = script[script.index("# Where an environment is") : script.index("make_environment() {")]
    for where, usable in ((made, True), (checkout / ".venv", False)):
        code, said, _ = run(["bash", "-c", f'set -uo pipefail; {functions}\nis_usable "$0"', str(where)])
        assert (code == 0) == usable, said


def test_no_file_of_requirements_names_an_address_and_every_locked_version_has_a_hash():
    for path in sorted((ROOT / "requirements").rglob("*.txt")):
        text = path.read_text(encoding="utf-8")
        assert "://" not in text, path.name
        if path.name.startswith("lock"):
            pins = text.replace(" \\\n", " ").splitlines()
            bare = [line for line in pins if "==" in line and "--hash=sha256:" not in line]
            assert not bare


def test_locks_are_those_of_the_versions_that_were_tested():
    """Every version of constraints.txt that serves a Python stands in lock.txt for it."""
    lock = (ROOT / "requirements/lock.txt").read_text(encoding="utf-8").lower()
    for line in (ROOT / "requirements/constraints.txt").read_text(encoding="utf-8").splitlines():
        name, _, rest = line.partition("==")
        if rest and f"\n{name.lower().replace('_', '-').replace('.', '-')}==" in lock:
            version = rest.split(";")[0].strip()
            assert f"\n{name.lower().replace('_', '-').replace('.', '-')}=={version} " in lock, line


@pytest.mark.parametrize("name", ["slow.py", "slow"])
def test_ctrl_c_while_a_tool_imports_shows_no_traceback(tmp_path, name):
    program = "import time\nprint('up', flush=True)\nwhile True:\n    time.sleep(0.1)\n"
    (tmp_path / "slow.py").write_text(program, encoding="utf-8")
    words = ["bash", "-c", 'trap "" INT; exec "$@"', "-", sys.executable, ROOT / "scripts/lib/tool.py", name]
    tool = subprocess.Popen(words, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    assert tool.stdout.readline() == "up\n"
    tool.send_signal(signal.SIGINT)
    assert (tool.communicate(timeout=30)[0], tool.returncode) == ("", -signal.SIGINT)


def test_fly_by_hand_explains_itself_and_refuses_unknown_words():
    code, said, _ = run([ROOT / "scripts/fly_by_hand.sh", "--help"])
    assert (code, said) == (0, "")
    code, said, _ = run([ROOT / "scripts/fly_by_hand.sh", "--nonsense"])
    assert (code, len(said.splitlines())) == (2, 1), said
    assert "--nonsense" in said


def test_the_workflow_s_matrix_is_the_pythons_that_set_up_takes():
    text = (ROOT / "scripts/setup").read_text(encoding="utf-8")
    tried = re.search(r"for version in \$\{ros:\+3\} ([\d. ]+);", text)[1].split()
    workflow = yaml.safe_load((ROOT / ".github/workflows/test.yml").read_text(encoding="utf-8"))
    assert workflow["jobs"]["test"]["strategy"]["matrix"]["python"] == sorted(tried)
    assert [step["run"] for step in workflow["jobs"]["test"]["steps"] if "run" in step] == [".ci/run"]
