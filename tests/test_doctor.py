"""The doctor: probes against what is known of llvmpipe, routes that crash, hang or fail, and the advice."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from glbump.gl import doctor, probe
from glbump.gl.context import Context

SEAMLESS = 0x884F  # GL_TEXTURE_CUBE_MAP_SEAMLESS


@pytest.fixture(scope="module")
def report() -> doctor.Report:
    """One real examination of this machine."""
    return doctor.report()


@pytest.fixture
def llvmpipe(context: Context) -> Context:
    """The context, where it is the driver whose ways are known."""
    if "llvmpipe" not in context.info["renderer"]:
        pytest.skip(f"figures are known for llvmpipe; this is {context.info['renderer']}")
    return context


def route(name: str, **more: Any) -> dict[str, Any]:
    """A route of a made-up report."""
    return {"route": name, "backend": name.split()[0], "library": "lib", "ok": "error" not in more} | more


def made_up(chosen: str | None, *routes: dict[str, Any], **more: Any) -> doctor.Report:
    """A report nobody examined a machine for."""
    return {"chosen": chosen, "chosen_error": "nothing", "routes": list(routes), "gpus": {}, "environment": {}} | more


# The probes


def test_filter_weights(llvmpipe: Context) -> None:
    found = probe.filter_weights(llvmpipe)
    assert found["rgba8"]["levels"] == 256
    assert 0.5 / 256 < found["rgba8"]["max_error"] <= 1 / 255  # a step of the weights, and rounding to 8 bits
    for name in ("half", "float"):
        assert found[name] == {"levels": 4096, "max_error": 0.0}
    assert "of rgba8" in found["meaning"]


def test_level_of_detail(llvmpipe: Context) -> None:
    found = probe.level_of_detail(llvmpipe)
    # Half the log2 of the squared footprint, by straight lines between powers of two: exact at every half level.
    wanted, error = np.transpose(found["curve"])
    within = 2 * wanted % 1
    assert error == pytest.approx((np.exp2(within) - 1 - within) / 2, abs=2e-4)  # the curve is rounded to 4 digits
    assert found["min_error"] == pytest.approx(-0.0430, abs=1e-4)
    assert abs(found["max_error"]) < 1e-5


def test_anisotropy(llvmpipe: Context) -> None:
    found = probe.anisotropy(llvmpipe)
    assert found["levels"]["1"] == pytest.approx(4, abs=1e-3)  # log2 of the longer side
    assert found["levels"]["2"] == found["levels"]["16"] == found["given"]
    assert not found["honoured"]


def test_odd_mips(llvmpipe: Context) -> None:
    found = probe.odd_mips(llvmpipe)
    assert found["weights"] == pytest.approx([0, 0, 0, 1, 0, 0, 0], abs=1e-6)
    assert np.sum(found["weights_7_to_3"], axis=1) == pytest.approx([1, 1, 1], abs=1e-6)
    assert found["max_error"] == pytest.approx(6 / 7, abs=1e-6)


def test_nan_in_mips(llvmpipe: Context) -> None:
    found = probe.nan_in_mips(llvmpipe)
    assert found["nan_per_level"] == [1, 1, 1, 1]
    assert found["poisons_1x1"]


def test_cube_edges(context: Context) -> None:
    found = probe.cube_edges(context)
    assert found["seamless"], "moderngl enables it for every context"
    assert found["edge"] == pytest.approx(1 / 2, abs=0.01)  # 8-bit weights
    context.gl.disable_direct(SEAMLESS)
    try:
        assert not probe.cube_edges(context)["seamless"], "the probe sees an edge where there is one"
    finally:
        context.gl.enable_direct(SEAMLESS)


def test_probes_leave_nothing_behind(context: Context) -> None:
    probe.probe(context)
    before = context.live_objects()
    found = probe.probe(context)
    assert context.live_objects() == before
    assert set(found) == {one.__name__ for one in probe.PROBES}
    assert all(one["meaning"] and "\n" not in one["meaning"] for one in found.values())


# The report


def test_report_is_json_and_names_every_route(report: doctor.Report, context: Context) -> None:
    assert json.loads(json.dumps(report, allow_nan=False)) == report
    assert report["chosen"] == context.route
    assert doctor.healthy(report)
    backends = {one["backend"] for one in report["routes"]}
    assert backends == {"egl", "osmesa", "window"}
    for one in report["routes"]:
        wanted = {"info", "is_software", "seconds", "probes"} if one["ok"] else {"error", "mend"}
        assert wanted <= set(one), one["route"]


def test_text_shows_routes_and_probes(report: doctor.Report) -> None:
    text = doctor.text(report)
    for one in report["routes"]:
        assert f"  {one['route']} " in text
    assert "What to do:" in text or not doctor.advice(report)
    assert "level of detail" in text
    assert report["texturing"]["ok"]
    assert "look-ups are as OpenGL allows" in text
    assert "cube half level given" in text


def test_a_driver_that_falls_over_its_textures(report: doctor.Report) -> None:
    crashed = report | {"texturing": {"ok": False, "error": "the process ended with SIGSEGV", "mend": "none"}}
    assert doctor.healthy(crashed)
    assert "  texturing        the process ended with SIGSEGV\n" in doctor.text(crashed) + "\n"


@pytest.mark.parametrize(
    ("program", "said"),
    [
        ("kill -SEGV $$", "the process ended with SIGSEGV and said: nothing"),
        ("echo bad driver >&2; exit 3", "the process ended with status 3 and said: bad driver"),
        ("exec sleep 60", "no answer in 0.3 s"),
        ("echo '[unfinished'", "the process ended with status 0"),
    ],
)
def test_a_driver_that_takes_its_process_down(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, program: str, said: str
) -> None:
    python = tmp_path / "python"
    python.write_text(f"#!/bin/sh\n{program}\n")
    python.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(python))
    report = doctor.report(time_limit=0.3)
    assert not doctor.healthy(report)
    assert [one["ok"] for one in report["routes"]] == [False, False, False]
    assert all(said in one["error"] for one in report["routes"])
    assert said in doctor.text(report)


def test_a_driver_that_talks_before_it_answers(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    python = tmp_path / "python"
    python.write_text("#!/bin/sh\necho MESA: warning\necho '{\"ok\": true}'\n")
    python.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(python))
    assert doctor._ask("choose", limit=10) == {"ok": True}


# The advice

SOFTWARE = route("egl device 1 (software)", is_software=True)


def test_nothing_to_do_on_a_graphics_card() -> None:
    card = route("egl device 0 (hardware)", is_software=False)
    assert doctor.advice(made_up(card["route"], card, SOFTWARE, gpus={"/dev/dri/renderD128": True})) == []


def test_a_card_that_fails_is_worth_mending() -> None:
    card = route("egl device 0 (hardware)", error="eglInitialize failed", mend="give it the device")
    window = route("window", error="no display", mend="set DISPLAY")
    assert doctor.advice(made_up(SOFTWARE["route"], card, SOFTWARE, window)) == [
        "for egl device 0 (hardware): give it the device"
    ]


@pytest.mark.parametrize(("opens", "word"), [(True, "NVIDIA_DRIVER_CAPABILITIES"), (False, "usermod")])
def test_a_card_that_egl_does_not_list(opens: bool, word: str) -> None:
    (line,) = doctor.advice(made_up(SOFTWARE["route"], SOFTWARE, gpus={"/dev/nvidia0": opens}))
    assert line.startswith("/dev/nvidia0: ")
    assert word in line


@pytest.mark.parametrize(
    ("renderer", "threads", "warned"),
    [("llvmpipe (LLVM 15)", "1", 1), ("llvmpipe (LLVM 15)", "0", 0), ("softpipe", "1", 0)],
)
def test_one_thread_of_llvmpipe(renderer: str, threads: str, warned: int) -> None:
    drawn = SOFTWARE | {"info": {"renderer": renderer}}
    report = made_up(SOFTWARE["route"], drawn, environment={"LP_NUM_THREADS": threads})
    assert doctor.advice(report) == [doctor.ONE_THREAD] * warned


def test_nothing_works() -> None:
    failed = [route(name, error="bad", mend="install it") for name in ("egl devices", "egl surfaceless")]
    osmesa = route("osmesa", error="none", mend="install that")
    report = made_up(None, *failed, osmesa)
    assert doctor.advice(report) == [
        "for egl devices and egl surfaceless: install it",
        "for osmesa: install that",
    ]
    assert not doctor.healthy(report)


def test_the_environment_forbids_what_works() -> None:
    failed = route("egl", error="bad", mend="install it")
    report = made_up(None, failed, route("osmesa"), environment={"GLBUMP_BACKEND": "egl"})
    assert doctor.advice(report) == ["unset GLBUMP_BACKEND, or set it to osmesa, which works here"]
