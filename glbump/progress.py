"""A progress bar for what lasts over a second, on a terminal only."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

PATIENCE = 1.0  # seconds before anything is shown


@contextmanager
def progress(label: str, total: int | None = None, *, shown: bool = True) -> Iterator[Callable[[], None]]:
    """Yields a function to call after each of `total` steps; without `total` the bar only shows life.

    Drawn on standard error, after PATIENCE seconds, and wiped at the end. rich is imported only then.
    """
    if not (shown and sys.stderr.isatty()):
        yield lambda: None
        return
    done = 0
    over = threading.Event()

    def draw() -> None:
        if over.wait(PATIENCE):
            return
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

        columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
        with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
            task = bar.add_task(label, total=total)
            while not over.wait(0.1):
                bar.update(task, completed=done)

    def step() -> None:
        nonlocal done
        done += 1

    # A thread, because the steps themselves may last long and NumPy lets others run meanwhile.
    thread = threading.Thread(target=draw, daemon=True)
    thread.start()
    try:
        yield step
    finally:
        over.set()
        thread.join()
