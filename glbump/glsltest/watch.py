"""Stops a process whose GLSL call does not come back, and says what was running.

Nothing inside the process can: the driver holds the interpreter meanwhile. So a second process looks on, through
a page of shared memory that says since when what has been running.
"""

from __future__ import annotations

import contextlib
import mmap
import os
import signal
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

_PAGE = 4096
_HEAD = struct.Struct("dI")  # seconds since the epoch (0: nothing runs), length of the label


class Watch:
    """Watches the calls of this process; each may last `seconds`."""

    def __init__(self, seconds: float) -> None:
        handle, self._path = tempfile.mkstemp(prefix="glbump-watch-")
        os.ftruncate(handle, _PAGE)
        self._page = mmap.mmap(handle, _PAGE)
        os.close(handle)
        command = [sys.executable, "-I", "-S", __file__, self._path, str(seconds), str(os.getpid())]
        self._looker = subprocess.Popen(command)
        self._label = ""

    def begin(self, label: str) -> None:
        """Something starts to run."""
        if label != self._label:
            data = label.encode()[: _PAGE - _HEAD.size]
            self._page[_HEAD.size : _HEAD.size + len(data)] = data
            self._label = label
        _HEAD.pack_into(self._page, 0, time.time(), min(len(label.encode()), _PAGE - _HEAD.size))

    def end(self) -> None:
        """It came back."""
        _HEAD.pack_into(self._page, 0, 0.0, 0)

    def close(self) -> None:
        """Watch no more."""
        self._looker.terminate()
        self._looker.wait()
        self._page.close()
        Path(self._path).unlink(missing_ok=True)


def look(path: str, seconds: float, watched: int) -> None:
    """Look on until process `watched` is gone; end it when a call of its lasts too long."""
    with Path(path).open("r+b") as file:
        page = mmap.mmap(file.fileno(), _PAGE)
    with contextlib.suppress(OSError):  # the mapping stays; Windows keeps the file, and `close` removes it
        Path(path).unlink()
    while os.getppid() == watched:
        time.sleep(min(0.5, seconds / 4))
        since, length = _HEAD.unpack_from(page, 0)
        if since and time.time() - since > seconds:
            label = page[_HEAD.size : _HEAD.size + length].decode(errors="replace")
            said = f"\nglsl: {label}: still running after {seconds:g} s; stopped (--glsl-timeout)\n"
            os.write(2, said.encode())
            # An abort lets Python's faulthandler, which pytest switches on, print where the call came from.
            os.kill(watched, signal.SIGABRT)
            time.sleep(2.0)
            with contextlib.suppress(ProcessLookupError):
                os.kill(watched, getattr(signal, "SIGKILL", signal.SIGTERM))
            return


if __name__ == "__main__":
    look(sys.argv[1], float(sys.argv[2]), int(sys.argv[3]))
