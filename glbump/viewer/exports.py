"""What the window writes: pictures, turntables, scenes."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from glbump.errors import SceneError
from glbump.scene import Scene
from glbump.scenefile import files_of, save_scene, scene_from_dict, scene_to_dict
from glbump.viewer.navigation import orbit

if TYPE_CHECKING:
    from glbump.viewer.window import Viewer

STEPS = 72
"""Pictures of a turntable: one for each 5 degrees."""
PER_SECOND = 24


def free_name(folder: Path, stem: str, suffix: str) -> Path:
    """STEM.SUFFIX, or STEM-2.SUFFIX and so on: the first that is not there."""
    names = (f"{stem}{f'-{i}' if i > 1 else ''}{suffix}" for i in range(1, 100_000))
    return next(folder / name for name in names if not (folder / name).exists())


def picture(viewer: Viewer) -> None:
    """The picture as `glbump render` draws it, at the window's size."""

    def job() -> Iterator[str]:
        yield "drawing a picture"
        path = free_name(viewer.folder, viewer.shown.stem, ".png")
        frame = viewer.render(viewer.shown.scene, viewer.stage.room, viewer.shown.quality)
        frame.save(path, tone=viewer.shown.tone, exposure=viewer.shown.exposure)
        viewer.shown.say(f"{path}  {frame.size[0]}x{frame.size[1]}")

    viewer.shown.begin(job())


def turntable(viewer: Viewer, suffix: str) -> None:
    """The camera once round its target, as a folder of numbered PNGs or as one GIF."""

    def job() -> Iterator[str]:
        # What happens to the window while it goes on changes nothing of it.
        scene, tone, exposure = viewer.shown.scene, viewer.shown.tone, viewer.shown.exposure
        size, quality = viewer.stage.room, viewer.shown.quality
        target = free_name(viewer.folder, f"{viewer.shown.stem}-turntable", "" if suffix == ".png" else suffix)
        if suffix == ".png":
            target.mkdir()
        frames = []
        for i in range(STEPS):
            yield f"turntable: picture {i + 1} of {STEPS} (Esc stops it)"
            turned = Scene(scene.surfaces, scene.environment, orbit(scene.camera, -i / STEPS, 0))
            frame = viewer.render(turned, size, quality)
            if suffix == ".png":
                frame.save(target / f"{i:03}.png", tone=tone, exposure=exposure)
            else:
                frames.append(frame.display(tone, exposure))
        if frames:
            yield "turntable: writing the GIF"
            from glbump.maps.animation import write_gif

            write_gif(target, frames, PER_SECOND)
        viewer.shown.say(f"{target}  {STEPS} pictures")

    viewer.shown.begin(job())


def scene(viewer: Viewer) -> None:
    """The scene as a file, with copies of what it needs from elsewhere beside it."""
    path = save_with_files(viewer.shown.scene, free_name(viewer.folder, viewer.shown.stem, ".toml"))
    viewer.shown.say(f"{path}: saved; glbump render draws it")


def save_with_files(content: Scene, path: Path) -> Path:
    """Write a scene file, and copies of pictures and meshes that lie elsewhere in NAME-files beside it, so that it can
    be opened from where it is. SceneError where one cannot be copied, or the scene holds arrays."""
    import shutil

    folder = path.resolve().parent
    beside = folder / f"{path.stem}-files"
    copies: dict[Path, Path] = {}
    for file in dict.fromkeys(file.resolve() for file in files_of(content)):
        if not file.is_relative_to(folder):
            copies[file] = free_name(beside, file.stem, file.suffix)
            try:
                beside.mkdir(exist_ok=True)
                (shutil.copytree if file.is_dir() else shutil.copyfile)(file, copies[file])
            except OSError as why:
                raise SceneError(f"{file} cannot be copied to {copies[file]}: {why.strerror or why}") from None

    def moved(_where: str, value: Any) -> Any:
        return copies.get(value.resolve(), value) if isinstance(value, Path) else value

    tables = scene_to_dict(content, moved, defaults=True)
    save_scene(scene_from_dict(tables, lambda _where, value: value), path)
    return path
