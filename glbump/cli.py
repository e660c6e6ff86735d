"""The command `glbump`: parses, calls and prints; what it does lies in the modules it calls.

Each command imports what it needs when it runs, so that `glbump render` spends its time drawing.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import click

from glbump.errors import ContextError, GlbumpError, ShaderError
from glbump.progress import progress

if TYPE_CHECKING:
    from glbump.demo import Exhibit
    from glbump.frame import Frame


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


def _size(text: str) -> tuple[int, int]:
    width, cross, height = text.partition("x")
    try:
        return int(width), int(height if cross else width)
    except ValueError:
        raise ValueError(f"a size is WIDTHxHEIGHT in pixels, as 512x512; got {text!r}") from None


def _error(text: str) -> float:
    top, slash, bottom = text.partition("/")
    try:
        value = float(top) / (float(bottom) if slash else 1)
    except ValueError:
        raise ValueError(f"an error is a number or a fraction, as 0.01 or 2/255; got {text!r}") from None
    if not 0 <= value <= 1:
        raise ValueError(f"an error lies within 0 and 1, of display white; got {text!r}")
    return value


def _quality(word: str) -> str:
    from glbump.quality import Quality

    return Quality(word).preset


def _tone(word: str) -> str:
    from glbump.maps.images import TONES
    from glbump.validate import choice

    return choice("tone", word, TONES)


def _exhibits(names: tuple[str, ...]) -> tuple[Exhibit, ...]:
    from glbump.demo import chosen

    return chosen(names)


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


def _print_json(value: Any) -> None:
    click.echo(json.dumps(_plain(value), indent=2, allow_nan=False))


size_option = click.option(
    "--size", default="512x512", metavar="WxH", callback=checked(_size), help="Pixels; default 512x512."
)
quality_option = click.option(
    "--quality",
    default="balanced",
    metavar="Q",
    callback=checked(_quality),
    help="fast, balanced (default) or exact.",
)
backend_option = click.option(
    "--backend", metavar="B", help="auto (default), egl, osmesa or window; or set GLBUMP_BACKEND."
)
tone_option = click.option(
    "--tone",
    default="clip",
    metavar="T",
    callback=checked(_tone),
    help="Tone curve of PNG and JPEG: clip (default), reinhard or filmic.",
)
exposure_option = click.option(
    "--exposure", type=float, default=0.0, metavar="E", help="Stops, of PNG and JPEG; default 0."
)
json_option = click.option("--json", "as_json", is_flag=True, help="Print figures as JSON.")


@click.group(invoke_without_command=True, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="glbump", message="%(prog)s %(version)s")
@click.pass_context
def cli(context: click.Context) -> None:
    """Surfaces that mirror an environment and carry bumps, drawn with OpenGL, with no display needed.

    \b
    glbump demo                           the gallery, into out/
    glbump render scene.toml -o ball.png  one picture
    glbump doctor                         what OpenGL there is here
    """
    if context.invoked_subcommand is None:
        click.echo(context.get_help())
        context.exit(2)


def _render(session: Session, call: Callable[[], Frame], label: str) -> Frame:
    with progress(label, shown=not session.quiet):
        return call()


@cli.command()
@click.argument("scene", type=click.Path(path_type=Path))
@click.option("-o", "--output", required=True, type=click.Path(path_type=Path), help=".png .jpg .exr .hdr .tif")
@size_option
@quality_option
@backend_option
@click.option("--set", "settings", multiple=True, metavar="A.B=V", help="Change a value of the scene (TOML).")
@tone_option
@exposure_option
@click.option("--reference", is_flag=True, help="Ray-cast in float64 NumPy, without OpenGL: slow and exact.")
@click.option("--samples", type=click.IntRange(min=1), metavar="N", help="Samples a pixel of --reference.")
@json_option
@common
def render(
    session: Session,
    scene: Path,
    output: Path,
    size: tuple[int, int],
    quality: str,
    backend: str | None,
    settings: tuple[str, ...],
    tone: str,
    exposure: float,
    reference: bool,
    samples: int | None,
    as_json: bool,
) -> None:
    """Draw one picture of a scene file.

    \b
    glbump render scene.toml -o ball.png --size 1024x1024
    glbump render scene.toml -o ball.exr --set surface.0.bump.amplitude=0.1
    glbump render scene.toml -o truth.png --reference --samples 64
    """
    from glbump.maps.files import check_target
    from glbump.scene import check_size
    from glbump.scenefile import files_of, load_scene, set_from_text

    if samples is not None and not reference:
        raise click.UsageError("--samples is of --reference; choose --quality otherwise")
    size = check_size(size)
    content = set_from_text(load_scene(scene), *settings)
    check_target(output, tone=tone, exposure=exposure, inputs=files_of(content))

    if reference:
        from glbump.reference import render as render_reference

        frame = _render(session, lambda: render_reference(content, size=size, samples=samples or 16), "casting rays")
    else:
        from glbump.gl.renderer import render as render_gl

        frame = _render(
            session, lambda: render_gl(content, size=size, quality=quality, backend=backend or "auto"), "drawing"
        )
    frame.save(output, tone=tone, exposure=exposure)
    if as_json:
        _print_json({"path": output, "size": frame.size, "stats": frame.stats})
    else:
        session.say(f"{output}  {frame.size[0]}x{frame.size[1]}")
    for note in frame.stats.get("notes", ()):
        session.note(note)


@cli.command()
@click.option("-o", "--output", type=click.Path(path_type=Path), default=Path("out"), help="Folder; default out.")
@click.option(
    "--only",
    metavar="NAME",
    multiple=True,
    callback=checked(_exhibits),
    help="This picture alone; may be given again.",
)
@quality_option
@backend_option
@common
def demo(session: Session, output: Path, only: tuple[Exhibit, ...], quality: str, backend: str | None) -> None:
    """Draw the gallery: pictures, and the scene files they are drawn from, to start one's own.

    \b
    glbump demo
    glbump demo -o gallery --only brick-ball
    glbump render gallery/scenes/brick-ball.toml -o larger.png --size 1024x1024
    """
    from glbump.demo import write_gallery
    from glbump.gl.renderer import Renderer

    with (
        progress("drawing the gallery", len(only), shown=not session.quiet) as step,
        Renderer(backend=backend or "auto") as renderer,
    ):
        for picture, exhibit in write_gallery(output, only, renderer.render, quality):
            step()
            session.say(f"{picture}  {exhibit.title}")


@cli.command()
@click.argument("a", type=click.Path(path_type=Path))
@click.argument("b", type=click.Path(path_type=Path))
@click.option("-o", "--output", type=click.Path(path_type=Path), help="A picture of the difference.")
@click.option("--gain", type=float, default=8.0, metavar="G", help="How much -o magnifies; default 8.")
@click.option(
    "--max", "most", metavar="E", callback=checked(_error), help="Fail where a pixel differs by more, as 2/255."
)
@json_option
@common
def diff(
    session: Session, a: Path, b: Path, output: Path | None, gain: float, most: float | None, as_json: bool
) -> None:
    """Compare two pictures as a display shows them: sRGB, 0 to 1.

    \b
    glbump diff got.png wanted.png
    glbump diff got.exr wanted.exr -o difference.png --max 2/255
    """
    from glbump.maps.files import check_target
    from glbump.maps.images import read_picture
    from glbump.trade.metrics import compare, difference_picture

    if output is not None:
        check_target(output, inputs=(a, b))
    first, second = read_picture(a).pixels, read_picture(b).pixels
    with progress("comparing", shown=not session.quiet):
        figures = compare(first, second)
    if output is not None:
        from glbump.maps.colour import eight_bit
        from glbump.maps.files import write_display

        write_display(output, eight_bit(difference_picture(first, second, gain)))
    if as_json:
        _print_json(figures)
    else:
        notes = figures.pop("notes")
        for name, value in figures.items():
            shown = notes.get(name, "-") if value is None else f"{value:.6g}" if name != "worst" else value
            session.say(f"{name:5}  {shown}")
    if most is not None and figures["max"] > most:
        raise GlbumpError(f"{a} and {b} differ by up to {figures['max']:.4g} of display white; --max allows {most:.4g}")


@cli.command()
@click.option("--stability", is_flag=True, help="Try the formulas at their extremes on this driver instead.")
@json_option
@common
def doctor(session: Session, stability: bool, as_json: bool) -> None:
    """Say what OpenGL there is here, what it really does, and what to do where it is missing.

    \b
    glbump doctor
    glbump doctor --json
    glbump doctor --stability
    """
    if stability:
        _stability(session, as_json)
        return
    from glbump.gl.doctor import healthy, report, text

    with progress("trying every route to OpenGL", shown=not session.quiet):
        findings = report()
    if as_json:
        _print_json(findings)
    else:
        click.echo(text(findings))
    if not healthy(findings):
        click.get_current_context().exit(1)


def _stability(session: Session, as_json: bool) -> None:
    from glbump.gl.context import open_context
    from glbump.gl.stability import Row, stability_report, stability_text
    from glbump.glsltest.stability import report

    with open_context() as context, progress("trying the extremes", shown=not session.quiet):
        formulas = [Row(m.extreme.name, m.naive, m.used, m.extreme.bound, m.extreme.unit) for m in report(context)]
        rows = formulas + stability_report(context)
    if as_json:
        # An infinite error is no JSON number: null.
        _print_json(
            [
                {"name": r.name, "naive": r.naive, "glbump": r.used, "bound": r.bound, "unit": r.unit, "holds": r.holds}
                for r in rows
            ]
        )
    else:
        click.echo(stability_text(rows))
    if not all(row.holds for row in rows):
        click.get_current_context().exit(1)


def _fail(message: object, code: int) -> int:
    """What went wrong, on standard error: one line, except where no OpenGL was found and a table says what was
    tried. A name in it may come from a stranger's file: what a terminal would obey is spelt out."""
    if isinstance(message, ContextError):
        lines = str(message).splitlines()
    elif isinstance(message, ShaderError):
        first, *more = str(message).splitlines()
        lines = [f"{first} (--debug shows the source around it)" if more else first]
    else:
        lines = [" ".join(str(message).split())]
    text = "\n".join(lines).encode("utf-8", "backslashreplace").decode()
    shown = "".join(c if c.isprintable() or c == "\n" else f"\\x{ord(c):02x}" for c in text)
    click.echo(f"glbump: error: {shown}", err=True)
    return code


def run(arguments: list[str]) -> int:
    """Carry out a command line; the exit status: 0 done, 2 a wrong call, 130 interrupted, 1 otherwise."""
    session = Session()
    try:
        with cli.make_context("glbump", list(arguments), obj=session) as context:
            cli.invoke(context)
        sys.stdout.flush()
    except click.exceptions.Exit as leave:
        return leave.exit_code
    except click.UsageError as error:
        where = error.ctx.command_path if error.ctx else "glbump"
        return _fail(f"{error.format_message()} (see: {where} --help)", 2)
    except KeyboardInterrupt:
        click.echo("glbump: interrupted", err=True)
        return 130
    except BrokenPipeError:
        # Whoever read us has left; Python's own flush at exit would complain once more.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except Exception as error:
        if session.debug:
            raise
        if isinstance(error, GlbumpError):
            return _fail(error, 1)
        if isinstance(error, OSError) and error.strerror:
            return _fail(f"{error.strerror}: {error.filename}" if error.filename else error.strerror, 1)
        if isinstance(error, MemoryError):
            return _fail("out of memory; choose a smaller --size", 1)
        return _fail(f"a defect of glbump, please report it: {type(error).__name__}: {error} (--debug shows where)", 1)
    return 0


def main() -> NoReturn:
    """Entry point of the command."""
    sys.exit(run(sys.argv[1:]))
