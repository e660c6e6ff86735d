"""Each finding of `glbump lint`: it is made where the fault was sown, and not in the sound twin."""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from glbump.cli import run
from glbump.errors import ImageError
from glbump.maps.colour import linear_from_srgb, srgb_from_linear
from glbump.maps.convert import convert
from glbump.maps.files import png_bytes, write_display, write_picture
from glbump.maps.gradients import METHODS
from glbump.maps.heights import slopes
from glbump.maps.images import read_colour
from glbump.maps.layout import CUBE, latlong_dir
from glbump.maps.lint import NOTE, Report, lint, values
from glbump.maps.lint.environments import seam
from glbump.maps.lint.normals import curl_agreement
from glbump.maps.pictured import environment_of, picture_of

F32 = npt.NDArray[np.float32]
DATA = Path(__file__).parents[2] / "shared" / "data"
needs_data = pytest.mark.skipif(not DATA.is_dir(), reason="the shared real pictures are not here")


def found(*files: Path, use: str | None = None) -> dict[str, str]:
    """What -> severity, of all reports."""
    return {f.what: f.severity for report in lint(files, use) for f in report.findings}


def latlong(rows: int = 64) -> F32:
    """An outdoor panorama: a blue sky over brown ground, hills of several widths, a small sun; (rows, 2 rows, 3)."""
    v, u = ((np.arange(n) + 0.5) / n for n in (rows, 2 * rows))
    dir = latlong_dir(np.stack(np.broadcast_arrays(u, v[:, None]), axis=-1))
    x, y, z = np.moveaxis(dir, -1, 0)
    hills = 0.1 * np.sin(3 * x + 1) * np.cos(5 * z) + 0.05 * np.sin(11 * x * z + 7 * z)
    share = 1 / (1 + np.exp(-(y - hills) * 20))[..., None]
    sky, ground = np.array([0.4, 0.7, 1.4]), np.array([0.20, 0.15, 0.08])
    texture = 1 + 0.3 * np.sin(9 * x + 5 * z)[..., None] * np.cos(7 * y)[..., None]
    light = (share * sky + (1 - share) * ground) * texture
    sun = np.exp(40 * (dir @ np.array([0.6, 0.64, 0.48]) - 1))
    return (light + 300 * sun[..., None] ** 8).astype(np.float32)


def heights(n: int = 128) -> F32:
    """Waves that tile, 0..1."""
    i = np.arange(n) / n * 2 * np.pi
    x, y = np.meshgrid(i, i)
    h = np.sin(3 * x + np.cos(2 * y)) + 0.7 * np.sin(x - 4 * y) + 0.3 * np.cos(7 * x + 2 * y)
    return ((h - h.min()) / np.ptp(h)).astype(np.float32)


def normals(flip: bool = False, amplitude: float = 0.02, n: int = 128) -> F32:
    """Unit normals (n, n, 3) of the waves, green up unless `flip`."""
    s = amplitude * slopes(heights(n))
    v = np.concatenate([-s, np.ones((n, n, 1), np.float32)], axis=-1)
    v[..., 1] *= -1 if flip else 1
    return (v / np.linalg.norm(v, axis=-1, keepdims=True)).astype(np.float32)


def as_bytes(vectors: F32) -> npt.NDArray[np.uint8]:
    return np.rint(vectors * 127 + 128).clip(0, 255).astype(np.uint8)


def save(name: str, pixels: npt.NDArray[Any]) -> Path:
    """A picture, by suffix and type: bytes without the sRGB chunk, floats linear."""
    path = Path(name)
    if pixels.dtype == np.uint8:
        write_display(path, pixels, srgb=False)
    else:
        write_picture(path, pixels.astype(np.float32))
    return path


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


# ------------------------------------------------------------ environments


def change(where: Any, value: Any) -> Callable[[F32], F32]:
    def made(pixels: F32) -> F32:
        result = pixels.copy()
        result[where] = value
        return result

    return made


def clamp(most: float) -> Callable[[F32], F32]:
    return lambda pixels: np.minimum(pixels, np.float32(most))


def graded(pixels: F32) -> F32:
    """sRGB-encoded floats, without what is brighter than white."""
    return srgb_from_linear(np.minimum(pixels * 1.3, 1)).astype(np.float32)


ENVIRONMENT_FAULTS = [
    ("not finite", change((3, 5, 1), np.nan), "values that are not finite", "wrong"),
    ("infinite", change((3, 5), np.inf), "values that are not finite", "wrong"),
    ("immense", change((3, 5), 1e35), "values without measure", "wrong"),
    ("a little negative", change((3, 5), -0.001), "negative radiance", "note"),
    ("very negative", change((3, 5), -500), "negative radiance", "doubtful"),
    ("upside down", lambda p: p[::-1], "upside down", "doubtful"),
    ("cropped at a side", lambda p: p[:, :-24], "a seam", "doubtful"),
    ("cropped at a side", lambda p: p[:, :-24], "a lat-long picture that is not 2:1", "doubtful"),
    ("on its side", lambda p: np.rot90(p), "a lat-long picture on its side", "doubtful"),
    ("a column twice", lambda p: np.concatenate([p, p[:, :1]], axis=1), "a doubled column", "note"),
    ("cropped at the poles", lambda p: p[20:-20, :48], "poles that are no points", "doubtful"),
    ("a clamped sun", clamp(30), "a clipped sun", "doubtful"),
    ("clipped at white", clamp(1), "clipped highlights: a display-range picture where HDR is expected", "doubtful"),
    ("darker than white", lambda p: p / p.max(), "a display-range picture where HDR is expected", "note"),
    ("bytes", lambda p: np.rint(255 * graded(p)) / np.float32(255), "floats that are sRGB-encoded", "doubtful"),
    ("encoded", graded, "floats that may be sRGB-encoded", "note"),
    ("odd", lambda p: p[:63, :126], "an odd side", "note"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("fault", "sow", "what", "severity"), ENVIRONMENT_FAULTS, ids=[f"{row[0]}: {row[2]}" for row in ENVIRONMENT_FAULTS]
)
def test_environment_faults(fault: str, sow: Callable[[F32], F32], what: str, severity: str) -> None:
    pixels = np.ascontiguousarray(sow(latlong()))
    if np.isfinite(pixels).all():
        path = save("sky.exr", pixels)
    else:  # What glbump itself does not write.
        path = Path("sky.exr")
        _write_any(path, pixels)
    assert found(path, use="environment").get(what) == severity, fault


def _write_any(path: Path, pixels: F32) -> None:
    import OpenImageIO as oiio

    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], 3, "float")
    file = oiio.ImageOutput.create(str(path))
    file.open(str(path), spec)
    file.write_image(pixels)
    file.close()


def test_sound_environment_is_left_alone() -> None:
    assert found(save("sky.exr", latlong())) == {}


def test_a_sound_cube_is_left_alone_and_a_turned_face_is_named() -> None:
    faces = convert(environment_of(read_colour(save("sky.exr", latlong(128)))), CUBE, 32)
    pixels = picture_of(faces, "faces", "opengl")

    def files(pixels: F32) -> list[Path]:
        names = ("px", "nx", "py", "ny", "pz", "nz")
        return [save(f"sky_{name}.exr", face) for name, face in zip(names, pixels)]

    assert found(*files(pixels)) == {}
    (report,) = lint([Path("sky_{face}.exr")])
    assert len(report.files) == 6
    turned = pixels.copy()
    turned[4] = np.rot90(turned[4], 2)
    said = found(*files(turned))
    assert list(said) == ["face +Z is turned by 180 degrees"], said
    swapped = pixels[[1, 0, 2, 3, 4, 5]]
    assert any("swapped" in what for what in found(*files(swapped)))


def test_a_pair_says_what_one_picture_cannot() -> None:
    sound = latlong()
    first = save("a_env.exr", sound)
    assert found(first, save("b_env.exr", sound * 2)) == {}
    for pixels, said in (
        (sound[:, ::-1], "mirrored"),
        (np.roll(sound, 32, axis=1), "turned by 270 degrees about +Y"),
        (sound[::-1], "upside down"),
    ):
        second = save("b_env.exr", np.ascontiguousarray(pixels))
        reports = list(lint([first, second]))
        assert reports[-1].files == (first, second)
        (finding,) = reports[-1].findings
        assert finding.what == f"against each other, {said}"
    # Another place says nothing.
    noise = np.random.default_rng(1).random(sound.shape).astype(np.float32)
    assert not any("against" in what for what in found(first, save("b_env.exr", noise)))


def test_a_picture_of_bytes() -> None:
    white = save("env.png", np.rint(graded(latlong()) * 255).astype(np.uint8))
    assert found(white) == {"clipped highlights: a display-range picture where HDR is expected": "doubtful"}
    clear = np.dstack([np.full((64, 128, 3), 90, np.uint8), np.full((64, 128), 254, np.uint8)])
    clear[5, 6, 0] = 91
    assert found(save("env.png", clear))["alpha where none belongs"] == "wrong"


@pytest.mark.parametrize(
    ("gamma", "what"),
    [(45455, None), (55556, "a gamma tag other than sRGB's"), (100000, "a gamma tag other than sRGB's")],
)
def test_gamma_tags(gamma: int, what: str | None) -> None:
    content = png_bytes(np.rint(graded(latlong()) * 255).astype(np.uint8), srgb=False)
    chunk = b"gAMA" + struct.pack(">I", gamma)
    at = 8 + 25  # After the header's chunk.
    whole = content[:at] + struct.pack(">I", 4) + chunk + struct.pack(">I", zlib.crc32(chunk)) + content[at:]
    Path("env.png").write_bytes(whole)
    said = found(Path("env.png"))
    assert (what in said) if what else not any("gamma" in w for w in said), said


def test_size_limit_is_asked_for_only_where_it_matters() -> None:
    def never() -> int:
        raise AssertionError

    assert values.size(4096, 2048, never) == []
    assert values.size(8192, 4096, lambda: 8192) == []
    (finding,) = values.size(8192, 4096, lambda: 4096)
    assert (finding.severity, finding.mend) == ("wrong", "shrink it to 4096x2048")


# ------------------------------------------------------------ heights


def sixteen_bits(name: str, heights: F32) -> Path:
    """A grey 16-bit TIFF."""
    import OpenImageIO as oiio

    spec = oiio.ImageSpec(heights.shape[1], heights.shape[0], 1, "uint16")
    file = oiio.ImageOutput.create(name)
    file.open(name, spec)
    file.write_image(np.rint(heights * 65535).astype(np.uint16)[..., None])
    file.close()
    return Path(name)


def test_stair_steps() -> None:
    smooth = heights(512) / 8
    assert found(sixteen_bits("a.tif", smooth)) == {}
    coarse = np.rint(smooth * 255) / 255
    assert found(save("b.png", np.rint(smooth * 255).astype(np.uint8)[..., None])) == {"stair steps": "doubtful"}
    # The same stairs in more bits are stairs.
    assert found(sixteen_bits("c.tif", coarse)) == {"stair steps": "doubtful"}
    # Steeper than a level a texel there are none, but 16 bits are not what they seem.
    steep = heights(128)
    assert found(save("d.png", np.rint(steep * 255).astype(np.uint8)[..., None])) == {}
    assert found(sixteen_bits("e.tif", np.rint(steep * 255) / 255)) == {"8 bits in a wider file": "note"}


@pytest.mark.parametrize(
    ("sow", "what", "severity"),
    [
        (change((3, 5), np.nan), "values that are not finite", "wrong"),
        (lambda h: 0 * h + 0.5, "no heights", "doubtful"),
        (lambda h: h[:, :-30], "does not tile", "note"),
        (lambda h: h[:-30], "does not tile", "note"),
        (lambda h: np.dstack([h, h * 0.9, h]), "colours where heights are expected", "wrong"),
        (lambda h: np.dstack([h, 0.5 + h / 2]), "alpha where none belongs", "wrong"),
        (lambda h: np.dstack([h, 1 + 0 * h]), "alpha without use", "note"),
    ],
)
def test_height_faults(sow: Callable[[F32], F32], what: str, severity: str) -> None:
    pixels = np.atleast_3d(np.asarray(sow(heights()), np.float32))
    path = Path("height.tif")
    import OpenImageIO as oiio

    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], "float")
    if pixels.shape[2] == 2:
        spec.channelnames, spec.alpha_channel = ("Y", "A"), 1
        spec.attribute("oiio:UnassociatedAlpha", 1)
    file = oiio.ImageOutput.create(str(path))
    file.open(str(path), spec)
    file.write_image(np.ascontiguousarray(pixels))
    file.close()
    assert found(path) == {what: severity}


def test_sound_heights_are_left_alone() -> None:
    assert found(save("height.exr", heights())) == {}
    # A tag that says colour is a note, since glbump takes heights as they stand.
    write_display("h.png", np.rint(heights() * 255).astype(np.uint8)[..., None], srgb=True)
    assert found(Path("h.png")) == {"tagged as sRGB": "note"}


# ------------------------------------------------------------ normal maps


@pytest.mark.parametrize("kernel", sorted(set(METHODS) - {"forward"}))
@pytest.mark.parametrize("amplitude", [0.001, 0.02, 0.5])
def test_the_curl_tells_green(kernel: str, amplitude: float) -> None:
    """By whatever kernel normals were made, in floats and in bytes, at slopes of 1 to 80 degrees."""
    s = amplitude * slopes(heights(), kernel)
    up = np.concatenate([-s, np.ones((*s.shape[:2], 1), np.float32)], axis=-1)
    up /= np.linalg.norm(up, axis=-1, keepdims=True)
    down = up * np.float32([1, -1, 1])
    assert curl_agreement(up) > 0.9
    assert curl_agreement(down) == pytest.approx(-curl_agreement(up), abs=1e-6)
    if amplitude > 0.001:  # Slopes of a hundredth are two steps of 8 bits.
        assert curl_agreement((as_bytes(up).astype(np.float32) - 128) / 127) > 0.5


def test_green_of_noise_is_not_judged() -> None:
    noise = np.random.default_rng(5).normal(0, 0.2, (64, 64, 2))
    vectors = np.dstack([noise, np.ones((64, 64))]).astype(np.float32)
    assert abs(curl_agreement(vectors)) < 0.15
    assert curl_agreement(np.float32([0, 0, 1]) * np.ones((8, 8, 1), np.float32)) == 0


NORMAL_FAULTS = [
    ("inverted green", lambda v: v * np.float32([1, -1, 1]), "inverted green", "doubtful"),
    ("averaged", lambda v: v * np.float32(0.85), "normals not of length 1", "doubtful"),
    ("far from unit", lambda v: v * np.float32(0.5), "normals not of length 1", "wrong"),
    ("leaning", lambda v: v + np.float32([0.06, 0, 0]), "the whole map leans", "note"),
    ("leaning far", lambda v: v + np.float32([0, 0.2, 0]), "the whole map leans", "doubtful"),
    ("inwards", change((3, 4, 2), -0.5), "normals that point into the surface", "wrong"),
    ("grey", lambda v: v[..., :1] * np.ones(3, np.float32), "a grey picture is no normal map", "wrong"),
    ("cut", lambda v: v[:, :-30], "does not tile", "note"),
]


@pytest.mark.parametrize(("fault", "sow", "what", "severity"), NORMAL_FAULTS, ids=[row[0] for row in NORMAL_FAULTS])
def test_normal_map_faults(fault: str, sow: Callable[[F32], F32], what: str, severity: str) -> None:
    assert found(save("normal.png", as_bytes(sow(normals())))).get(what) == severity


def test_srgb_encoded_normals() -> None:
    linear = as_bytes(normals())
    encoded = np.rint(srgb_from_linear(linear / 255) * 255).astype(np.uint8)
    assert found(save("a.png", encoded)) == {"sRGB-encoded normals": "wrong"}
    # It is the curve that is missed, not the brightness: decoded again it is sound.
    again = np.rint(linear_from_srgb(encoded / 255) * 255).astype(np.uint8)
    assert found(save("b.png", again)) == {}


def test_sound_normal_maps_are_left_alone() -> None:
    assert found(save("a.png", as_bytes(normals()))) == {}
    assert found(save("a.exr", normals() / 2 + 0.5), use="normal-map") == {}
    clear = np.dstack([as_bytes(normals()), np.rint(heights() * 255).astype(np.uint8)])
    assert found(save("c.png", clear)) == {"alpha where none belongs": "note"}


# ------------------------------------------------------------ real pictures

REAL = {
    "cc0/venice.exr": ("environment", {"negative radiance": "note"}),
    # Values down to -63 beside lamps of 943: 2 % of all light.
    "cc0/workshop.exr": ("environment", {"negative radiance": "doubtful"}),
    "openexr/KernerEnvLatLong.exr": ("environment", {"alpha without use": "note"}),
    "openexr/KernerEnvCube.exr": ("environment", {"alpha without use": "note"}),
    # It leans by 6.7 degrees and does not repeat.
    "cc0/normal_0003.webp": ("normal-map", {"the whole map leans": "note", "does not tile": "note"}),
}


@needs_data
@pytest.mark.parametrize("name", REAL)
def test_real_pictures(name: str) -> None:
    (report,) = lint([DATA / name])
    assert (report.use, {f.what: f.severity for f in report.findings}) == REAL[name]


@needs_data
@pytest.mark.parametrize("name", ["openexr/OrientationLatLong.exr", "openexr/OrientationCube.exr"])
def test_a_drawn_chart_is_no_hdr(name: str) -> None:
    assert all(severity == NOTE for severity in found(DATA / name).values())


@needs_data
@pytest.mark.parametrize("name", ["cc0/venice.exr", "openexr/KernerEnvLatLong.exr"])
def test_real_panoramas_upside_down(name: str) -> None:
    pixels = read_colour(DATA / name).pixels
    assert "upside down" not in found(save("up.exr", pixels))
    assert found(save("down.exr", np.ascontiguousarray(pixels[::-1])))["upside down"] == "doubtful"


@needs_data
@pytest.mark.parametrize("name", ["cc0/venice.exr", "cc0/workshop.exr", "openexr/KernerEnvLatLong.exr"])
def test_real_panoramas_cropped(name: str) -> None:
    pixels = read_colour(DATA / name).pixels
    columns = pixels.shape[1]
    # A sound panorama may begin anywhere.
    for start in range(0, columns, columns // 16):
        assert seam(np.roll(pixels[:, 1:], start, axis=1), on_border=False) == [], start
    assert [f.what for f in seam(pixels[:, : columns * 7 // 8], on_border=False)] == ["a seam"]


@needs_data
def test_a_real_normal_map_with_green_down() -> None:
    import OpenImageIO as oiio

    pixels = oiio.ImageBuf(str(DATA / "cc0" / "normal_0003.webp")).get_pixels(oiio.UINT8)[..., :3].copy()
    assert "inverted green" not in found(save("up_normal.png", pixels))
    pixels[..., 1] = 255 - pixels[..., 1]
    assert found(save("down_normal.png", pixels))["inverted green"] == "doubtful"


@needs_data
def test_the_real_pair_mirrored() -> None:
    pair = DATA / "openexr" / "KernerEnvLatLong.exr", DATA / "openexr" / "KernerEnvCube.exr"
    assert not any("against" in what for what in found(*pair))
    mirrored = save("mirrored.exr", np.ascontiguousarray(read_colour(pair[0]).pixels[:, ::-1]))
    # Without the header its centre is -Z, so that it is turned as well.
    assert "against each other, mirrored, turned by 180 degrees about +Y" in found(mirrored, pair[1])


# ------------------------------------------------------------ the guess, and the command


def use_of(path: Path) -> str:
    (report,) = lint([path])
    return report.use


def test_the_use_is_found() -> None:
    assert use_of(save("a.exr", latlong())) == "environment"
    assert use_of(save("a.png", np.rint(graded(latlong()) * 255).astype(np.uint8))) == "environment"
    assert use_of(save("a.exr", heights())) == "height"
    assert use_of(save("a.png", as_bytes(normals()))) == "normal-map"
    photo = np.rint(graded(latlong())[:, 10:90] * 255).astype(np.uint8)
    assert use_of(save("a.png", photo)) == "colour"
    assert use_of(save("brick_height.png", photo)) == "height"
    assert use_of(save("BrickNormal.png", photo)) == "normal-map"
    assert use_of(save("abnormal.png", photo)) == "colour"


def test_a_folder_without_faces_and_no_file_are_refused() -> None:
    with pytest.raises(ImageError, match="no such file"):
        list(lint([Path("nothere.png")]))
    with pytest.raises(ImageError, match="six faces"):
        list(lint([Path()]))


def test_status_and_text(capsys: pytest.CaptureFixture[str]) -> None:
    save("sky.exr", latlong())
    save("down.exr", np.ascontiguousarray(latlong()[::-1]))
    assert run(["lint", "sky.exr"]) == 0
    assert (
        capsys.readouterr().out
        == "sky.exr: environment, since its name says so, and it is read as lat-long: nothing found\n"
    )
    assert run(["lint", "sky.exr", "-q"]) == 0
    assert capsys.readouterr().out == ""
    assert run(["lint", "down.exr", "-q"]) == 1
    out = capsys.readouterr().out
    assert "  doubtful: upside down\n    why:  " in out
    assert "    mend: turn the picture by 180 degrees" in out
    assert run(["lint", "sky.exr", "--as", "hight"]) == 2
    assert "did you mean 'height'" in capsys.readouterr().err
    assert run(["lint", "nothere.exr"]) == 1
    assert capsys.readouterr().err.startswith("glbump: error: nothere.exr: no such file")


def test_json_and_a_damaged_file(capsys: pytest.CaptureFixture[str]) -> None:
    path = save("normal.png", as_bytes(normals(flip=True)))
    whole = path.read_bytes()
    Path("cut.png").write_bytes(whole[: len(whole) // 2])
    assert run(["lint", "cut.png", "normal.png", "--json"]) == 1
    cut, said = json.loads(capsys.readouterr().out)
    assert [f["what"] for f in cut["findings"]] == ["unreadable"]
    assert set(said) == {"files", "use", "why", "findings"}
    (finding,) = said["findings"]
    assert set(finding) == {"what", "why", "mend", "severity"}
    assert "flip_y" in finding["mend"]


def test_reports_are_plain_data() -> None:
    (report,) = lint([save("sky.exr", latlong())])
    assert isinstance(report, Report)
    assert not report.is_wrong
