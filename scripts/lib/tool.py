"""Run a program so that Ctrl-C shows no traceback, also while it imports: tool.py MODULE|FILE [ARGUMENT ...]."""

import runpy
import signal
import sys
from types import TracebackType


def _show(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
    if not issubclass(kind, KeyboardInterrupt):
        sys.__excepthook__(kind, error, trace)


sys.excepthook = _show
signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored until here, as Python itself started
del sys.argv[0]
if sys.argv[0].endswith(".py"):
    sys.path[0] = sys.argv[0].rpartition("/")[0] or "."
    runpy.run_path(sys.argv[0], run_name="__main__")
else:
    sys.path[0] = ""
    runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)
