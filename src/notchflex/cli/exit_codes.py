"""Exit codes of the command line."""

DONE = 0
NOT_CONVERGED = 1
BAD_INPUT = 2
INTERNAL_ERROR = 70  # EX_SOFTWARE of sysexits.h
INTERRUPTED = 130  # 128 + SIGINT, as shells expect
