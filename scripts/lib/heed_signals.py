"""Run a command for which no signal waits, whatever this process inherited: heed_signals.py COMMAND [ARGUMENT ...]."""

import os
import signal
import sys

# Python has answers of its own, SIGINT's a traceback, and ignores the others.
for number in (signal.SIGINT, signal.SIGPIPE, signal.SIGXFSZ):
    signal.signal(number, signal.SIG_DFL)
signal.pthread_sigmask(signal.SIG_SETMASK, ())
os.execv(sys.argv[1], sys.argv[1:])
