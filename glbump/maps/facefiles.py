"""Files that hold one face each: which face a name names, and the files of a folder or a pattern."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

from glbump.errors import ImageError
from glbump.maps.cube import FACES

STYLES = (
    ("posx", "negx", "posy", "negy", "posz", "negz"),
    ("px", "nx", "py", "ny", "pz", "nz"),
    ("+x", "-x", "+y", "-y", "+z", "-z"),
    ("right", "left", "top", "bottom", "front", "back"),
)
"""How files name faces, +X -X +Y -Y +Z -Z; the last as one sees them: the orientation says where the front is."""

WORDS = STYLES[-1]

SUFFIXES = frozenset(("bmp", "exr", "hdr", "jpg", "jpeg", "jxl", "png", "psd", "tga", "tif", "tiff", "webp"))


def face_named(name: str, style: Sequence[str]) -> int | None:
    """The face that a file's name ends with: "sky_px.png", "posx.jpg", "Venice-Right.exr"; None where it names none."""
    stem = Path(name).stem.lower()
    for face, word in enumerate(style):
        # "+x" and "-x" stand for themselves; letters must not go on to the left: "apx" is no face.
        if stem.endswith(word) and (word[0] in "+-" or not stem[: -len(word)][-1:].isalnum()):
            return face
    return None


def faces_by_name(names: Sequence[str], style: Sequence[str]) -> dict[int, int] | None:
    """Face -> which of the names it is; None where a name names no face of this style, or two the same."""
    faces = [face_named(name, style) for name in names]
    if None in faces or len(set(faces)) < len(faces):
        return None
    return {face: i for i, face in enumerate(faces) if face is not None}


def face_files(source: Path) -> tuple[Path, ...] | None:
    """The six files of a folder or of a pattern "NAME_{face}.png", in the order +X -X +Y -Y +Z -Z.

    None for any other path. ImageError, with the face that is missing, where there are not just six.
    """
    if "{face}" in source.name:
        return _of_pattern(source)
    return _of_folder(source) if source.is_dir() else None


def _of_pattern(pattern: Path) -> tuple[Path, ...]:
    best: list[Path] = []
    for style in STYLES:
        for words in (style, [word.upper() for word in style], [word.capitalize() for word in style]):
            files = [pattern.with_name(pattern.name.replace("{face}", word)) for word in words]
            missing = [file for file in files if not file.is_file()]
            if not missing:
                return tuple(files)
            if not best or len(missing) < len(best):
                best = missing
    found = "none of its files is there" if len(best) == 6 else f"no {', '.join(file.name for file in best)}"
    raise ImageError(f"{pattern}: {found}; {{face}} stands for {', '.join(' '.join(style) for style in STYLES)}")


def _of_folder(folder: Path) -> tuple[Path, ...]:
    sets: dict[tuple[str, str, int], dict[int, Path]] = defaultdict(dict)
    for file in sorted(folder.iterdir()):
        if file.suffix[1:].lower() not in SUFFIXES:
            continue
        for number, style in enumerate(STYLES):
            face = face_named(file.name, style)
            if face is not None:
                before = re.sub(re.escape(style[face]) + "$", "", file.stem, flags=re.IGNORECASE)
                sets[before, file.suffix, number][face] = file
                break
    whole = [found for found in sets.values() if len(found) == 6]
    if len(whole) == 1:
        return tuple(whole[0][face] for face in range(6))
    if whole:
        names = ", ".join(found[0].name for found in whole)
        raise ImageError(f"{folder}: holds several cubes ({names}); give one as a pattern, NAME_{{face}}.png")
    if not sets:
        raise ImageError(
            f"{folder}: is a folder without the six faces of a cube; name them "
            f"{' or '.join(' '.join(style) for style in STYLES)}"
        )
    best = max(sets.values(), key=len)
    missing = " ".join(FACES[face] for face in range(6) if face not in best)
    beside = next(iter(best.values())).name
    raise ImageError(f"{folder}: a cube map needs six pictures; beside {beside} {missing} is missing")
