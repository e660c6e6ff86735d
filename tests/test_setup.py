"""What is packed, what is public, and what `make` does before anything is installed."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

import glbump

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> zipfile.ZipFile:
    """The wheel, built from the checkout without a network."""
    build = pytest.importorskip("hatchling.builders.wheel", reason="hatchling is not installed here")
    folder = tmp_path_factory.mktemp("wheel")
    path = next(build.WheelBuilder(str(ROOT)).build(directory=str(folder), versions=["standard"]))
    return zipfile.ZipFile(path)


def test_wheel_holds_every_module_and_shader(wheel: zipfile.ZipFile) -> None:
    packed = {name for name in wheel.namelist() if ".dist-info/" not in name}
    modules = {str(p.relative_to(ROOT)) for p in (ROOT / "glbump").rglob("*.py")}
    shaders = {"glbump/" + str(p.relative_to(ROOT)) for p in (ROOT / "shaders").rglob("*") if p.is_file()}
    assert packed == modules | shaders | {"glbump/py.typed", "glbump/maps/dfg.npy"}
    assert shaders


def test_wheel_says_what_it_is(wheel: zipfile.ZipFile) -> None:
    names = wheel.namelist()
    metadata = wheel.read(next(n for n in names if n.endswith("/METADATA"))).decode()
    assert f"\nVersion: {PROJECT['version']}\n" in metadata
    assert "\nLicense-Expression: MIT\n" in metadata
    assert any(n.endswith("/licenses/LICENSE") for n in names)
    scripts = wheel.read(next(n for n in names if n.endswith("/entry_points.txt"))).decode()
    assert "glbump = glbump.cli:main" in scripts


def test_versions_agree() -> None:
    # A stale environment (`pip install -e .` not run again) shows here.
    assert glbump.__version__ == PROJECT["version"]
    newest = re.search(r"^## \[?([^\]\s]+)", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)
    assert newest is not None
    assert newest[1] in (PROJECT["version"], "Unreleased")


def test_every_public_name_is_there() -> None:
    for name in glbump.__all__:
        assert getattr(glbump, name) is not None
    assert set(glbump.__all__) <= set(dir(glbump))
    with pytest.raises(AttributeError, match="no attribute 'Sfere'"):
        _ = glbump.Sfere


def test_type_checkers_see_the_same_names() -> None:
    tree = ast.parse((ROOT / "glbump" / "__init__.py").read_text())
    block = next(n for n in tree.body if isinstance(n, ast.If) and ast.unparse(n.test) == "TYPE_CHECKING")
    seen = {
        alias.asname: node.module for node in block.body if isinstance(node, ast.ImportFrom) for alias in node.names
    }
    assert sorted(seen) == glbump.__all__
    for name, module in seen.items():
        assert getattr(sys.modules[str(module)], name) is getattr(glbump, name)


def test_installing_follows_the_users_own_settings() -> None:
    """No address and no option that chooses where packages come from."""
    choosing = re.compile(r"index-url|find-links|trusted-host|https?://")
    for name in ("Makefile", "pyproject.toml", "tools/setup", ".ci/run"):
        path = ROOT / name
        if path.exists():
            assert not choosing.search(path.read_text()), name


# ----------------------------------------------------------------------------------------------- tools/setup, alone


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A folder with tools/setup in it, and a bin/ that is all of the PATH."""
    (tmp_path / "tools").mkdir()
    (tmp_path / "tools" / "setup").write_text((ROOT / "tools" / "setup").read_text())
    (tmp_path / "bin").mkdir()
    for name in ("bash", "dirname", "id", "mktemp", "tail", "rm", "env", "grep"):
        target = next(Path(d) / name for d in ("/usr/bin", "/bin") if (Path(d) / name).exists())
        (tmp_path / "bin" / name).symlink_to(target)
    return tmp_path


def fake(checkout: Path, name: str, script: str) -> None:
    path = checkout / "bin" / name
    path.unlink(missing_ok=True)
    path.write_text(f"#!{checkout}/bin/bash\n{script}\n")
    path.chmod(0o755)


def setup(checkout: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    environment = {"PATH": str(checkout / "bin"), "HOME": str(checkout), "TMPDIR": str(checkout)}
    # Only the PATH above: the script adds the folders of ldconfig, which hold nothing else it calls.
    script = (checkout / "tools" / "setup").read_text().replace("PATH=$PATH:/usr/sbin:/sbin", "")
    (checkout / "tools" / "setup").write_text(script)
    return subprocess.run(
        [str(checkout / "bin" / "bash"), "tools/setup", *arguments],
        cwd=checkout,
        env=environment,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )


needs_bash = pytest.mark.skipif(not Path("/bin/bash").exists() and not Path("/usr/bin/bash").exists(), reason="no bash")


@needs_bash
def test_setup_says_which_python_is_needed(checkout: Path) -> None:
    fake(checkout, "python3", '[ "$1" = --version ] && echo Python 3.9.2 || exit 1')
    done = setup(checkout, "packages", ".venv", "demo")
    assert done.returncode == 1
    assert "Python 3.11 or newer is needed; found Python 3.9.2" in done.stderr
    assert not (checkout / ".venv").exists()


@needs_bash
def test_setup_names_the_missing_venv_package(checkout: Path) -> None:
    # A Python that is new enough and has no ensurepip, for a user who may not install.
    fake(checkout, "id", "echo 1000")
    fake(
        checkout,
        "python3",
        'case "$2" in *ensurepip*) exit 1 ;; *print*) echo python3.12-venv ;; esac; exit 0',
    )
    done = setup(checkout, "packages", ".venv", "demo")
    assert done.returncode == 1
    assert "sudo apt-get install -y --no-install-recommends python3.12-venv" in done.stderr


@needs_bash
def test_setup_installs_the_driver_as_root_or_prints_the_line(checkout: Path) -> None:
    (checkout / ".venv" / "bin").mkdir(parents=True)
    # A context opens once the driver is there.
    python = checkout / ".venv" / "bin" / "python"
    python.write_text(f"#!{checkout}/bin/bash\n[ -e {checkout}/driver ]\n")
    python.chmod(0o755)
    line = "apt-get install -y --no-install-recommends libegl1 libgl1 libgl1-mesa-dri"

    fake(checkout, "id", "echo 1000")
    done = setup(checkout, "driver", ".venv")
    assert done.returncode == 1
    assert line in done.stderr

    fake(checkout, "id", "echo 0")
    fake(checkout, "apt-get", f'echo "$@" >>{checkout}/calls; [ "$1" != install ] || : >{checkout}/driver')
    done = setup(checkout, "driver", ".venv")
    assert done.returncode == 0, done.stderr
    calls = (checkout / "calls").read_text().splitlines()
    assert calls == ["update", line.removeprefix("apt-get ")]

    done = setup(checkout, "driver", ".venv")
    assert (done.returncode, done.stderr) == (0, "")
    assert (checkout / "calls").read_text().splitlines() == calls


@needs_bash
def test_setup_does_not_fail_for_what_only_some_tests_use(checkout: Path) -> None:
    (checkout / ".venv").mkdir()
    fake(checkout, "touch", ': >"$1"')
    fake(checkout, "id", "echo 0")
    fake(checkout, "ldconfig", "")
    fake(checkout, "apt-get", f'echo "$@" >>{checkout}/calls; [ "$1" != install ]')
    done = setup(checkout, "test-libraries", ".venv")
    assert done.returncode == 0, done.stderr
    assert "going on without libosmesa6" in done.stderr
    tried = (checkout / "calls").read_text()
    assert tried.count("update") == 1
    # Asked once, not at each `make test`.
    assert setup(checkout, "test-libraries", ".venv").stderr == ""
    assert (checkout / "calls").read_text() == tried


def test_help_of_make_names_what_readme_names() -> None:
    make = (ROOT / "Makefile").read_text()
    named = set(re.findall(r"\bmake ([a-z]+)\b", (ROOT / "README.md").read_text()))
    assert {"demo", "test"} <= named
    assert named <= set(re.findall(r"^([a-z]+):", make, re.MULTILINE))


def test_scripts_may_be_run() -> None:
    for name in ("tools/setup", ".ci/run"):
        if (ROOT / name).exists():
            assert os.access(ROOT / name, os.X_OK), name
