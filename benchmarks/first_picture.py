"""From the start of the process to the picture on the disk."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path

from benchmarks.figures import Cell, Section, Table, Target
from benchmarks.scenes import DATA, evening, mirror_ball
from glbump.environment import LatLong
from glbump.image import ArrayImage
from glbump.maps.images import write_picture
from glbump.quality import Quality
from glbump.scenefile import save_scene
from glbump.trade.timing import Call, in_turns, ratios, spread

LIMIT = 1.5
BARE = Path(__file__).with_name("bare_picture.py")


def glbump() -> list[str]:
    """What runs glbump's command: the installed script, as a user does, or else the module."""
    script = Path(sys.executable).with_name("glbump")
    return [str(script)] if script.is_file() else [sys.executable, "-m", "glbump"]


def commands(folder: Path, size: int) -> dict[str, list[str]]:
    """Command lines by name; each draws the mirror ball into `folder`. The scene file is written there."""
    path = DATA / "openexr" / "KernerEnvLatLong.exr"
    if not path.is_file():
        path = folder / "evening.exr"
        picture = evening().image
        assert isinstance(picture, ArrayImage)
        write_picture(path, picture.pixels.astype("f2"))
    scene = folder / "ball.toml"
    # Beside the scene file, as a user's would be.
    (folder / "environment.exr").write_bytes(path.read_bytes())
    save_scene(mirror_ball(LatLong(folder / "environment.exr")), scene)
    made: dict[str, list[str]] = {}
    for quality in ("fast", "balanced"):
        knobs = Quality(quality)
        how = map(str, (size, knobs.samples, int(knobs.environment_filter == "trilinear")))
        bare = [sys.executable, str(BARE), str(folder / "environment.exr"), str(folder / f"bare-{quality}.png"), *how]
        ours = ["-q", "-o", str(folder / f"{quality}.png"), "--size", f"{size}x{size}", "--quality", quality]
        made |= {f"bare, {quality}": bare, quality: [*glbump(), "render", str(scene), *ours]}
    made["Python, NumPy and moderngl"] = [sys.executable, "-c", "import numpy, moderngl"]
    return made


def children_cpu() -> float:
    """CPU seconds of all processes that this one has waited for."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def run(line: list[str], folder: Path) -> None:
    """One command line. Modules are compiled once, as after an installation, whatever the caller's settings."""
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    environment["PYTHONPYCACHEPREFIX"] = str(folder / "compiled")
    subprocess.run(line, check=True, stdout=subprocess.DEVNULL, cwd=folder, env=environment)


def measure(quick: bool = False) -> Section:
    """512x512 (quick: 64x64), fast and balanced, warm caches."""
    size, turns = (64, 1) if quick else (512, 15)
    with tempfile.TemporaryDirectory(prefix="glbump-") as name:
        folder = Path(name)
        calls: dict[str, Call] = {what: partial(run, line, folder) for what, line in commands(folder, size).items()}
        times = in_turns(calls, turns, warm_up=1, cpu=children_cpu)
    rows: list[list[Cell]] = []
    targets = []
    for quality in ("fast", "balanced"):
        base = times[f"bare, {quality}"]
        wall, cpu = ratios(times[quality].wall, base.wall), ratios(times[quality].cpu, base.cpu)
        ours, bare = spread(times[quality].wall).median, spread(base.wall).median
        rows.append([quality, str(wall), str(cpu), ours, bare])
        targets.append(Target.at_most(f"{quality}, wall clock", wall.median, LIMIT, " times"))
        targets.append(Target.at_most(f"{quality}, CPU time", cpu.median, LIMIT, " times"))
    rows.append(["imports alone", "", "", None, spread(times["Python, NumPy and moderngl"].wall).median])
    return Section(
        "First picture",
        f"`glbump render` of a mirror ball in a lat-long EXR, {size}x{size}, from the start of the process to the PNG "
        "on disk, against a bare script (benchmarks/bare_picture.py) that imports numpy, moderngl and OpenImageIO, "
        "opens the context with the driver's names given, reads the same EXR, draws as many samples a pixel with the "
        "same filter, ball and sky in one triangle and one shader, encodes in a shader and saves. Disk and shader "
        "caches warm.",
        (Table(("quality", "wall clock", "CPU time", "glbump, s", "bare, s"), rows),),
        targets,
    )


if __name__ == "__main__":
    from benchmarks.command import alone

    alone(measure)
