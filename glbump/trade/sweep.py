"""The trade of one scene: every setting worth trying, measured, kept as it comes, and what follows from all."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from glbump import validate as check
from glbump.errors import GlbumpError, LimitError
from glbump.maps.colour import eight_bit
from glbump.maps.files import write_display
from glbump.quality import Quality, quality_of
from glbump.scene import Scene, check_size
from glbump.trade.errors import FIGURES
from glbump.trade.features import left_out
from glbump.trade.measure import Bench, Measured
from glbump.trade.metrics import difference_picture
from glbump.trade.model import Model
from glbump.trade.results import Results, Row, digest, scene_key
from glbump.trade.settings import ALIKE, BASE, FEATURE, PRESET, Setting, combinations, front, one_at_a_time, presets
from glbump.trade.truth import Truth, find_truth

METRICS = tuple(name for name in FIGURES if name not in ("psnr", "silhouette", "normal", "normal_p99"))
"""Figures that a front can be of: less is better, and none is missing."""

COMBINATIONS = 12
"""Most settings of several knobs that a trade tries."""


@dataclass(frozen=True)
class Trade:
    """All that was measured of a scene, which is known by its key.

    rows: of settings measured, as JSON has them, the base first. skipped: those with nothing to measure, and why.
    left: names of those that time ran out for. truth: what errors are against. explain: the base's plan and its
    reasons, each {what, value, why}. front: names on the Pareto front of time and `metric`, the cheapest first.
    """

    scene: str
    size: tuple[int, int]
    driver: str
    base: Quality
    metric: str
    truth: Truth
    rows: list[Row]
    skipped: list[Setting]
    left: list[str]
    explain: list[dict[str, str]]
    front: list[str]

    def of(self, kind: str) -> list[Row]:
        """The rows of one kind."""
        return [row for row in self.rows if row["kind"] == kind]

    def notes(self) -> list[str]:
        """What is to be known of it, in sentences."""
        said = list(self.truth.notes)
        unsaid = sum(row["kind"] != FEATURE and not row["predicted"] for row in self.rows)
        if any(row["predicted"] for row in self.rows) and unsaid:
            said.append(f"{unsaid} settings were measured and not predicted: predicting may take half of the time")
        if self.left:
            said.append(f"time ran out before {len(self.left)} settings; run it again for the rest")
        return said

    def lines(self) -> list[str]:
        """The presets and the front for people, as a table."""
        figure = FIGURES[self.metric]
        cost = self.of(BASE)[0]["cost"]
        base = (cost["gpu"] or cost["frame"])["median"]
        shown = [row for row in self.rows if row["kind"] in (BASE, PRESET) or row["name"] in self.front]
        shown = sorted((r for r in shown if r["kind"] != FEATURE), key=lambda row: row["cost"]["times"]["median"])
        lines = [f"{self.driver}: {self.metric} {figure.unit}, and frames' times to the base's"]
        for row in shown:
            error, times = figure.scale * row["error"][self.metric], row["cost"]["times"]["median"]
            best = "on the front" if row["name"] in self.front else ""
            lines.append(f"{error:9.3g}{times:9.2f}{base * times:9.3g} ms  {best:12}  {row['name']}")
        return lines

    def facts(self) -> dict[str, Any]:
        """All of it for JSON, but the pictures."""
        truth = self.truth
        return {
            "scene": self.scene,
            "size": self.size,
            "driver": self.driver,
            "base": asdict(self.base),
            "metric": self.metric,
            "truth": {
                "source": truth.source,
                "samples": truth.samples,
                "noise": truth.noise,
                "checked": truth.checked._asdict() if truth.checked else None,
                "notes": truth.notes,
            },
            "figures": {name: figure._asdict() for name, figure in FIGURES.items()},
            "front": self.front,
            "rows": self.rows,
            "skipped": [{"name": s.name, "changes": s.changes, "why": s.skipped} for s in self.skipped],
            "left": self.left,
            "explain": self.explain,
        }


class Sweep:
    """Measures settings of one scene into a folder. `total` settings at most; `run` calls `step` after each.

    base: every knob is turned from there. samples: of the truth. minutes: no setting is begun after as many; run again
    for the rest, which goes on where this one stopped. metric: the figure of FIGURES that the front is of.
    GlbumpError for a folder that cannot be written or holds another scene's; what `Renderer` raises.
    """

    def __init__(
        self,
        scene: Scene,
        directory: str | os.PathLike[str],
        *,
        size: tuple[int, int] = (256, 256),
        base: str | Quality = "balanced",
        samples: int = 64,
        minutes: float = 10.0,
        metric: str = "rmse",
        backend: str = "auto",
    ) -> None:
        check.instance("scene", scene, Scene)
        self.metric = check.choice("metric", metric, METRICS)
        self.samples = Quality("exact", samples=check.integer("samples", samples, least=4, most=4096)).samples
        self._until = time.monotonic() + 60 * check.number("minutes", minutes, least=0, most=1e6)
        self._seconds = min(60.0, 15 * minutes)
        # A computed sky takes the reference some ten seconds a setting.
        self._predicting = 30 * minutes
        self._gain = 1.0
        size, base = check_size(size), quality_of(base)
        self.results = Results(directory, scene_key(scene))
        self.bench = Bench(scene, size, base, backend)
        try:
            self.settings = self._planned()
        except BaseException:
            self.bench.__exit__()
            raise
        worth = [setting for setting in self.settings if not setting.skipped]
        self.total = len(worth) + COMBINATIONS + 1

    def __enter__(self) -> Sweep:
        return self

    def __exit__(self, *_: object) -> None:
        self.bench.__exit__()

    def _planned(self) -> list[Setting]:
        bench = self.bench
        return [
            *presets(bench.base),
            *one_at_a_time(bench.base, bench.plan),
            *left_out(bench.scene, bench.base, lambda scene, quality: bench.plan(quality, scene)),
        ]

    def run(self, step: Callable[[], None] = lambda: None) -> Trade:
        """All of it. step: called after the truth and after each setting."""
        bench = self.bench
        about = {"size": bench.size, "samples": self.samples, "version": _version()}
        bench.truth = self.results.truth(
            digest(about | {"driver": bench.driver, "scene": self.results.scene}),
            lambda: find_truth(bench.scene, bench.size, self.samples, bench.renderer, seconds=self._seconds),
        )
        about["truth"] = bench.truth.source
        model = self._model(bench.truth)
        step()
        rows: list[Row] = []
        skipped: list[Setting] = []
        left: list[str] = []

        def measure(settings: list[Setting]) -> None:
            for setting in settings:
                if setting.skipped:
                    skipped.append(setting)
                    continue
                try:
                    row = self._row(setting, about, model)
                except LimitError as why:
                    skipped.append(replace(setting, skipped=str(why)))
                else:
                    left.extend([] if row else [setting.name])
                    rows.extend([row] if row else [])
                step()

        measure(self.settings)
        measure(combinations(bench.base, rows, self.metric, COMBINATIONS, bench.plan))
        choices = [asdict(choice) for choice in bench.plan(bench.base).choices]
        best = _front(rows, self.metric)
        return Trade(
            scene=self.results.scene,
            size=bench.size,
            driver=bench.driver,
            base=bench.base,
            metric=self.metric,
            truth=bench.truth,
            rows=rows,
            skipped=skipped,
            left=left,
            explain=choices,
            front=best,
        )

    def _model(self, truth: Truth) -> Model | None:
        """Of the scene's errors; None where they cannot be predicted."""
        bench = self.bench
        try:
            return Model(bench.scene, bench.size, truth.pixels, bench.base, bench.plan, bench.renderer.contents)
        except GlbumpError:
            return None

    def _row(self, setting: Setting, about: dict[str, Any], model: Model | None) -> Row | None:
        """A setting's row: the one that was kept, or measured now; None when time is up. The base always is."""
        bench = self.bench
        named = {"name": setting.name if setting.kind == FEATURE else None, "base": asdict(bench.base)}
        key = digest(about | named | {"quality": asdict(setting.quality), "driver": bench.driver})
        own = {"name": setting.name, "kind": setting.kind, "changes": setting.changes}
        kept = self.results.get(key)
        if kept is not None and all((self.results.directory / name).is_file() for name in kept["pictures"].values()):
            self._gain = kept["gain"]  # The base comes first.
            return kept | own
        if setting.kind != BASE and time.monotonic() > self._until:
            return None
        started = time.monotonic()
        predicted = _predicted(setting, model) if setting.kind == BASE or self._predicting > 0 else None
        self._predicting -= time.monotonic() - started
        measured = bench.measure(setting.quality, setting.scene)
        if setting.kind == BASE:
            self._gain = gain_for(measured.error["p99"] or 0.0)
        return self.results.add(
            own
            | {
                "key": key,
                "driver": bench.driver,
                "quality": asdict(setting.quality),
                "plan": measured.plan,
                "error": measured.error,
                "predicted": predicted,
                "cost": measured.cost,
                "gain": self._gain,
                "pictures": self._pictures(key, measured, self._gain),
            }
        )

    def _pictures(self, key: str, measured: Measured, gain: float) -> dict[str, str]:
        assert self.bench.truth is not None
        black = np.zeros_like(measured.pixels)
        black[..., 3] = 1
        shown = {
            "picture": difference_picture(measured.pixels, black, 1.0),
            "error": difference_picture(measured.pixels, self.bench.truth.pixels, gain),
        }
        names = {what: f"pictures/{key}-{what}.png" for what in shown}
        for what, pixels in shown.items():
            write_display(self.results.directory / names[what], eight_bit(pixels))
        return names


def gain_for(error: float) -> float:
    """How much pictures of errors magnify, so that one of `error` is about white: a power of two, 1 to 256."""
    return 2.0 ** min(max(round(-math.log2(max(error, 1e-9))), 0), 8)


def _predicted(setting: Setting, model: Model | None) -> dict[str, Any] | None:
    """What error to expect of a setting, as JSON has it; None of other scenes, and where it cannot be said."""
    if model is None or setting.scene is not None:
        return None
    try:
        return model.predict(setting.quality).facts()
    except GlbumpError:
        return None


def _front(rows: list[Row], metric: str) -> list[str]:
    """Names of the settings that none beats in time and error, the cheapest first."""
    shown = [row for row in rows if row["kind"] != FEATURE and row["error"][metric] is not None]
    points = [(row["cost"]["times"]["median"], row["error"][metric]) for row in shown]
    return [shown[i]["name"] for i in front(points, ALIKE)]


def _version() -> str:
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("glbump")
    except PackageNotFoundError:
        return "unknown"
