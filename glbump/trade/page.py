"""The trade as one HTML page that needs no other file."""

from __future__ import annotations

import base64
from collections.abc import Iterable
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from glbump.maps.colour import eight_bit, srgb_from_linear
from glbump.maps.files import png_bytes
from glbump.maps.images import read_picture
from glbump.quality import KNOBS
from glbump.trade.errors import FIGURES
from glbump.trade.features import explained
from glbump.trade.model import FACTOR, factor
from glbump.trade.settings import BASE, COMBINATION, FEATURE, KNOB, PRESET
from glbump.trade.sweep import Trade

THUMBNAIL = 112
"""Most pixels along a side of the page's small pictures."""

LITTLE = 0.03
"""Errors and times that differ by less from the base's are called the same."""

Row = dict[str, Any]

_SHOWN = ("rmse", "p99", "p999", "max", "flip", "linear_rmse", "silhouette", "normal")
_STYLE = """
body{font:15px/1.45 sans-serif;color:#222;max-width:76rem;margin:2rem auto;padding:0 1rem}
h1{font-size:1.6rem}h2{font-size:1.2rem;margin-top:2.2rem;border-bottom:1px solid #ddd}
table{border-collapse:collapse;font-size:13px}th,td{padding:.25rem .5rem;text-align:right;vertical-align:middle}
th{border-bottom:1px solid #888;font-weight:600}td{border-bottom:1px solid #eee}
td.l,th.l{text-align:left}tr.best{background:#f2f7ec}tr.base{background:#eef3fa}
code{font-size:13px}.n{color:#777}svg{max-width:100%;height:auto}
p.note{background:#fff6dd;padding:.4rem .7rem}
"""


def page(trade: Trade, directory: Path, title: str, plot: str) -> str:
    """HTML of a trade. directory: where the rows' pictures are. plot: its front, as SVG."""
    base = trade.of(BASE)[0]
    draw = _Table(trade, base, directory)
    parts = [
        f"<h1>{escape(title)}: what each knob buys, and what it costs</h1>",
        *_about(trade, base),
        "<h2>The front</h2>",
        f"<p>Each point is a setting; none beats those on the line in both time and {escape(trade.metric)}.</p>",
        plot,
        draw.table(
            [row for name in trade.front for row in trade.rows if row["name"] == name and row["kind"] != FEATURE]
        ),
        "<h2>The presets</h2>",
        draw.table([base, *trade.of(PRESET)]),
        "<h2>One knob at a time</h2>",
        f"<p>All other knobs are as in the base, <b>{escape(base['name'])}</b>.</p>",
    ]
    for knob, what in KNOBS.items():
        rows = [row for row in trade.of(KNOB) if knob in row["changes"]]
        parts.append(f"<h3><code>{knob}</code>: {escape(what.effect)}</h3>")
        if rows:
            parts.append(draw.table([base, *rows], named=lambda row, knob=knob: _value(row, knob)))
        parts.append(_skipped(trade, knob, alone=not rows))
    parts += [
        "<h2>Several knobs together</h2>",
        "<p>Settings that the rows above promise most of, measured.</p>",
        draw.table(trade.of(COMBINATION)),
        "<h2>The error model</h2>",
        *_model(trade),
        "<h2>What the plan leaves out</h2>",
        "<p>Each is forced on by a change of the scene that leaves its picture as it is, to show what it would have "
        "bought, and what leaving it out saves.</p>",
        draw.table([base, *trade.of(FEATURE)], named=_feature),
        "<h2>What the plan chose, and why</h2>",
        _choices(trade),
        "<h2>The figures, and what each cannot see</h2>",
        _legend(base["gain"]),
    ]
    head = f'<meta charset="utf-8"><title>{escape(title)}: the trade</title><style>{_STYLE}{draw.styles()}</style>'
    return f'<!doctype html><html lang="en"><head>{head}</head><body>{"".join(parts)}</body></html>\n'


def _about(trade: Trade, base: Row) -> Iterable[str]:
    truth, cost = trade.truth, base["cost"]
    width, height = trade.size
    yield (
        f"<p>{width}x{height} pixels, drawn by <b>{escape(trade.driver)}</b>. Errors are against "
        + ("the float64 reference" if truth.source == "reference" else "this driver's own picture at exact")
        + f" with {truth.samples} samples a pixel, which may itself be off by {255 * truth.noise:.2g}/255 RMSE. "
        f"Times are by {escape(cost['clock'])}, each setting's frames in turns with the base's; "
        "ratios are medians of turns, with quartiles, and milliseconds the base's times these.</p>"
    )
    for note in truth.notes:
        yield f'<p class="note">{escape(note)}</p>'
    if trade.left:
        yield (
            f'<p class="note">Time ran out before {len(trade.left)} settings: {escape(", ".join(trade.left))}. '
            "Run it again for the rest.</p>"
        )


class _Table:
    """Rows as HTML, each with its small pictures."""

    def __init__(self, trade: Trade, base: Row, directory: Path) -> None:
        self._trade, self._base, self._directory = trade, base, directory
        self._ms = (base["cost"]["gpu"] or base["cost"]["frame"])["median"]
        self._shown: dict[str, str] = {}

    def table(self, rows: list[Row], named: Any = None) -> str:
        if not rows:
            return "<p>None.</p>"
        heads = "".join(f"<th>{name}</th>" for name in map(_head, _SHOWN))
        return (
            '<table><tr><th></th><th class="l">error</th><th class="l">setting</th><th class="l">buys and costs</th>'
            f"<th>predicted rmse /255</th>{heads}<th>ms</th><th>times</th><th>first, ms</th><th>MB</th></tr>"
            + "".join(self._row(row, named or _named) for row in rows)
            + "</table>"
        )

    def _row(self, row: Row, named: Any) -> str:
        cost, error = row["cost"], row["error"]
        kind = "base" if row["kind"] == BASE else "best" if row["name"] in self._trade.front else ""
        figures = "".join(f"<td>{_number(error[f], FIGURES[f].scale)}</td>" for f in _SHOWN)
        times = cost["times"]
        spread = f'<span class="n">{times["low"]:.2f} to {times["high"]:.2f}</span>'
        return (
            f'<tr class="{kind}"><td>{self._image(row, "picture")}</td><td>{self._image(row, "error")}</td>'
            f'<td class="l">{named(row)}</td><td class="l">{escape(self.says(row))}</td>'
            f"<td>{_foretold(row)}</td>{figures}"
            f"<td>{self._ms * times['median']:.3g}</td><td>{times['median']:.2f}<br>{spread}</td>"
            f"<td>{cost['first']:.0f}</td><td>{cost['bytes'] / 1e6:.2f}</td></tr>"
        )

    def says(self, row: Row) -> str:
        """What a setting buys beside the base, and what it costs."""
        return "" if row["kind"] == BASE else says(row, self._base, self._trade.metric)

    def _image(self, row: Row, what: str) -> str:
        name = f"{what[0]}{row['key']}"
        if name not in self._shown:
            shown = read_picture(self._directory / row["pictures"][what]).pixels
            pixels = _smaller(eight_bit(srgb_from_linear(shown)), largest=what == "error")
            data = base64.b64encode(png_bytes(pixels)).decode()
            size = f"width:{pixels.shape[1]}px;height:{pixels.shape[0]}px"
            self._shown[name] = f".{name}{{{size};background:url(data:image/png;base64,{data})}}"
        return f'<div class="{name}" role="img" aria-label="{what} of {escape(row["name"])}"></div>'

    def styles(self) -> str:
        """The pictures of all tables made so far, each once, however often it is shown."""
        return "\n".join(self._shown.values())


def says(row: Row, base: Row, metric: str) -> str:
    """What a setting buys beside the base, and what it costs: one sentence."""
    figure, was, now = FIGURES[metric], base["error"][metric], row["error"][metric]
    times = row["cost"]["times"]["median"]
    scale = figure.scale
    if now == was:
        buys = "the same error"
    elif was is None or now is None or was == 0 or abs(now / was - 1) < LITTLE:
        buys = "no less error" if was is not None and now is not None and now >= was else "hardly less error"
    else:
        buys = f"{'less' if now < was else 'more'} error, {scale * was:.3g} to {scale * now:.3g}"
    more = (row["cost"]["bytes"] - base["cost"]["bytes"]) / 1e6
    memory = "" if abs(more) < 0.05 else f", {abs(more):.2g} MB {'more' if more > 0 else 'less'}"
    takes = "as long" if abs(times - 1) < LITTLE else f"{times:.2f} times as long"
    return f"{buys}; takes {takes}{memory}"


def _foretold(row: Row) -> str:
    """The RMSE that was predicted, and how many times what was measured."""
    said = row.get("predicted")
    if not said:
        return "-"
    measured = row["error"]["rmse"]
    off = factor(measured, said["rmse"])
    times = f"{said['rmse'] / measured:.2f} times" if measured > 0 else ""
    return f'{255 * said["rmse"]:.3g}<br><span class="n">{f"<b>{times}</b>" if off > FACTOR else times}</span>'


def _model(trade: Trade) -> Iterable[str]:
    """Predicted beside measured, and where the model is off."""
    noise = trade.truth.noise
    foretold = [row for row in trade.rows if row.get("predicted")]
    rows = [row for row in foretold if not max(row["error"]["rmse"], row["predicted"]["rmse"]) < noise]
    if not foretold:
        yield "<p>Nothing was predicted: errors of captured surroundings are not.</p>"
        return
    off = [factor(row["error"]["rmse"], row["predicted"]["rmse"]) for row in rows]
    near = sum(f <= FACTOR for f in off)
    yield (
        f"<p>Before it was drawn, the RMSE of each setting was predicted from the scene's own light on tiles. Of "
        f"{len(rows)} settings {near} ({near / max(len(rows), 1):.0%}) are within {FACTOR:g} times of what was "
        f"measured; {len(foretold) - len(rows)} more are nearer to the truth than it is certain, by either.</p>"
    )
    worst = [row for f, row in sorted(zip(off, rows), key=lambda pair: -pair[0]) if f > FACTOR]
    if worst:
        heads = "".join(f'<th class="l">{name}</th>' for name in ("the model is off", "measured", "predicted", "of"))
        yield f"<table><tr>{heads}</tr>{''.join(map(_off, worst[:12]))}</table>"
    for said in dict.fromkeys(said for row in rows for said in row["predicted"]["missing"]):
        yield f"<p>Not in it: {escape(said)}.</p>"


def _off(row: Row) -> str:
    said = row["predicted"]
    parts = ", ".join(f"{part['knobs'][0]} {255 * part['rmse']:.3g}" for part in said["parts"][:3])
    between = f"{255 * said['low']:.3g} to {255 * said['high']:.3g}"
    return (
        f'<tr><td class="l">{_named(row)}</td><td>{255 * row["error"]["rmse"]:.3g}</td>'
        f'<td>{255 * said["rmse"]:.3g}<br><span class="n">{between}</span></td><td class="l">{escape(parts)}</td></tr>'
    )


def _value(row: Row, knob: str) -> str:
    if row["kind"] == BASE:
        return f"<b>{escape(str(row['quality'][knob]))}</b>, the base"
    return f"<code>{escape(str(row['changes'][knob]))}</code>"


def _named(row: Row) -> str:
    return "<br>".join(f"<code>{escape(part)}</code>" for part in row["name"].split(" "))


def _feature(row: Row) -> str:
    if row["kind"] == BASE:
        return "<b>left out</b>, as the plan has it"
    return f"<b>{escape(row['name'])}</b><br>{escape(explained(row['name']))}"


def _skipped(trade: Trade, knob: str, alone: bool) -> str:
    """Why values of a knob were not measured."""
    why: dict[str, list[str]] = {}
    for setting in trade.skipped:
        if setting.kind == KNOB and knob in setting.changes:
            why.setdefault(setting.skipped, []).append(str(setting.changes[knob]))
    if alone and list(why) == ["nothing here depends on it"]:
        return "<p>Nothing here depends on it.</p>"
    return "".join(f"<p>{escape(', '.join(values))}: {escape(reason)}.</p>" for reason, values in why.items())


def _choices(trade: Trade) -> str:
    rows = "".join(
        f'<tr><td class="l">{escape(c["what"])}</td><td class="l">{escape(c["value"])}</td>'
        f'<td class="l">{escape(c["why"])}</td></tr>'
        for c in trade.explain
    )
    return f'<table><tr><th class="l">choice</th><th class="l"></th><th class="l">why</th></tr>{rows}</table>'


def _legend(gain: float) -> str:
    rows = "".join(
        f'<tr><td class="l"><code>{name}</code></td><td class="l">{escape(f.what)}; {escape(f.unit)}</td>'
        f'<td class="l">{escape(f.blind)}</td></tr>'
        for name, f in FIGURES.items()
    )
    magnified = f"<p>Pictures of errors show {gain:g} times the difference of what a display shows.</p>"
    heads = '<tr><th class="l">figure</th><th class="l">is</th><th class="l">cannot see</th></tr>'
    return f"{magnified}<table>{heads}{rows}</table>"


def _head(name: str) -> str:
    return name.replace("linear_", "linear ") + (" /255" if FIGURES[name].scale == 255 else "")


def _number(value: float | None, scale: float) -> str:
    return "-" if value is None else f"{scale * value:.3g}"


def _smaller(pixels: npt.NDArray[np.uint8], largest: bool) -> npt.NDArray[np.uint8]:
    """Shrunk by a whole number to THUMBNAIL pixels at most; `largest` keeps what is worst of each block."""
    step = -(-max(pixels.shape[:2]) // THUMBNAIL)
    height, width = (n // step * step for n in pixels.shape[:2])
    blocks = pixels[:height, :width].reshape(height // step, step, width // step, step, -1)
    made = blocks.max(axis=(1, 3)) if largest else blocks.mean(axis=(1, 3))
    return np.ascontiguousarray(made, np.uint8)
