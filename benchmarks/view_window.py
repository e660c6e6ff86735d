"""`glbump view` until its first picture is on the screen, and closed again: what bare_window.py is compared with.

python benchmarks/view_window.py SCENE.toml SIZE QUALITY.toml
"""

import sys

from glbump.cli import run
from glbump.viewer.window import Viewer


def until_seen(viewer: Viewer) -> None:
    """In place of `run`, which waits for somebody to close the window."""
    while not viewer.is_seen:
        viewer.step(0)
    viewer.stage.context.gl.finish()


setattr(Viewer, "run", until_seen)  # noqa: B010
sys.exit(run(["view", sys.argv[1], "--size", sys.argv[2], "--quality", sys.argv[3]]))
