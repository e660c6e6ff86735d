"""The pytest plugin: fixtures `glsl` and `ulp`, and the --glsl- options. Imports nothing until a test asks for it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from glbump.glsltest.glsl import Glsl

_BACKENDS = ("compute", "feedback", "fragment")


def pytest_addoption(parser: pytest.Parser) -> None:
    """The options, in a group of their own."""
    group = parser.getgroup("glsl", "shader tests (glbump)")
    group.addoption(
        "--glsl-backend",
        choices=("auto", *_BACKENDS, "all"),
        default="auto",
        help="how GLSL functions run; all: every test that uses `glsl` once for each way",
    )
    group.addoption(
        "--glsl-required", action="store_true", help="fail, rather than skip, where there is no OpenGL driver"
    )
    group.addoption(
        "--glsl-timeout",
        type=float,
        default=120.0,
        metavar="SECONDS",
        help="stop the run, saying what was running, when one GLSL call lasts longer (default 120; 0: never)",
    )

    group.addoption(
        "--glsl-cov",
        nargs="?",
        const="",
        metavar="FOLDER",
        help="report which blocks and branches of the shaders (below FOLDER) the tests ran",
    )
    group.addoption("--glsl-cov-lcov", metavar="FILE", help="write that report to FILE as lcov")
    group.addoption(
        "--glsl-cov-min", type=float, metavar="PERCENT", help="fail when less of the shaders ran; implies --glsl-cov"
    )
    group.addoption(
        "--glsl-mutants", metavar="PATH", help="seed faults into the GLSL at PATH, and report which the tests kill"
    )
    group.addoption("--glsl-mutants-count", type=int, metavar="N", help="seed N of the faults, drawn at random")
    group.addoption("--glsl-mutants-seed", type=int, default=0, metavar="SEED", help="of that draw (default 0)")
    group.addoption("--glsl-mutants-min", type=float, metavar="PERCENT", help="fail when fewer faults are killed")
    group.addoption("--glsl-mutants-known", metavar="FILE", help="TOML file that explains survivors")


_COVERAGE = pytest.StashKey[Any]()


def pytest_configure(config: pytest.Config) -> None:
    """Coverage and seeded faults begin before the first test, where they are asked for."""
    options = ("--glsl-cov", "--glsl-cov-lcov", "--glsl-cov-min")
    if any(config.getoption(name) is not None for name in options):
        from pathlib import Path

        from glbump.glsltest.coverage import Coverage

        folder = config.getoption("--glsl-cov")
        if folder and not Path(folder).is_dir():
            raise pytest.UsageError(f"--glsl-cov: {folder} is no folder")
        config.stash[_COVERAGE] = Coverage(Path(folder).resolve() if folder else None)
    if (told := config.getoption("--glsl-mutants")) is not None:
        from pathlib import Path

        from glbump.glsltest.mutation_run import MutationRun

        if not Path(told).exists():
            raise pytest.UsageError(f"--glsl-mutants: there is no {told}")
        config.pluginmanager.register(MutationRun(config), "glsl-mutants")


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Files that no test loaded count too; too little coverage fails the run."""
    seen = session.config.stash.get(_COVERAGE, None)
    if seen is None or session.config.getoption("collectonly"):
        return
    from pathlib import Path

    seen.see_folder()
    if target := session.config.getoption("--glsl-cov-lcov"):
        Path(target).write_text(seen.lcov())
    least = session.config.getoption("--glsl-cov-min")
    if least is not None and 100 * seen.share < least and session.exitstatus == pytest.ExitCode.OK:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    """The coverage table."""
    seen = config.stash.get(_COVERAGE, None)
    if seen is None or config.getoption("collectonly"):
        return
    terminalreporter.section("shader coverage")
    for line in seen.table():
        terminalreporter.write_line(line)
    least = config.getoption("--glsl-cov-min")
    if least is not None:
        word = "less" if 100 * seen.share < least else "not less"
        terminalreporter.write_line(f"{100 * seen.share:.1f} % ran: {word} than --glsl-cov-min={least:g}")


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """--glsl-backend=all: once for each way to run."""
    if "glsl_backend" in metafunc.fixturenames and metafunc.config.getoption("--glsl-backend") == "all":
        metafunc.parametrize("glsl_backend", _BACKENDS, scope="session")


@pytest.fixture(scope="session")
def glsl_backend(pytestconfig: pytest.Config) -> str:
    """The way in which `glsl` runs functions: what --glsl-backend says."""
    return str(pytestconfig.getoption("--glsl-backend"))


@pytest.fixture(scope="session")
def glsl_context(pytestconfig: pytest.Config) -> Iterator[Any]:
    """The OpenGL context of shader tests; a project may put its own glbump Context in its place."""
    from glbump.errors import ContextError
    from glbump.gl.context import open_context

    try:
        opened = open_context()
    except ContextError as error:
        if pytestconfig.getoption("--glsl-required"):
            pytest.fail(f"--glsl-required: {error}", pytrace=False)
        pytest.skip(f"no OpenGL here: {error}")
    with opened:
        yield opened


@pytest.fixture(scope="session")
def glsl(glsl_context: Any, glsl_backend: str, pytestconfig: pytest.Config) -> Iterator[Glsl]:
    """Loads GLSL: `glsl("shaders/lib/reflect.glsl").reflect_dir(directions, normals)`. See docs/shader-tests.md."""
    from glbump.glsltest.glsl import Glsl

    with Glsl(glsl_context, backend=glsl_backend) as made:
        made.watch = _watch(pytestconfig)
        made.coverage = pytestconfig.stash.get(_COVERAGE, None)
        yield made
        if made.watch is not None:
            made.watch.close()


def _watch(config: pytest.Config) -> Any:
    """What ends the run when a call does not come back; it writes past pytest's capture of the output."""
    from glbump.glsltest.watch import Watch

    seconds = config.getoption("--glsl-timeout")
    if seconds <= 0:
        return None
    capture = config.pluginmanager.getplugin("capturemanager")
    with capture.global_and_fixture_disabled():
        return Watch(seconds)


@pytest.fixture(scope="session")
def ulp() -> Any:
    """Comparison of floats: `ulp.assert_close(got, want, ulps=4, abs=2**-22)`."""
    from glbump.glsltest import ulp as module

    return module


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Iterator[None]:
    """A test that leaves GL objects behind fails; what `glsl` keeps for the next call does not count."""
    used = getattr(item, "funcargs", {}).get("glsl")
    if used is None or used.context.native is None:
        return (yield)
    before, kept = used.context.live_objects(), used.objects
    yield
    left = []
    for kind, count in used.context.live_objects().items():
        grown = count - before[kind] - (used.objects.get(kind, 0) - kept.get(kind, 0))
        left += [f"{grown} {kind}"] if grown > 0 else []
    if left:
        pytest.fail(f"GL objects left behind: {', '.join(left)}; release() what the test made", pytrace=False)
    return None
