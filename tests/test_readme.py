"""What the README says a newcomer may type."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import click
import numpy as np
import pytest

import glbump as gb
from glbump.cli import cli
from glbump.demo import panorama, relief
from glbump.maps.files import write_picture
from glbump.maps.images import read_colour
from glbump.quality import KNOBS

ROOT = Path(__file__).parents[1]
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md")))
README = (ROOT / "README.md").read_text(encoding="utf-8")


def block(language: str) -> str:
    """The first fenced block of a language."""
    found = re.search(rf"```{language}\n(.*?)```", README, re.DOTALL)
    assert found is not None
    return found[1]


def test_ten_lines_of_python(tmp_path: Path) -> None:
    maps = tmp_path / "out/scenes/maps"
    maps.mkdir(parents=True)
    write_picture(maps / "evening.exr", panorama.evening(32))
    write_picture(maps / "bricks.exr", relief.bricks(64))
    code = block("python")
    assert "size=(1024, 1024)" in code
    code = code.replace("size=(1024, 1024)", "size=(32, 32)")
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert np.ptp(read_colour(tmp_path / "ball.png").pixels) > 0.1


def test_scene_file_is_one(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(block("toml"))
    scene = gb.load_scene(tmp_path / "scene.toml")
    assert scene.surfaces[0].bump == gb.Bump(tmp_path / "brick.png", amplitude=0.02, repeat=(8, 4))


def test_commands_are_the_commands() -> None:
    rows = re.findall(r"^\| `glbump ([a-z-]+)([^`]*)`", README, re.MULTILINE)
    assert {name for name, _ in rows} == set(cli.commands)
    for name, usage in rows:
        options = [set(p.opts) for p in cli.commands[name].params if isinstance(p, click.Option)]
        said = set(re.findall(r"(?<![\w-])--?[a-z][a-z-]*", usage))
        assert said <= set().union(*options), name
        # What all commands have stands below the table.
        assert [flags for flags in options if not flags & (said | {"--quiet", "--debug", "--help"})] == [], name


def test_every_knob_has_its_values() -> None:
    table = README.split("| knob |")[1].split("## Commands")[0]
    rows = re.findall(r"^\| (`.*)", table, re.MULTILINE)
    for name, knob in KNOBS.items():
        (said,) = (row for row in rows if f"`{name}`" in row)
        words = [value for value in knob.values if isinstance(value, str)]
        assert [word for word in words if f"`{word}`" not in said] == [], name


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_lead_somewhere(page: Path) -> None:
    targets = re.findall(r"!?\[[^\]]*\]\(([^)#]+)[^)]*\)", page.read_text(encoding="utf-8"))
    missing = [target for target in targets if "://" not in target and not (page.parent / target).exists()]
    assert missing == []


def test_no_page_or_picture_is_forgotten() -> None:
    said = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    files = [path.name for path in (ROOT / "docs").rglob("*.*") if path.suffix != ".json"]
    assert [name for name in files if name not in said] == []


def test_files_it_names_are_there() -> None:
    for name in re.findall(r"`((?:docs|demos|tools|tests)/[\w./]*)`", README):
        assert (ROOT / name).exists(), name
