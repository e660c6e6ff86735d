"""Tuning: promises are kept; what cannot be kept is said, and by how much; what was found is remembered."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import glbump as gb
from glbump import LimitError, Quality, SceneError
from glbump.cli import run
from glbump.qualityfile import load_quality, save_quality
from glbump.trade.metrics import compare
from glbump.trade.remembered import Remembered
from glbump.trade.tune import CHEAPER, Tuned, other_views, tuned

SIZE = (64, 64)


def scene(seed: int = 3) -> gb.Scene:
    """A mirror ball in noise: each knob of its sampling matters."""
    noise = np.random.default_rng(seed).random((16, 32, 3)).astype(np.float32)
    return gb.Scene(
        [gb.Surface(gb.Sphere(), material=gb.Material(metallic=1, roughness=0))],
        gb.LatLong(np.repeat(np.repeat(noise, 4, axis=0), 4, axis=1)),
        gb.Camera(eye=(0, 0, 4)),
    )


def off(quality: Quality, of: gb.Scene) -> float:
    """The error afterwards, against 256 samples a pixel, which tuning itself did not look at."""
    with gb.Renderer() as renderer:
        truth = renderer.render(of, SIZE, Quality("exact", samples=256)).pixels
        got = renderer.render(of, SIZE, quality).pixels
    return float(compare(got, truth, perceptual=False)["rmse"])


@pytest.fixture
def memory(tmp_path: Path) -> Remembered:
    return Remembered(tmp_path / "memory")


@pytest.mark.parametrize("budget", [8 / 255, 1.5 / 255])
def test_the_promise_is_kept_and_not_at_any_price(budget: float, memory: Remembered) -> None:
    content = scene()
    found = tuned(content, max_error=budget, size=SIZE, remembered=memory)
    assert off(found.quality, content) <= budget
    assert found.error <= budget
    # Cheaper ones that were tried break it, all of them.
    cheaper = [t for t in found.tried if t.ms is not None and t.ms < 0.9 * found.ms]
    assert all(t.error > 0.97 * budget for t in cheaper)
    assert len(found.views) == 2


def test_a_tighter_promise_costs_more_samples(memory: Remembered) -> None:
    content = scene()
    samples = [tuned(content, max_error=e / 255, size=SIZE, remembered=memory).quality.samples for e in (20, 1.5, 0.9)]
    assert samples == sorted(samples)
    assert samples[0] == 1
    assert samples[-1] > 4


def test_within_a_time_the_nearest_is_chosen(memory: Remembered) -> None:
    content = scene()
    fast = tuned(content, max_error=20 / 255, size=SIZE, remembered=memory)
    found = tuned(content, max_ms=50 * fast.ms, size=SIZE, remembered=memory)
    assert found.ms <= 50 * fast.ms
    assert found.error < fast.error
    # What is nearer by less than CHEAPER counts as alike.
    assert CHEAPER * found.error <= min(t.error for t in found.tried if t.ms is not None and t.ms <= 50 * fast.ms)


def test_what_any_setting_shows_takes_the_cheapest(memory: Remembered) -> None:
    """Light that is the same everywhere, and nothing in it: no error to lessen."""
    grey = gb.Scene([], gb.LatLong(np.full((4, 8, 3), 0.5, np.float32)))
    for promise in ({"max_error": 1 / 255}, {"max_ms": 1000.0}):
        found = tuned(grey, size=SIZE, remembered=memory, **promise)
        assert found.error < 1e-3
        assert found.quality.samples == 1


def test_what_was_found_is_remembered_for_this_scene_alone(memory: Remembered) -> None:
    steps: list[str] = []
    first = tuned(scene(), max_error=2 / 255, size=SIZE, remembered=memory, step=steps.append)
    assert "truth" in steps
    for content, again in ((scene(), True), (scene(4), False), (replace(scene(), camera=gb.Camera(fov=39)), False)):
        steps.clear()
        found = tuned(content, max_error=2 / 255, size=SIZE, remembered=memory, step=steps.append)
        assert found.remembered is again
        assert ("truth" not in steps) is again
        if again:
            assert (found.quality, found.error, found.views) == (first.quality, first.error, first.views)
    # Another promise for the same scene starts from what was measured.
    steps.clear()
    more = tuned(scene(), max_error=2.5 / 255, size=SIZE, remembered=memory, step=steps.append)
    assert not more.remembered
    assert off(more.quality, scene()) <= 2.5 / 255


def test_a_damaged_memory_is_none(tmp_path: Path) -> None:
    memory = Remembered(tmp_path)
    key = memory.key(scene(), SIZE, "rmse", "some driver")
    for text in ("", "{", "[]", '{"rows": [{"quality": {"samples": 3}}], "noise": 0, "chosen": {}}'):
        (tmp_path / f"{key}.json").write_text(text)
        assert memory.read(key) == {}
    memory.write(key, [{"quality": Quality("fast"), "error": 0.5, "ms": 1.0}], 0.25, {"a": 1})
    assert memory.read(key) == {
        "rows": [{"quality": Quality("fast"), "error": 0.5, "ms": 1.0}],
        "noise": 0.25,
        "chosen": {"a": 1},
    }
    # Where nothing can be kept nothing is, and nobody is told off for it.
    (tmp_path / "file").write_text("")
    Remembered(tmp_path / "file").write(key, [], 0.0, {})


@pytest.mark.parametrize(
    ("promise", "kind", "said"),
    [
        ({}, SceneError, "one of max_error and max_ms"),
        ({"max_error": 0.1, "max_ms": 4}, SceneError, "one of max_error and max_ms"),
        ({"max_error": 0}, SceneError, "max_error must be a finite number above 0.*got 0"),
        ({"max_error": 2}, SceneError, "max_error must be .*at most 1; got 2"),
        ({"max_ms": -1}, SceneError, "max_ms must be a finite number above 0"),
        ({"max_error": 0.1, "metric": "rmsw"}, SceneError, "unknown metric 'rmsw'.*did you mean 'rmse'"),
        ({"max_error": 1e-6}, LimitError, "below what the truth resolves.*allow at least"),
        (
            {"max_ms": 1e-4},
            LimitError,
            "a bare draw of this scene at 64x64 takes .* ms here, and 0.0001 ms are allowed",
        ),
    ],
)
def test_what_cannot_be_promised(promise: dict[str, Any], kind: type[Exception], said: str, memory: Remembered) -> None:
    with pytest.raises(kind, match=said) as caught:
        tuned(scene(), size=SIZE, remembered=memory, **promise)
    assert "\n" not in str(caught.value)


def test_a_promise_that_no_setting_keeps_says_by_how_much(memory: Remembered, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("glbump.trade.tune.SAMPLES", (1,))
    with pytest.raises(
        LimitError, match=r"no setting keeps 0.9/255 at 64x64: the nearest .* is off by [\d.]+/255; allow"
    ):
        tuned(scene(), max_error=0.9 / 255, size=SIZE, remembered=memory)


def test_other_views_look_at_the_same_place_from_as_far() -> None:
    content = replace(scene(), camera=gb.Camera(eye=(1, 2, 4), target=(0, 0.5, 0)))
    for view in other_views(content):
        eye, target = np.array(view.camera.eye), np.array(view.camera.target)
        assert view.camera.target == content.camera.target
        assert np.linalg.norm(eye - target) == pytest.approx(np.linalg.norm(np.subtract((1, 2, 4), target)))
        assert np.linalg.norm(eye - (1, 2, 4)) > 0.5


def test_quality_files(tmp_path: Path) -> None:
    path = tmp_path / "quality.toml"
    for quality in (Quality("fast"), Quality("exact", samples=4, silhouette=0.3, bump_filter="trilinear")):
        save_quality(quality, path, ["why: because", "two\nlines"])
        assert load_quality(path) == quality
        assert path.read_text().startswith("# why: because\n# two lines\npreset =")
    for text, said in (
        ("", "is empty"),
        ("samples =", "is not TOML"),
        ("sample = 4", "unknown knob 'sample'; did you mean 'samples'"),
        ("samples = 3", "square number"),
        ('preset = "good"', "unknown quality 'good'"),
    ):
        path.write_text(text)
        with pytest.raises(SceneError, match=f"quality.toml: .*{said}"):
            load_quality(path)
    with pytest.raises(SceneError, match="there is no such quality file"):
        load_quality(tmp_path / "none.toml")


def test_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """A scene file in, a quality file out, and a picture drawn with it."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    where, quality = str(tmp_path / "scene.toml"), str(tmp_path / "q.toml")
    gb.save_scene(gb.Scene([gb.Surface(gb.Sphere(), gb.Material(metallic=1, roughness=0))]), where)
    call = ["tune", where, "--max-error", "2/255", "--size", "48x48", "-o", quality]
    assert run(call) == 0
    assert "settings tried" in capsys.readouterr().out
    assert run([*call, "--json"]) == 0
    figures = json.loads(capsys.readouterr().out)
    assert figures["remembered"] is True
    assert figures["error"] <= 2 / 255
    assert Quality(**figures["quality"]) == load_quality(quality)
    assert run(["render", where, "-o", str(tmp_path / "a.png"), "--size", "48x48", "--quality", quality]) == 0
    for wrong in (
        ["--max-error", "half"],
        [],
        ["--max-error", "1", "--max-ms", "1"],
        ["--max-ms", "4", "--metric", "x"],
    ):
        assert run(["tune", where, *wrong]) == 2


def test_the_public_name() -> None:
    assert gb.tune.__module__ == "glbump.trade.tune"
    assert Tuned.__doc__
