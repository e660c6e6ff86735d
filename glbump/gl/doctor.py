"""What OpenGL there is here: every way tried in a process of its own, so that no driver can take this one down."""

from __future__ import annotations

import json
import os
import platform
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Any

Report = dict[str, Any]

# What changes which driver is found, or how it behaves.
VARIABLES = """
GLBUMP_BACKEND GLBUMP_DEVICE DISPLAY WAYLAND_DISPLAY XDG_SESSION_TYPE LIBGL_ALWAYS_SOFTWARE GALLIUM_DRIVER
MESA_LOADER_DRIVER_OVERRIDE MESA_GL_VERSION_OVERRIDE EGL_PLATFORM __EGL_VENDOR_LIBRARY_FILENAMES
__EGL_VENDOR_LIBRARY_DIRS __GLX_VENDOR_LIBRARY_NAME NVIDIA_DRIVER_CAPABILITIES NVIDIA_VISIBLE_DEVICES
CUDA_VISIBLE_DEVICES LP_NUM_THREADS GALLIVM_PERF LD_LIBRARY_PATH PYGLFW_LIBRARY
"""
NO_ANSWER = "run `glbump doctor` again with LIBGL_ALWAYS_SOFTWARE=1; if that helps, the graphics driver is at fault"
NO_RIGHT = "you may not open it: add yourself to its group (usermod -aG render,video), or start as one who may"
ONE_THREAD = "LP_NUM_THREADS=1: Mesa frees what this thread still writes to, and may crash; unset it, or set it to 0"
NOT_OFFERED = "no driver offers it to EGL: install its driver; in a container NVIDIA_DRIVER_CAPABILITIES=graphics"


def report(*, time_limit: float = 60.0) -> Report:
    """What there is, as plain data that JSON can hold; it never raises for what a driver does.

    routes: every way, in the order "auto" tries them, then the window; each with route, backend, library, ok, and
    either info, is_software, seconds (to open it) and probes (of gl/probe.py), or error and mend. chosen: the route
    that `open_context()` takes in this environment; None, with the reason in chosen_error, where there is none.
    texturing: ok, and what gl/texturing.py found there, or error. A process that takes longer than `time_limit`
    seconds counts as hung. gpus: device files, and whether they open.
    """
    listed = _ask("list", limit=time_limit)
    egl = listed.get("routes", [{"route": "egl", "backend": "egl", "library": "libEGL.so.1"} | listed])
    routes = [
        *egl,
        {"route": "osmesa", "backend": "osmesa", "library": "libOSMesa"},
        {"route": "window", "backend": "window", "library": "glfw"},
    ]
    tries = [("try", route["backend"], route["route"]) for route in routes if "error" not in route]
    questions: list[tuple[str, ...]] = [("choose",), ("texturing",), *tries]
    # Two at a time: each compiles shaders for a while, or hangs.
    with ThreadPoolExecutor(2) as pool:
        chosen, texturing, *answers = pool.map(lambda question: _ask(*question, limit=time_limit), questions)
    answered = iter(answers)
    return {
        "glbump": version("glbump"),
        "moderngl": version("moderngl"),
        "python": platform.python_version(),
        "platform": platform.platform(),
        "environment": {name: os.environ[name] for name in VARIABLES.split() if name in os.environ},
        "gpus": _gpus(),
        "chosen": chosen.get("route"),
        "chosen_error": chosen.get("error"),
        "texturing": texturing,
        "routes": [route if "error" in route else route | next(answered) for route in routes],
    }


def healthy(report: Report) -> bool:
    """Whether `open_context()`, as this environment has it, finds an OpenGL."""
    return report["chosen"] is not None


def advice(report: Report) -> list[str]:
    """What to do, most urgent first; nothing where there is nothing to do."""
    working = [route for route in report["routes"] if route["ok"]]
    failed = [route for route in report["routes"] if not route["ok"]]
    chosen = next((route for route in working if route["route"] == report["chosen"]), None)
    if chosen is None:
        if working and "GLBUMP_BACKEND" in report["environment"]:
            return [f"unset GLBUMP_BACKEND, or set it to {working[0]['backend']}, which works here"]
        return _mends(failed)
    if not chosen["is_software"]:
        return []
    lines = _mends([route for route in failed if "hardware" in route["route"]])
    if not any("hardware" in route["route"] for route in report["routes"]):
        lines += [f"{gpu}: {NOT_OFFERED if opens else NO_RIGHT}" for gpu, opens in report["gpus"].items()]
    if report["environment"].get("LP_NUM_THREADS") == "1" and "llvmpipe" in chosen["info"]["renderer"]:
        lines.append(ONE_THREAD)
    return lines


def _mends(failed: list[Report]) -> list[str]:
    """What would mend these routes, each thing once, with the routes it is good for."""
    mends: dict[str, list[str]] = {}
    for route in failed:
        mends.setdefault(route["mend"], []).append(route["route"])
    return [f"for {' and '.join(routes)}: {mend}" for mend, routes in mends.items()]


def _gpus() -> dict[str, bool]:
    """Device files of graphics processors, and whether this user may open them."""
    files = sorted((*Path("/dev").glob("nvidia[0-9]*"), *Path("/dev/dri").glob("renderD*")))
    return {str(file): os.access(file, os.R_OK | os.W_OK) for file in files}


def text(report: Report) -> str:
    """The report for people, in plain lines."""
    return "\n".join(_lines(report))


def _lines(report: Report) -> Iterator[str]:
    names = ("glbump", "moderngl", "python")
    yield ", ".join([*(f"{name} {report[name]}" for name in names), report["platform"]])
    yield from (f"{name}={value}" for name, value in report["environment"].items())
    yield ""
    if report["chosen"]:
        yield f"glbump draws with {report['chosen']}"
    else:
        # The table that follows in the message is the list below.
        yield f"glbump draws with nothing: {report['chosen_error'].splitlines()[0].removesuffix('; tried:')}"
    wide = max(len(route["route"]) for route in report["routes"])
    for route in report["routes"]:
        if route["ok"]:
            info = route["info"]
            yield f"  {route['route']:<{wide}}  works: {info['renderer']}, OpenGL {info['version']}"
        else:
            yield f"  {route['route']:<{wide}}  fails: {route['error']}"
    for route in report["routes"]:
        if route["ok"] and route["route"] == report["chosen"]:
            yield ""
            yield from _findings(route)
            yield from _looks(report["texturing"])
    steps = advice(report)
    if steps:
        yield ""
        yield "What to do:"
        yield from (f"  {step}" for step in steps)


def _findings(route: Report) -> Iterator[str]:
    info, probes = route["info"], route["probes"]
    yield f"{info['renderer']} ({info['vendor']}), opened in {route['seconds'] * 1000:.0f} ms"
    yield (
        f"  limits: textures {info['max_texture_size']}, cube faces {info['max_cube_size']}, "
        f"{info['max_texture_units']} textures at once, {info['max_samples']} samples, "
        f"anisotropy {info['max_anisotropy']:g}"
    )
    weights = ", ".join(
        f"{name} {found['levels']} levels" for name, found in probes["filter_weights"].items() if name != "meaning"
    )
    nans = ", ".join(str(count) for count in probes["nan_in_mips"]["nan_per_level"])
    lod, mips, edges = (probes[name] for name in ("level_of_detail", "odd_mips", "cube_edges"))
    limits = ", ".join(f"{limit}: {level:.2f}" for limit, level in probes["anisotropy"]["levels"].items())
    shares = " ".join(f"{weight:.2f}" for weight in mips["weights"])
    figures = {
        "filter_weights": f"{weights} (over 4096 places)",
        "level_of_detail": f"error {lod['min_error']:+.3f} to {lod['max_error']:+.3f}",
        "anisotropy": f"level taken for a 16 x 1 footprint, by limit: {limits}",
        "odd_mips": f"7 -> 3 -> 1 weighs {shares}",
        "nan_in_mips": f"one in 8x8 becomes, level by level, {nans}",
        "cube_edges": f"edge {edges['edge']:.3f} (right 0.500), corner {edges['corner']:.3f} (right 0.667)",
        "denormals": "",
    }
    for name, figure in figures.items():
        heading = name.replace("_", " ")
        for line in filter(None, (figure, probes[name]["meaning"])):
            yield f"  {heading:<15}  {line}"
            heading = ""


def _looks(texturing: Report) -> Iterator[str]:
    """The verdicts on look-ups, as a table."""
    yield f"  texturing        {texturing['meaning' if texturing['ok'] else 'error']}"
    if texturing["ok"]:
        yield f"  {'':<15}  {'look-up':<32}  precision  from the middle  error"
    for found in texturing.get("verdicts", ()):
        error = f"{found['least']:+.4f} to {found['most']:+.4f}"
        yield f"  {'':<15}  {found['name']:<32}  {found['grade']:<9}  {found['from_middle']:15.2f}  {error}"


def _ask(*question: str, limit: float) -> Report:
    """The answer of a fresh process to `question`; {ok: False, error, mend} where it crashes, hangs or babbles."""
    command = [sys.executable, "-m", "glbump.gl.doctor", *question]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    try:
        done = subprocess.run(command, env=environment, capture_output=True, text=True, errors="replace", timeout=limit)
    except subprocess.TimeoutExpired:
        return {"ok": False, "error": f"no answer in {limit:g} s", "mend": NO_ANSWER}
    try:
        answer: Report = json.loads(done.stdout.strip().splitlines()[-1])
    except (IndexError, ValueError):
        said = (done.stderr.strip().splitlines() or ["nothing"])[-1]
        end = signal.Signals(-done.returncode).name if done.returncode < 0 else f"status {done.returncode}"
        return {"ok": False, "error": f"the process ended with {end} and said: {said}", "mend": NO_ANSWER}
    return answer


def _answer(question: str, backend: str = "auto", route: str = "") -> Report:
    """What a process started by `_ask` says."""
    from glbump.errors import ContextError
    from glbump.gl.context import Context, open_context
    from glbump.gl.native import RouteError
    from glbump.gl.probe import probe
    from glbump.gl.texturing import texturing
    from glbump.gl.ways import Attempt, ways

    if question in ("choose", "texturing"):
        try:
            context = open_context()
        except ContextError as error:
            return {"ok": False, "error": str(error)}
        return {"ok": True} | (texturing(context) if question == "texturing" else {"route": context.route})
    if question == "list":
        routes = [
            {"route": way.route, "library": way.library, "backend": "egl"}
            | ({"ok": False} | asdict(way) if isinstance(way, Attempt) else {})
            for way in ways("egl")
        ]
        return {"ok": True, "routes": routes}
    way = next(way for way in ways(backend) if way.route == route)
    assert not isinstance(way, Attempt)
    start = time.perf_counter()
    try:
        context = Context(way.open(330), route)
    except RouteError as error:
        return {"ok": False, "error": str(error), "mend": error.mend}
    seconds = time.perf_counter() - start
    facts = {"info": context.info, "is_software": context.is_software, "library": context.library}
    return {"ok": True, "seconds": seconds, **facts, "probes": probe(context)}


if __name__ == "__main__":
    print("\n" + json.dumps(_answer(*sys.argv[1:])), flush=True)
    # Not the ordinary way out: a driver that crashes when unloaded has answered all the same.
    os._exit(0)
