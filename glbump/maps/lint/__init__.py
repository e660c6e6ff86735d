"""What is wrong with pictures for their use: findings as data, each with its evidence and what mends it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path

import numpy as np

from glbump.errors import ImageError
from glbump.maps.facefiles import STYLES, face_files, faces_by_name
from glbump.maps.images import colour_of
from glbump.maps.layout import EnvironmentMap
from glbump.maps.lint import environments, values
from glbump.maps.lint.finding import DOUBTFUL, NOTE, SEVERITIES, WRONG, Finding
from glbump.maps.lint.heights import check_heights
from glbump.maps.lint.normals import check_normals
from glbump.maps.lint.tags import tags_of
from glbump.maps.lint.use import ENVIRONMENT, HEIGHT, NORMAL_MAP, USES, use_of
from glbump.maps.pictured import environment_of
from glbump.maps.stored import Stored, read_stored

__all__ = ["DOUBTFUL", "NOTE", "SEVERITIES", "USES", "WRONG", "Finding", "Report", "lint"]


@dataclass(frozen=True)
class Report:
    """What was found in the files of one picture: one, or the six faces of a cube. use: one of USES; why: of it."""

    files: tuple[Path, ...]
    use: str
    why: str
    findings: tuple[Finding, ...]

    @property
    def is_wrong(self) -> bool:
        """Whether anything graver than a note was found."""
        return any(finding.severity != NOTE for finding in self.findings)


def lint(
    files: Sequence[Path], use: str | None = None, most: Callable[[], int] = lambda: values.TEXTURE_SIDE
) -> Iterator[Report]:
    """A report for each picture in turn, then one for each two environments that show one place another way.

    files: pictures; a folder, or a pattern "NAME_{face}.png", is the six faces of a cube, and so are six files whose
    names name faces. use: one of USES; None finds it out. most: gives the longest side of a texture; it is asked only
    where that may decide.
    A file that cannot be read is a finding; ImageError only for what is no file.
    """
    seen: list[tuple[Report, EnvironmentMap]] = []
    for group in grouped(files) if use in (None, ENVIRONMENT) else [(file,) for file in files]:
        report, environment = _report(group, use, most)
        if environment is not None:
            seen.append((report, environment))
        yield report
    for (first, one), (second, other) in combinations(seen, 2):
        found = environments.against(one, other)
        if found:
            yield Report((first.files[0], second.files[0]), ENVIRONMENT, "they show one place", tuple(found))


def grouped(files: Sequence[Path]) -> list[tuple[Path, ...]]:
    """The files of each picture."""
    names = [str(file) for file in files]
    if len(files) == 6 and any(faces_by_name(names, style) for style in STYLES):
        return [tuple(files)]
    return [face_files(file) or (file,) for file in files]


def _report(files: tuple[Path, ...], use: str | None, most: Callable[[], int]) -> tuple[Report, EnvironmentMap | None]:
    try:
        pictures = [read_stored(file, finite=False) for file in files]
    except ImageError as error:
        if not all(file.is_file() for file in files):
            raise
        finding = Finding("unreadable", str(error), "get a whole copy of it, or save it in another format", WRONG)
        return Report(files, use or "unknown", "it cannot be read", (finding,)), None
    why = "as told"
    if use is None:
        use, why = use_of(pictures[0]) if len(files) == 1 else (ENVIRONMENT, "six files whose names name faces")
    environment = None
    if use == ENVIRONMENT:
        found, environment = _environment(pictures, files)
        size = environment.size if environment and not environment.has_own_grid else None
        why += f", and it is read as {environment.layout.name}" if environment else ""
    else:
        found = [finding for file, stored in zip(files, pictures) for finding in _one(file, stored, use)]
        size = pictures[0].pixels.shape[1::-1]
    found += values.size(*size, most) if size else []
    order = {severity: i for i, severity in enumerate(SEVERITIES)}
    return Report(files, use, why, tuple(sorted(found, key=lambda finding: order[finding.severity]))), environment


def _one(file: Path, stored: Stored, use: str) -> list[Finding]:
    tags = tags_of(file)
    if use == HEIGHT:
        return check_heights(stored, tags)
    if use == NORMAL_MAP:
        return check_normals(stored, tags)
    return _light(stored) + values.colour_tags(tags)


def _light(stored: Stored) -> list[Finding]:
    """Of colour, whatever it is for."""
    found = values.alpha(stored, is_read=True)
    if stored.is_float:
        finite = _finite(stored).pixels
        found += values.not_finite(stored.pixels) + (values.too_large(finite) or values.negative(finite))
    return found


def _finite(stored: Stored) -> Stored:
    """Zeros for what is not finite, so that the rest can be looked at."""
    if not stored.is_float or np.isfinite(stored.pixels).all():
        return stored
    return replace(stored, pixels=np.where(np.isfinite(stored.pixels), stored.pixels, 0).astype(np.float32))


def _environment(pictures: list[Stored], files: tuple[Path, ...]) -> tuple[list[Finding], EnvironmentMap | None]:
    """What is found in an environment of one file or six, and the environment, where it is one."""
    found: list[Finding] = []
    for file, stored in zip(files, pictures):
        of_file = _light(stored) + values.colour_tags(tags_of(file))
        found += [replace(f, what=f"{file.name}: {f.what}") for f in of_file] if len(files) > 1 else of_file
    light = [colour_of(_finite(stored)) for stored in pictures]
    if any(values.too_large(picture.pixels) for picture in light):
        return found, None
    # The sun is on one face of six.
    whole = replace(light[0], pixels=np.concatenate([picture.pixels.reshape(1, -1, 3) for picture in light], axis=1))
    found += environments.low_range(whole) + environments.clipped_sun(whole) + environments.encoded_floats(whole)
    try:
        environment = environment_of(light)
    except ImageError as error:
        mend = "give six square faces of one size, or one picture; glbump convert --from says its layout"
        return [*found, Finding("no environment", str(error), mend, WRONG)], None
    return found + environments.lies_well(environment, light[0]), environment
