"""What several commands share: the options, the session they say things in, figures as JSON."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from glbump.errors import GlbumpError

if TYPE_CHECKING:
    from glbump.quality import Quality


@dataclass
class Session:
    """What the options that every command has say."""

    quiet: bool = False
    debug: bool = False

    def say(self, text: str) -> None:
        """One line for people, on standard output."""
        if not self.quiet:
            click.echo(text)

    def note(self, text: str) -> None:
        """One line about what was found and mended, on standard error."""
        if not self.quiet:
            click.echo(f"glbump: note: {text}", err=True)


def common(command: Callable[..., Any]) -> Callable[..., Any]:
    """-q and --debug, kept in the session."""

    def keep(name: str) -> Callable[[click.Context, click.Parameter, bool], None]:
        return lambda context, _, value: setattr(context.obj, name, value)

    for flags, name, text in (
        (("--debug",), "debug", "Show the traceback of an error."),
        (("-q", "--quiet"), "quiet", "Print nothing but errors and what was asked for."),
    ):
        option = click.option(*flags, is_flag=True, expose_value=False, callback=keep(name), help=text)
        command = option(command)
    return click.pass_obj(command)


def checked(check: Callable[[Any], Any]) -> Callable[[click.Context, click.Parameter, Any], Any]:
    """A wrong word in an option is a wrong call (exit 2), said in the words of glbump's own check."""

    def callback(_context: click.Context, _parameter: click.Parameter, value: Any) -> Any:
        if value is None:
            return None
        try:
            return check(value)
        except (GlbumpError, ValueError, ZeroDivisionError) as error:
            raise click.BadParameter(str(error)) from error

    return callback


def word(what: str, module: str, names: str) -> Callable[[click.Context, click.Parameter, Any], Any]:
    """`checked`, of a word against the names that a module of glbump has, imported when there is a word."""

    def check(value: str) -> str:
        from importlib import import_module

        from glbump.validate import choice

        return choice(what, value, getattr(import_module(module), names))

    return checked(check)


def _size(text: str) -> tuple[int, int]:
    width, cross, height = text.partition("x")
    try:
        return int(width), int(height if cross else width)
    except ValueError:
        raise ValueError(f"a size is WIDTHxHEIGHT in pixels, as 512x512; got {text!r}") from None


def _error(text: str) -> float:
    """0.002, or 0.5/255: of display white."""
    top, slash, bottom = text.partition("/")
    try:
        value = float(top) / (float(bottom) if slash else 1)
    except ValueError:
        raise ValueError(f"an error is a number or a fraction, as 0.01 or 2/255; got {text!r}") from None
    if not 0 <= value <= 1:
        raise ValueError(f"an error lies within 0 and 1, of display white; got {text!r}")
    return value


def _quality(word: str) -> str | Quality:
    """A preset's name, or what a quality file says."""
    if word.endswith(".toml"):
        from glbump.qualityfile import load_quality

        return load_quality(word)
    from glbump.quality import Quality

    return Quality(word).preset


def _plain(value: Any) -> Any:
    """`value` as JSON has it: plain numbers, and null for what is not finite."""
    import math
    from dataclasses import asdict, is_dataclass

    if hasattr(value, "tolist"):
        value = value.tolist()
    if is_dataclass(value) and not isinstance(value, type):
        value = asdict(value)
    if isinstance(value, dict):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple | set | frozenset):
        return [_plain(v) for v in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value if isinstance(value, str | int | float | bool | None) else str(value)


def print_json(value: Any) -> None:
    """Figures for machines, on standard output: strict JSON."""
    click.echo(json.dumps(_plain(value), indent=2, allow_nan=False))


def sized(default: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """--size of a picture."""
    says = f"Pixels; default {default}."
    return click.option("--size", default=default, metavar="WxH", callback=checked(_size), help=says)


def scene_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """SCENE and --set: a scene file, and what is changed of it."""
    says = "Change a value of the scene (TOML)."
    command = click.option("--set", "settings", multiple=True, metavar="A.B=V", help=says)(command)
    return click.argument("scene", type=click.Path(path_type=Path))(command)


def read_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """IN, --from and --orientation: the files of an environment, and how they are read."""
    for add in (
        click.option(
            "--orientation",
            default="auto",
            metavar="O",
            callback=word("orientation of cube faces", "glbump.maps.pictured", "READINGS"),
            help="Of the cube that is read: opengl, inside or auto (default).",
        ),
        click.option(
            "--from",
            "source",
            default="auto",
            metavar="LAYOUT",
            callback=word("layout", "glbump.maps.pictured", "LAYOUT_NAMES"),
            help="How IN is laid out; default auto: by header, shape and content.",
        ),
        click.argument("files", nargs=-1, required=True, metavar="IN...", type=click.Path(path_type=Path)),
    ):
        command = add(command)
    return command


error_of_word = checked(_error)
size_option = sized("512x512")
quality_of_word = checked(_quality)
quality_option = click.option(
    "--quality",
    default="balanced",
    metavar="Q",
    callback=quality_of_word,
    help="fast, balanced (default) or exact; or a quality file (.toml), as glbump tune writes.",
)
backend_option = click.option(
    "--backend", metavar="B", help="auto (default), egl, osmesa or window; or set GLBUMP_BACKEND."
)
tone_option = click.option(
    "--tone",
    default="clip",
    metavar="T",
    callback=word("tone", "glbump.maps.images", "TONES"),
    help="Tone curve of PNG and JPEG: clip (default), reinhard or filmic.",
)
exposure_option = click.option(
    "--exposure", type=float, default=0.0, metavar="E", help="Stops, of PNG and JPEG; default 0."
)
json_option = click.option("--json", "as_json", is_flag=True, help="Print figures as JSON.")
