"""A trade from end to end at tiny sizes: measured, kept, gone on with, and written as CSV, JSON, SVG and HTML."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from glbump import patterns
from glbump.camera import Camera
from glbump.cli import run
from glbump.environment import LatLong, Sky
from glbump.errors import GlbumpError, SceneError
from glbump.maps.images import read_picture, write_picture
from glbump.quality import KNOBS, Quality
from glbump.scene import Bump, Material, Scene, Surface
from glbump.scenefile import save_scene
from glbump.shapes import Sphere
from glbump.trade import features
from glbump.trade import measure as measuring
from glbump.trade import settings as trying
from glbump.trade.errors import FIGURES
from glbump.trade.measure import Bench
from glbump.trade.page import says
from glbump.trade.plots import Point, front_svg
from glbump.trade.report import CSV, JSON, PAGE, PLOT, evidence, read_facts, write_report
from glbump.trade.results import ROWS
from glbump.trade.settings import BASE, FEATURE, KNOB, PRESET
from glbump.trade.sweep import Sweep, Trade, gain_for
from glbump.trade.truth import find_truth

MIRROR = Material(metallic=1, roughness=0)
BRICKS = Bump(patterns.bricks((32, 32), seed=1), amplitude=0.02)
CAMERA = Camera(eye=(0, 0, 4))
SCENE = Scene([Surface(Sphere(), MIRROR, bump=BRICKS)], Sky(), CAMERA)
FEW = {name: KNOBS[name] for name in ("samples", "bump_kernel", "gloss_size")}
FEW["samples"] = FEW["samples"]._replace(values=(1, 4))
FEW["bump_kernel"] = FEW["bump_kernel"]._replace(values=("forward", "central", "bspline"))


def _cut_down(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(trying, "KNOBS", FEW)
    patch.setattr(features, "FEATURES", [f for f in features.FEATURES if f.name in ("tint", "rotation")])
    patch.setattr(measuring, "MOST_TURNS", 2)


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Few knobs, few features, few turns."""
    _cut_down(monkeypatch)


def swept(scene: Scene, directory: Path, **options: Any) -> Trade:
    with Sweep(scene, directory, size=(32, 32), samples=16, **options) as sweep:
        return sweep.run()


def test_a_setting_is_measured_whole() -> None:
    with Bench(SCENE, (32, 32)) as bench:
        bench.truth = find_truth(SCENE, (32, 32), 16, bench.renderer)
        fast = bench.measure(Quality("fast"), turns=3)
        exact = bench.measure(Quality("exact", samples=64), turns=3)
        sobel = bench.measure(Quality("exact", bump_kernel="sobel"), turns=1)
    assert set(fast.error) == set(FIGURES)
    assert exact.error["rmse"] < fast.error["rmse"]  # type: ignore[operator]
    # Normals are the reference's in 32 bits; another kernel's are not.
    assert exact.error["normal_p99"] < 0.05 < sobel.error["normal"]  # type: ignore[operator]
    assert fast.cost["times"]["median"] < exact.cost["times"]["median"]  # 1 sample, 64 samples
    for cost in (fast.cost, exact.cost):
        assert cost["turns"] == 3
        assert cost["clock"] in ("wall clock", "GPU timer")
        assert cost["bytes"] > 0
        parts = cost["draw"]["median"] + cost["read"]["median"]
        assert parts == pytest.approx(cost["frame"]["median"], rel=0.5)
        assert cost["first"] >= cost["open"] + cost["set_up"] + cost["upload"] + cost["first_draw"] - 1e-6
        assert cost["frame"]["low"] <= cost["frame"]["median"] <= cost["frame"]["high"]
    assert fast.plan["samples"] == "1"
    assert fast.pixels.shape == (32, 32, 4)


def test_on_a_gpu_its_own_clock_times_draws(monkeypatch: pytest.MonkeyPatch) -> None:
    # Drivers in software answer timer queries too, without meaning.
    monkeypatch.setattr(Bench, "has_gpu_clock", True)
    with Bench(SCENE, (32, 32)) as bench:
        bench.truth = find_truth(SCENE, (32, 32), 4, bench.renderer)
        cost = bench.measure(Quality("fast"), turns=3).cost
    assert cost["clock"] == "GPU timer"
    assert cost["gpu"]["median"] > 0


def test_turns_end_when_the_median_is_known_or_time_is_up() -> None:
    enough, spread = measuring._is_enough, measuring.Spread
    assert not enough(4, spread(1, 1, 1), 0.1)
    assert enough(5, spread(1, 1, 1), 0.1)
    assert not enough(5, spread(1, 0.5, 1.5), 0.1)
    assert enough(5, spread(1, 0.5, 1.5), 10)
    assert enough(2, spread(1, 0.5, 1.5), 10)
    assert not enough(1, spread(1, 1, 1), 10)


def test_a_sweep_has_a_row_for_all_that_matters(reported: tuple[Trade, Path]) -> None:
    trade, _ = reported
    assert [row["kind"] for row in trade.rows][:3] == [BASE, PRESET, PRESET]
    names = [row["name"] for row in trade.of(KNOB)]
    assert names == ["samples=1", "bump_kernel=forward", "bump_kernel=bspline"]
    assert {s.name for s in trade.skipped} == {f"gloss_size={n}" for n in (16, 32, 64, 256)}
    assert trade.of(FEATURE)
    assert trade.left == []
    assert set(trade.front) <= {row["name"] for row in trade.rows}
    cheapest = min((r for r in trade.rows if r["kind"] != FEATURE), key=lambda r: r["cost"]["times"]["median"])
    assert cheapest["name"] == trade.front[0]
    assert "balanced" in "\n".join(trade.lines())


def test_a_run_that_was_cut_off_goes_on(few: None, tmp_path: Path) -> None:
    first = swept(SCENE, tmp_path, minutes=0)
    # No time for any but the base, which the others are measured beside.
    assert [row["kind"] for row in first.rows] == [BASE]
    assert "samples=1" in first.left
    assert "run it again" in first.notes()[-1]
    second = swept(SCENE, tmp_path)
    assert second.left == []
    assert second.rows[0]["cost"] == first.rows[0]["cost"]
    # Killed in the middle of a line: that row alone is measured anew.
    file = tmp_path / ROWS
    lines = file.read_bytes().splitlines(keepends=True)
    file.write_bytes(b"".join(lines[:-1]) + lines[-1][:40])
    third = swept(SCENE, tmp_path)
    assert [row["name"] for row in third.rows] == [row["name"] for row in second.rows]
    same = [a["cost"] == b["cost"] for a, b in zip(second.rows, third.rows)]
    assert same.count(False) == 1


def test_predicting_takes_half_of_the_time_at_most(few: None, reported: tuple[Trade, Path], tmp_path: Path) -> None:
    with Sweep(SCENE, tmp_path, size=(32, 32), samples=16) as sweep:
        sweep._predicting = 0.0
        trade = sweep.run()
    assert [row["kind"] for row in trade.rows if row["predicted"]] == [BASE]
    assert "not predicted" in trade.notes()[-1]
    # And where there is time, nothing is said of it.
    assert not any("not predicted" in note for note in reported[0].notes())


def test_another_size_or_base_is_measured_beside_what_is_there(few: None, tmp_path: Path) -> None:
    swept(SCENE, tmp_path, minutes=0)
    before = (tmp_path / ROWS).read_bytes()
    other = swept(SCENE, tmp_path, base="fast", minutes=0)
    assert other.rows[0]["name"] == "fast"
    assert (tmp_path / ROWS).read_bytes().startswith(before)
    with pytest.raises(GlbumpError, match="another scene"):
        swept(Scene([], Sky()), tmp_path)


@pytest.mark.parametrize("options", [{"metric": "psnr"}, {"samples": 5}, {"minutes": -1}, {"base": "best"}])
def test_wrong_options_are_said(few: None, tmp_path: Path, options: dict[str, Any]) -> None:
    with pytest.raises(SceneError):
        Sweep(SCENE, tmp_path / "out", **{"size": (32, 32)} | options)
    assert not (tmp_path / "out").exists()


class _Page(HTMLParser):
    """Counts tags, and sees that each that is opened is closed."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.images: list[str] = []
        self.text = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if dict(attrs).get("role") == "img" and tag == "div":
            self.images.append(dict(attrs)["class"] or "")
        if tag not in ("meta", "br"):
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data


@pytest.fixture(scope="module")
def reported(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Trade, Path]]:
    with pytest.MonkeyPatch.context() as patch:
        _cut_down(patch)
        directory = tmp_path_factory.mktemp("trade")
        trade = swept(SCENE, directory)
        write_report(trade, directory, "a <ball>")
        yield trade, directory


def test_the_page_stands_alone_and_says_all(reported: tuple[Trade, Path]) -> None:
    trade, directory = reported
    text = (directory / PAGE).read_text()
    page = _Page()
    page.feed(text)
    assert page.open == []
    assert "a <ball>" in page.text
    assert page.images
    for name in page.images:
        # Once, however often it is shown.
        assert text.count(f".{name}{{") == 1
    assert text.count("url(") == text.count("url(data:image/png;base64,") == len(set(page.images))
    # Nothing is fetched: the one address is that which names SVG.
    assert text.count("http") == text.count("http://www.w3.org/2000/svg") == 1
    for name in (
        *FIGURES,
        *KNOBS,
        trade.driver,
        "gloss_size",
        "Nothing here depends on it",
        "What the plan leaves out",
    ):
        assert name in page.text
    for figure in FIGURES.values():
        assert figure.blind in page.text


def test_pictures_are_of_their_settings(reported: tuple[Trade, Path]) -> None:
    trade, directory = reported
    for row in trade.rows:
        got = read_picture(directory / row["pictures"]["error"]).pixels
        assert row["gain"] == trade.rows[0]["gain"]
        # In steps of 1/255; dark where the error is small.
        assert (got.max() > 0) == (row["error"]["max"] > 0.5 / 255 / row["gain"])


def test_errors_are_magnified_to_be_seen() -> None:
    assert [gain_for(e) for e in (1.0, 0.3, 1 / 16, 0.9 / 255, 0.0)] == [1, 4, 16, 256, 256]


def test_csv_and_json_have_every_row(reported: tuple[Trade, Path]) -> None:
    trade, directory = reported
    with (directory / CSV).open() as opened:
        rows = list(csv.DictReader(opened))
    assert [r["name"] for r in rows] == [r["name"] for r in trade.rows] + [s.name for s in trade.skipped]
    assert float(rows[1]["rmse"]) == trade.rows[1]["error"]["rmse"]
    assert float(rows[1]["times_median"]) == trade.rows[1]["cost"]["times"]["median"]
    assert {r["driver"] for r in rows} == {trade.driver}
    facts = json.loads((directory / JSON).read_text())
    assert [r["name"] for r in facts["rows"]] == [r["name"] for r in trade.rows]
    assert facts["figures"]["flip"]["blind"] == FIGURES["flip"].blind
    assert facts["truth"]["samples"] == 16


def test_the_plot_is_svg_with_every_setting(reported: tuple[Trade, Path]) -> None:
    trade, directory = reported
    root = ElementTree.parse(directory / PLOT).getroot()
    titles = [t.text or "" for t in root.iter("{http://www.w3.org/2000/svg}title")]
    for row in trade.rows:
        assert any(t.startswith(row["name"] + ":") for t in titles) == (row["kind"] != FEATURE)


def test_plots_stand_errors_of_nothing_and_equal_points() -> None:
    one = Point("a <b>", "base", 1.0, 0.0, True)
    for points in ([], [one], [one, one._replace(name="c")], [one, Point("d", "preset", 9.0, 3.0, False)]):
        ElementTree.fromstring(front_svg(points, "ms", "rmse", 0.1))


def test_sentences_say_what_is_bought_and_what_it_costs() -> None:
    def row(rmse: float, times: float, size: int) -> dict[str, Any]:
        return {"error": {"rmse": rmse}, "cost": {"times": {"median": times}, "bytes": size}}

    base = row(4 / 255, 1.0, 1_000_000)
    assert says(row(2 / 255, 1.8, 3_000_000), base, "rmse") == (
        "less error, 4 to 2; takes 1.80 times as long, 2 MB more"
    )
    assert says(row(4 / 255, 1.01, 1_000_000), base, "rmse") == "the same error; takes as long"
    assert says(row(5 / 255, 0.5, 900_000), base, "rmse") == "more error, 4 to 5; takes 0.50 times as long, 0.1 MB less"


def test_evidence_is_of_the_other_ways(reported: tuple[Trade, Path]) -> None:
    _, directory = reported
    facts = read_facts(directory, SCENE)
    found = evidence(facts, facts["rows"][0]["plan"])
    assert any(line.startswith("samples=1: 1; rmse") for line in found["samples"])
    assert not any("bump_kernel" in line for line in found["samples"])
    # Of what this plan does not choose as the base did, nothing is known.
    assert "samples" not in evidence(facts, {"samples": "9"})
    with pytest.raises(GlbumpError, match="another scene"):
        read_facts(directory, Scene([], Sky()))
    with pytest.raises(GlbumpError, match="is no trade"):
        read_facts(directory / "pictures", SCENE)


def test_the_command(few: None, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_picture(tmp_path / "sky.exr", patterns.fbm((16, 32), seed=1)[..., None].repeat(3, axis=2))
    save_scene(Scene([Surface(Sphere(), MIRROR)], LatLong(tmp_path / "sky.exr"), CAMERA), tmp_path / "ball.toml")
    scene, out = str(tmp_path / "ball.toml"), str(tmp_path / "out")
    assert run(["trade", scene, "-o", out, "--size", "32x32", "--samples", "16", "--metric", "p99"]) == 0
    said = capsys.readouterr()
    assert "on the front" in said.out
    assert "trade.html" in said.out
    assert run(["trade", scene, "-o", out, "--size", "32x32", "--samples", "16", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["rows"][0]["name"] == "balanced"
    picture = str(tmp_path / "a.png")
    assert run(["render", scene, "-o", picture, "--size", "32x32", "--explain", "--measured", out]) == 0
    said = capsys.readouterr()
    assert "samples=1: 1; rmse" in said.out
    assert "sky " in said.out
    for wrong, status in (
        (["--measured", out], 2),
        (["--explain", "--reference"], 2),
        (["--explain", "--measured", str(tmp_path)], 1),
    ):
        assert run(["render", scene, "-o", picture, *wrong]) == status
    for wrong in (["--metric", "psnr"], ["--minutes", "-1"], ["--samples", "2"], ["--size", "big"]):
        assert run(["trade", scene, "-o", out, *wrong]) == 2
    assert run(["trade", scene, "-o", scene]) == 1
    assert np.asarray(capsys.readouterr().err.count("glbump: error")) >= 1
