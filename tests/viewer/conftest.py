"""A display of the tests' own, and a process in which windows are opened: one process has one backend."""

from __future__ import annotations

import multiprocessing
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import pytest

from .driving import begin, carry_out


@pytest.fixture(scope="session")
def display() -> Iterator[str]:
    """The name of an X display without a screen."""
    if not shutil.which("Xvfb"):
        pytest.skip("no Xvfb, which gives a display")
    ours, theirs = os.pipe()
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", str(theirs), "-screen", "0", "1600x1200x24", "-nolisten", "tcp"],
        pass_fds=[theirs],
        stderr=subprocess.DEVNULL,
    )
    os.close(theirs)
    try:
        with os.fdopen(ours) as told:
            number = told.readline().strip()
        assert number, "Xvfb did not start"
        yield f":{number}"
    finally:
        server.terminate()
        server.wait(10)


@pytest.fixture(scope="session")
def windowed(display: str) -> Iterator[Callable[[str, str, Path], None]]:
    """Carries out a check, by its module and name, in a process that has the display."""
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, spawn, begin, (display, sys.path)) as pool:
        # An hour of random input (GLBUMP_SOAK) takes an hour.
        limit = 120 + float(os.environ.get("GLBUMP_SOAK", "0"))
        yield lambda module, name, folder: pool.submit(carry_out, module, name, folder).result(limit)
