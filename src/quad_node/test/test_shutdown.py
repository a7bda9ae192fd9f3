"""A process that hangs while it holds the interpreter's lock still ends, with its own exit code."""

import subprocess
import sys
import time

import pytest

HANG = """
import ctypes
from quad_node.shutdown import limited
with limited({code}, 1):
    ctypes.PyDLL(None).sleep({seconds})
print("left", flush=True)
import time
time.sleep(1.5)
raise SystemExit(7)
"""


@pytest.mark.parametrize("code", [0, 1])
def test_a_process_that_hangs_in_its_shutdown_ends_with_its_exit_code(code):
    began = time.monotonic()
    done = subprocess.run([sys.executable, "-c", HANG.format(code=code, seconds=30)], timeout=20, check=False)
    assert done.returncode == code
    assert time.monotonic() - began < 15.0


def test_a_process_that_shuts_down_in_time_goes_on():
    words = [sys.executable, "-c", HANG.format(code=0, seconds=0)]
    done = subprocess.run(words, timeout=20, check=False, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (7, "left\n")
