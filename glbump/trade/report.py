"""A trade for people and for machines: a table, JSON, a plot, and one page that needs no other file."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path
from typing import Any

from glbump.errors import GlbumpError
from glbump.maps.files import write_atomically
from glbump.scene import Scene
from glbump.trade.errors import FIGURES
from glbump.trade.page import page
from glbump.trade.plots import Point, front_svg
from glbump.trade.results import plain, scene_key
from glbump.trade.settings import BASE, FEATURE, KNOB
from glbump.trade.sweep import Trade

CSV, JSON, PLOT, PAGE = "trade.csv", "trade.json", "front.svg", "trade.html"

_PREDICTED = ("rmse", "low", "high")
_COSTS = ("frame", "draw", "read", "gpu", "times", "cpu")


def write_report(trade: Trade, directory: Path, title: str) -> list[Path]:
    """Write all four into the trade's folder, each whole or not at all. title: of the page. GlbumpError where that
    cannot be."""
    svg = plot(trade)
    texts = {
        CSV: table(trade),
        JSON: json.dumps(plain(trade.facts() | {"title": title}), indent=1, allow_nan=False) + "\n",
        PLOT: svg + "\n",
        PAGE: page(trade, directory, title, svg),
    }
    for name, text in texts.items():
        write_atomically(directory / name, text.encode(), error=GlbumpError)
    return [directory / name for name in texts]


def plot(trade: Trade) -> str:
    """The front as SVG: milliseconds of a frame, as the base's median times each row's ratio, against the metric."""
    figure = FIGURES[trade.metric]
    base = trade.of(BASE)[0]["cost"]
    median = (base["gpu"] or base["frame"])["median"]
    points = []
    for row in trade.rows:
        error = row["error"][trade.metric]
        if row["kind"] != FEATURE and error is not None:
            series = next(iter(row["changes"])) if row["kind"] == KNOB else row["kind"]
            cost = median * row["cost"]["times"]["median"]
            points.append(Point(row["name"], series, cost, figure.scale * error, row["name"] in trade.front))
    floor = figure.scale * trade.truth.noise if trade.metric == "rmse" and trade.truth.noise > 0 else 0.0
    clock = "of the GPU's clock" if base["gpu"] else "a frame, wall clock"
    return front_svg(points, f"ms {clock}", f"{trade.metric} {figure.unit}", floor)


def table(trade: Trade) -> str:
    """CSV: a row a setting, skipped ones with the reason."""
    made = io.StringIO()
    errors = list(FIGURES)
    costs = [f"{name}_{part}" for name in _COSTS for part in ("median", "low", "high")]
    first = ["first", "open", "set_up", "upload", "first_draw", "bytes", "turns"]
    writer = csv.writer(made, lineterminator="\n")
    guessed = [f"predicted_{name}" for name in _PREDICTED]
    named = ["driver", "size", "kind", "name", "on_front"]
    writer.writerow([*named, *errors, *guessed, *costs, *first, "clock", "skipped"])
    about = [trade.driver, "x".join(map(str, trade.size))]
    for row in trade.rows:
        cost = row["cost"]
        spreads = [(cost[name] or {}).get(part, "") for name in _COSTS for part in ("median", "low", "high")]
        figures = ["" if row["error"][name] is None else row["error"][name] for name in errors]
        own = [row["kind"], row["name"], int(row["name"] in trade.front)]
        figures += [(row.get("predicted") or {}).get(name, "") for name in _PREDICTED]
        writer.writerow([*about, *own, *figures, *spreads, *(cost[name] for name in first), cost["clock"], ""])
    for setting in trade.skipped:
        empty = [""] * (len(errors) + len(guessed) + len(costs) + len(first) + 1)
        writer.writerow([*about, setting.kind, setting.name, 0, *empty, setting.skipped])
    return made.getvalue()


def read_facts(directory: Path, scene: Scene) -> dict[str, Any]:
    """What a trade wrote of this scene, as `Trade.facts` has it. GlbumpError where there is none, or of another."""
    path = directory / JSON
    try:
        facts = json.loads(path.read_text(encoding="utf-8"))
        key, _ = facts["scene"], facts["rows"][0]["plan"]
    except (OSError, ValueError, LookupError, TypeError):
        raise GlbumpError(f"{path}: is no trade; glbump trade SCENE -o {directory} makes one") from None
    if key != scene_key(scene):
        raise GlbumpError(f"{directory}: is the trade of another scene, or of this one before it was changed")
    return facts


def evidence(measured: dict[str, Any], plan: dict[str, str]) -> dict[str, list[str]]:
    """By the name of a plan's choice, what a trade has measured of the other ways: sentences.

    measured: the facts of a trade, as its JSON has them. plan: choices by name; those rows count whose knob changes the
    choice from what it is here.
    """
    base = next(row for row in measured["rows"] if row["kind"] == BASE)
    metric = measured["metric"]
    figure = FIGURES[metric]
    found: dict[str, list[str]] = {}
    for row in measured["rows"]:
        if row["kind"] not in (KNOB, FEATURE):
            continue
        for what, value in row["plan"].items():
            if what in plan and plan[what] == base["plan"].get(what) != value:
                cost = row["cost"]
                more = (cost["bytes"] - base["cost"]["bytes"]) / 1e6
                error = figure.scale * row["error"][metric]
                found.setdefault(what, []).append(
                    f"{row['name']}: {value}; {metric} {figure.scale * base['error'][metric]:.3g} -> {error:.3g} "
                    f"{figure.unit}, {cost['times']['median']:.3g} times the time, {more:+.3g} MB"
                )
    return found
