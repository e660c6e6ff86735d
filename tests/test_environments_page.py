"""What docs/environments.md says may be typed, and its pictures."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import glbump as gb
from glbump.environment import ENVIRONMENTS

DOCS = Path(__file__).parents[1] / "docs"
PAGE = (DOCS / "environments.md").read_text(encoding="utf-8")
SURFACE = '[[surface]]\nshape = { kind = "sphere" }\n'


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)


@pytest.mark.parametrize("text", blocks("toml"))
def test_scene_files_are_scenes(text: str, tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(text if "[[surface]]" in text else f"{text}\n{SURFACE}")
    scene = gb.load_scene(tmp_path / "scene.toml")
    assert scene.environment.kind in text or scene.surfaces[0].environment or scene.surfaces[0].material.transmission


@pytest.mark.parametrize("code", blocks("python"))
def test_python_runs(code: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    exec(code.replace("size=(640, 640)", "size=(16, 16)"), {"gb": gb})
    assert ("save" in code) == (tmp_path / "ball.png").exists()


def test_every_environment_is_there() -> None:
    python, toml = "".join(blocks("python")), "".join(blocks("toml"))
    for kind in ENVIRONMENTS:
        assert f"gb.{kind.__name__}(" in python
        assert f'kind = "{kind.kind}"' in toml


def test_pictures_are_there_and_small() -> None:
    pictures = re.findall(r"\]\((pictures/[^)]*)\)", PAGE)
    assert len(pictures) >= len(ENVIRONMENTS)
    for name in pictures:
        assert (DOCS / name).stat().st_size < 60_000, name
    made = {f"pictures/{path.name}" for part in ("gallery", "layout") for path in DOCS.glob(f"pictures/{part}-*.png")}
    assert made == set(pictures)


def test_links_lead_somewhere() -> None:
    for target in re.findall(r"\]\(([^)#]+)\)", PAGE):
        assert (DOCS / target).exists(), target
