"""The command `glbump`: the group, the errors and the exit status; the commands are in `glbump.commands`.

Each command is imported when it is called, and imports what it needs when it runs, so that `glbump render` spends
its time drawing.
"""

from __future__ import annotations

import os
import sys
from typing import NoReturn

import click

from glbump.commands import Commands
from glbump.commands.options import Session
from glbump.errors import ContextError, GlbumpError, ShaderError


@click.group(
    commands=Commands(),
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"]},
)
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
