"""Standard output: documents on it are UTF-8, and whoever reads it may go away.

Also what to do with a stream that can no longer be written: later text goes nowhere, so that the
rest of the work (files, warnings, the exit code) is done as if nobody had been listening.
"""

from __future__ import annotations

import os
import sys
from typing import TextIO


def write_document(text: str) -> None:
    """Write a document (JSON, CSV) to standard output, as UTF-8 whatever the terminal takes.

    A reader that has gone (`notchflex schema | head`) is not a failure.

    Args:
        text: What to write.
    """
    stream = sys.stdout
    try:
        stream.flush()
        buffer = getattr(stream, "buffer", None)
        if buffer is None:  # a StringIO in its place
            stream.write(text)
        else:
            buffer.write(text.encode("utf-8", errors="replace"))
        stream.flush()
    except BrokenPipeError:
        let_go(stream)


def let_go(stream: TextIO) -> None:
    """Send what a stream still holds, and all that is written to it later, nowhere.

    Python would otherwise complain once more when it flushes the stream at exit.

    Args:
        stream: Standard output or standard error.
    """
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)
