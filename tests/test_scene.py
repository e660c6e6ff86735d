"""Every field of every dataclass refuses what it cannot mean, in one line: the field, what it got, what is allowed."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import FrozenInstanceError, fields
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from glbump.camera import Camera
from glbump.environment import (
    ENVIRONMENTS,
    BoxBounds,
    Captured,
    Chrome,
    CubeMap,
    Fractal,
    HemiCube,
    Hemisphere,
    LatLong,
    LightProbe,
    Octahedral,
    Pictured,
    Sky,
    SphereBounds,
)
from glbump.errors import SceneError
from glbump.image import ArrayImage
from glbump.quality import KNOBS, PRESETS, Quality, quality_of
from glbump.scene import Bump, Material, NormalMap, Scene, Surface, check_size, with_value
from glbump.shapes import Cube, MeshData, MeshFile, Plane, Quad, Sphere, Torus, Transform

NAN, INF = float("nan"), float("inf")

# What each class needs to be made at all.
NEEDED: dict[type[Any], dict[str, Any]] = {
    Quad: {},
    Plane: {},
    Cube: {},
    Sphere: {},
    Torus: {},
    MeshFile: {"path": "a.obj"},
    MeshData: {"positions": [(0, 0, 0), (1, 0, 0), (0, 1, 0)], "triangles": [(0, 1, 2)]},
    Transform: {},
    Material: {},
    Bump: {"height": "a.png", "amplitude": 1},
    NormalMap: {"normal_map": "a.png"},
    Surface: {"shape": Sphere()},
    LatLong: {"image": "a.exr"},
    CubeMap: {"image": "a.exr"},
    HemiCube: {"image": "a.exr"},
    Hemisphere: {"image": "a.exr"},
    Octahedral: {"image": "a.exr"},
    LightProbe: {"image": "a.exr"},
    Captured: {},
    BoxBounds: {"low": (-1, -1, -1), "high": (1, 1, 1)},
    SphereBounds: {"centre": (0, 0, 0), "radius": 1},
    Sky: {},
    Chrome: {},
    Fractal: {},
    Scene: {"surfaces": [], "environment": LatLong("a.exr")},
    Camera: {},
    Quality: {},
}


ROOM = BoxBounds((-1, -1, -1), (1, 1, 1))

REFUSED = [
    (Quad, {"corners": 3}, r"quad\.corners must be 4 points of 3 numbers; got 3"),
    (Quad, {"corners": [(0, 0, 0)] * 3}, r"quad\.corners must be 4 points"),
    (Quad, {"corners": [(0, 0)] * 4}, r"quad\.corners\[0\] must be 3 numbers; got \(0, 0\)"),
    (Quad, {"corners": [(0, 0, 0), (1, 0, 0), (1, 1, NAN), (0, 1, 0)]}, r"quad\.corners\[2\]\[2\] .*got nan"),
    (Quad, {"corners": [(0, 0, 0), (1, 1, 0), (1, 0, 0), (0, 1, 0)]}, r"quad\.corners .*counter-clockwise.*convex"),
    (Quad, {"corners": [(0, 0, 0), (2, 1, 0), (0, 2, 0), (0.5, 1, 0)]}, r"quad\.corners .*convex"),
    (Quad, {"corners": [(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0)]}, r"quad\.corners .*four corners"),
    (Quad, {"corners": [(0, 0, 0)] * 4}, r"quad\.corners .*convex"),
    (Quad, {"corners": [(0, 0, 0), (1, 0, 0), (1, 1, 0.1), (0, 1, 0)]}, r"quad\.corners must lie in one plane"),
    (Plane, {"size": (1, 0)}, r"plane\.size\[1\] must be a finite number at least 1e-18 and at most 1e\+18; got 0"),
    (Plane, {"size": 3}, r"plane\.size must be 2 numbers; got 3"),
    (Cube, {"size": (1, 1)}, r"cube\.size must be 3 numbers; got \(1, 1\)"),
    (Cube, {"size": (1, 1, -1)}, r"cube\.size\[2\] must be .*; got -1"),
    (Sphere, {"radius": 0}, r"sphere\.radius must be .*; got 0$"),
    (Sphere, {"radius": -1}, r"sphere\.radius must be .*; got -1$"),
    (Sphere, {"radius": "1"}, r"sphere\.radius must be .*; got '1'$"),
    (Sphere, {"radius": INF}, r"sphere\.radius must be a finite number .*; got inf$"),
    (Sphere, {"radius": 1e30}, r"sphere\.radius must be .* at most 1e\+18; got 1e\+30$"),
    (Sphere, {"radius": True}, r"sphere\.radius must be .*; got True$"),
    (Sphere, {"radius": 10**400}, r"sphere\.radius must be .*; got 1000"),
    (Torus, {"radius": 0}, r"torus\.radius must be"),
    (Torus, {"tube": 1}, r"torus\.tube must be smaller than torus\.radius .*got tube 1 and radius 1"),
    (Torus, {"tube": NAN}, r"torus\.tube must be .*; got nan"),
    (MeshFile, {"path": ""}, r"mesh\.path must be the path of a mesh file; got ''"),
    (MeshFile, {"path": None}, r"mesh\.path must be .*; got None"),
    (MeshData, {"positions": 3}, r"mesh_data\.positions must be an array \(N, 3\) of numbers; got shape \(\)"),
    (MeshData, {"positions": [(0, 0)]}, r"mesh_data\.positions .*; got shape \(1, 2\)"),
    (MeshData, {"positions": [(0, 0, 0), (1,)]}, r"mesh_data\.positions must be an array"),
    (MeshData, {"positions": [(0, 0, 0), (1, NAN, 0)]}, r".*; 1 of 2 rows are not, the first is number 1, \(1\.0, nan"),
    (MeshData, {"positions": [(0, 0, 1e19)]}, r"mesh_data\.positions must be finite, and at most 1e\+18"),
    (MeshData, {"triangles": [(0, 1, 3)]}, r"mesh_data\.triangles must be rows of positions, 0 to 2; got 0 to 3"),
    (MeshData, {"triangles": [(0, 1, -1)]}, r"mesh_data\.triangles must be rows .*; got -1 to 1"),
    (MeshData, {"triangles": []}, r"mesh_data\.triangles must be an array \(T, 3\) of .*; got shape \(0,\)"),
    (MeshData, {"triangles": [(0.0, 1, 2)]}, r"mesh_data\.triangles .*; got shape \(1, 3\) and type float64"),
    (MeshData, {"normals": [(0, 0, 1)]}, r"mesh_data\.normals must be an array \(3, one for each position, 3\)"),
    (MeshData, {"uv": [(0, 0), (INF, 0), (0, 0)]}, r"mesh_data\.uv must be finite.*number 1, \(inf, 0"),
    (Transform, {"scale": 0}, r"transform\.scale must be at least 1e-18 .*got \(0\.0, 0\.0, 0\.0\)"),
    (Transform, {"scale": (1, 1)}, r"transform\.scale must be 3 numbers; got \[1, 1\]"),
    (Transform, {"translate": (0, 0, 1e19)}, r"transform\.translate\[2\] must be .*; got 1e\+19"),
    (Transform, {"rotate": (0, "90", 0)}, r"transform\.rotate\[1\] must be a finite number; got '90'"),
    (Transform, {"translate": {1, 2, 3}}, r"transform\.translate must be 3 numbers; got \{1, 2, 3\}"),
    (Material, {"base_color": (1, 1, 2)}, r"material\.base_color\[2\] must be .*at least 0 and at most 1; got 2"),
    (Material, {"base_color": "red"}, r"material\.base_color must be 3 numbers; got 'red'"),
    (Material, {"metallic": 1.5}, r"material\.metallic must be .* at most 1; got 1\.5"),
    (Material, {"roughness": -0.1}, r"material\.roughness must be .*at least 0.*; got -0\.1"),
    (Material, {"ior": 0.5}, r"material\.ior must be .*at least 1.*; got 0\.5"),
    (Bump, {"height": 3}, r"bump\.height must be a path or an array; got int 3"),
    (Bump, {"height": ""}, r"bump\.height must be a path or an array; got str ''"),
    (Bump, {"height": np.zeros((0, 4))}, r"bump\.height must be .*non-empty.*; got an array of shape \(0, 4\)"),
    (Bump, {"height": np.zeros(4)}, r"bump\.height must be .*\(H, W\).*; got an array of shape \(4,\)"),
    (Bump, {"height": np.array([["a"]])}, r"bump\.height must be .*of floats, uint8 or uint16; .*type <U1"),
    (Bump, {"amplitude": NAN}, r"bump\.amplitude must be a finite number .*; got nan"),
    (Bump, {"repeat": 0}, r"bump\.repeat\[0\] must be .*above 0.*; got 0"),
    (Bump, {"repeat": (1, 2, 3)}, r"bump\.repeat must be 2 numbers; got"),
    (Bump, {"channel": "red"}, r"unknown bump\.channel 'red'; .*choose one of: r, g, b, a"),
    (Bump, {"border": "repeat"}, r"unknown bump\.border 'repeat'; .*wrap, mirror, clamp"),
    (Bump, {"scaling": "uv"}, r"unknown bump\.scaling 'uv'; .*world, parameter"),
    (Bump, {"mapping": "box"}, r"unknown bump\.mapping 'box'; .*uv, triplanar"),
    (Bump, {"pixel_size": 0}, r"bump\.pixel_size must be a finite number at least 1e-18"),
    (NormalMap, {"scale": INF}, r"bump\.scale must be a finite number .*; got inf"),
    (NormalMap, {"flip_y": 1}, r"bump\.flip_y must be true or false; got 1"),
    (NormalMap, {"repeat": -1}, r"bump\.repeat\[0\] must be .*above 0.*; got -1"),
    (Surface, {"shape": Sphere}, r"surface\.shape must be one of Quad, .*; got <class"),
    (Surface, {"shape": "sphere"}, r"surface\.shape must be one of .*; got 'sphere'"),
    (Surface, {"material": (1, 1, 1)}, r"surface\.material must be a Material; got \(1, 1, 1\)"),
    (Surface, {"bump": "a.png"}, r"surface\.bump must be one of Bump, NormalMap; got 'a\.png'"),
    (Surface, {"transform": np.eye(4)}, r"surface\.transform must be a Transform; got array"),
    (LatLong, {"image": None}, r"environment\.image must be a path or an array; got NoneType None"),
    (LatLong, {"rotation": NAN}, r"environment\.rotation must be a finite number; got nan"),
    (LatLong, {"exposure": 100}, r"environment\.exposure must be .* at most 64; got 100"),
    (LatLong, {"lookup": "reflect"}, r"unknown environment\.lookup 'reflect'; did you mean 'reflection'\?"),
    (LatLong, {"background": 0}, r"environment\.background must be true or false; got 0"),
    (CubeMap, {"image": ["a"] * 5}, r"environment\.image must be one picture or six .*; got 5"),
    (CubeMap, {"image": ["a"] * 5 + [1]}, r"environment\.image\[5\] must be a path or an array; got int 1"),
    (CubeMap, {"orientation": "outside"}, r"unknown environment\.orientation 'outside'; did you mean 'inside'\?"),
    (Sky, {"up": (1, 1)}, r"environment\.up must be 3 numbers; got \(1, 1\)"),
    (Sky, {"down": (0, -1, 0)}, r"environment\.down\[1\] must be .*at least 0 and at most 65504; got -1"),
    (Sky, {"softness": 91}, r"environment\.softness must be .*at least 0 and at most 90; got 91"),
    (Chrome, {"grey": "grey"}, r"environment\.grey must be 3 numbers; got 'grey'"),
    (Chrome, {"silver": (1, NAN, 1)}, r"environment\.silver\[1\] must be .*; got nan"),
    (Chrome, {"bands": -1}, r"environment\.bands must be .*at least 0.*; got -1"),
    (Chrome, {"sway": 100}, r"environment\.sway must be .*at most 16; got 100"),
    (Fractal, {"seed": 1.5}, r"environment\.seed must be a whole number from 0 to 2147483647; got 1\.5"),
    (Fractal, {"relief": 5}, r"environment\.relief must be .*at most 4; got 5"),
    (Fractal, {"sky": 1}, r"environment\.sky must be 3 numbers; got 1"),
    (Fractal, {"haze": (1e9, 0, 0)}, r"environment\.haze\[0\] must be .*at most 65504; got 1"),
    (Fractal, {"rock": ()}, r"environment\.rock must be 3 numbers; got \(\)"),
    (Fractal, {"snow": (INF, 0, 0)}, r"environment\.snow\[0\] must be .*; got inf"),
    (Fractal, {"steps": 7}, r"environment\.steps must be .*at least 8 and at most 1024; got 7"),
    (HemiCube, {"image": ["a"] * 6}, r"environment\.image must be one picture or five .*; got 6"),
    (HemiCube, {"orientation": "outside"}, r"unknown environment\.orientation 'outside'; .*opengl, inside"),
    (HemiCube, {"below": "black"}, r'environment\.below must be "mirrored" or 3 numbers, a colour; got \'black\''),
    (HemiCube, {"below": (1, 2)}, r"environment\.below must be 3 numbers; got \(1, 2\)"),
    (Hemisphere, {"image": ["a"] * 5}, r"environment\.image must be a path or an array; got list"),
    (Hemisphere, {"below": (-1, 0, 0)}, r"environment\.below\[0\] must be .*at least 0.*; got -1"),
    (Hemisphere, {"projection": "fisheye"}, r"unknown environment\.projection 'fisheye'; .*equidistant"),
    (Octahedral, {"image": 7}, r"environment\.image must be a path or an array; got int 7"),
    (LightProbe, {"image": None}, r"environment\.image must be a path or an array; got NoneType"),
    (LightProbe, {"projection": "mirrorball"}, r"unknown environment\.projection 'mirrorball'; .*'mirror-ball'"),
    (LatLong, {"position": (0, 0)}, r"environment\.position must be 3 numbers; got \(0, 0\)"),
    (LatLong, {"bounds": (0, 1)}, r"environment\.bounds must be one of BoxBounds, SphereBounds; got \(0, 1\)"),
    (LatLong, {"bounds": ROOM, "position": (2, 0, 0)}, r"environment\.position must lie inside environment\.bounds"),
    (LatLong, {"bounds": ROOM, "rotation": 1}, r"environment\.bounds is a box .*rotation must be 0; got 1"),
    (Captured, {"size": 3}, r"environment\.size must be .*at least 4 .*; got 3"),
    (Captured, {"faces": "sphere"}, r"unknown environment\.faces 'sphere'; .*cube, hemicube"),
    (Captured, {"bounces": 0}, r"environment\.bounces must be .*at least 1 .*; got 0"),
    (BoxBounds, {"low": (2, 0, 0)}, r"bounds\.low must be less than bounds\.high in x, y and z; got"),
    (BoxBounds, {"high": (1, NAN, 1)}, r"bounds\.high\[1\] must be .*; got nan"),
    (SphereBounds, {"centre": 1}, r"bounds\.centre must be 3 numbers; got 1"),
    (SphereBounds, {"radius": 0}, r"bounds\.radius must be .*; got 0"),
    (Surface, {"environment": "a.exr"}, r"surface\.environment must be one of Sky, .*Captured; got 'a\.exr'"),
    (Scene, {"environment": Captured()}, r"scene\.environment must be what is far away, .*surface\.environment"),
    (Material, {"transmission": 2}, r"material\.transmission must be .* at most 1; got 2"),
    (Quality, {"direction_error": -1}, r"quality\.direction_error must be .*at least 0.*; got -1"),
    (Scene, {"surfaces": Surface(Sphere())}, r"scene\.surfaces must be a list of Surface; got Surface\("),
    (Scene, {"surfaces": [Sphere()]}, r"scene\.surfaces\[0\] must be a Surface; got Sphere"),
    (Scene, {"environment": "a.exr"}, r"scene\.environment must be one of Sky, .*LatLong, CubeMap.*; got 'a\.exr'"),
    (Scene, {"camera": None}, r"scene\.camera must be a Camera; got None"),
    (Camera, {"eye": (0, 0)}, r"camera\.eye must be 3 numbers; got \(0, 0\)"),
    (Camera, {"eye": (0, 0, NAN)}, r"camera\.eye\[2\] must be a finite number .*; got nan"),
    (Camera, {"target": (0, 0, 4)}, r"camera\.target must differ from camera\.eye; got \(0\.0, 0\.0, 4\.0\) for both"),
    (Camera, {"up": (0, 0, 1)}, r"camera\.up must not be parallel to the view direction; got up"),
    (Camera, {"up": (0, 0, 0)}, r"camera\.up must not"),
    (Camera, {"fov": 180}, r"camera\.fov must be .* at most 179; got 180"),
    (Camera, {"fov": 0}, r"camera\.fov must be .*; got 0"),
    (Camera, {"projection": "ortho"}, r"unknown camera\.projection 'ortho'; did you mean 'orthographic'\?"),
    (Camera, {"height": 0}, r"camera\.height must be .*; got 0"),
    (Camera, {"near": 0}, r"camera\.near must be .*; got 0"),
    (Camera, {"near": 5, "far": 5}, r"camera\.far must be greater than camera\.near; got near 5, far 5"),
    (Quality, {"preset": "exat"}, r"unknown quality 'exat'; did you mean 'exact'\?"),
    (Quality, {"samples": 3}, r"quality\.samples must be a square number .*; got 3"),
    (Quality, {"samples": 2.5}, r"quality\.samples must be a whole number from 1 to 4096; got 2\.5"),
    (Quality, {"samples": 0}, r"quality\.samples must be .*at least 1.*; got 0"),
    (Quality, {"silhouette": 0}, r"quality\.silhouette must be .*; got 0"),
    (Quality, {"gloss_size": 100}, r"quality\.gloss_size must be a power of two; got 100"),
    (Quality, {"gloss_samples": 10**6}, r"quality\.gloss_samples must be .*at most 4096; got 1000000"),
    (Quality, {"texture_format": "double"}, r"unknown quality\.texture_format 'double'; .*half, float"),
    (Quality, {"bump_kernel": "prewitt"}, r"unknown quality\.bump_kernel 'prewitt'; .*central"),
    (Quality, {"bump_read": "bake"}, r"unknown quality\.bump_read 'bake'; did you mean 'baked'"),
    (Quality, {"bump_terms": "all"}, r"unknown quality\.bump_terms 'all'; .*small, auto, full"),
    (Quality, {"bump_format": "rgb7"}, r"unknown quality\.bump_format 'rgb7'; did you mean .rgb8"),
    (Quality, {"environment_filter": "linear"}, r"unknown quality\.environment_filter 'linear'; did you mean"),
]  # fmt: skip


@pytest.mark.parametrize(("cls", "values", "said"), REFUSED, ids=lambda v: v.__name__ if isinstance(v, type) else "")
def test_refused(cls: type[Any], values: dict[str, Any], said: str) -> None:
    with pytest.raises(SceneError) as caught:
        cls(**{**NEEDED[cls], **values})
    assert re.match(said, str(caught.value))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", KNOBS)
def test_every_knob_refuses_what_it_cannot_be(name: str) -> None:
    knob = KNOBS[name]
    wrong: list[Any] = ["some", 0.5, True]
    if knob.bounds is not None:
        wrong = ["4", float("nan"), knob.bounds[0] - 1, knob.bounds[1] + 1]
    for value in wrong:
        with pytest.raises(SceneError, match=f"quality.{name}"):
            Quality(**{name: value})
    for value in knob.values:
        assert getattr(Quality(**{name: value}), name) == value


def test_every_field_is_in_the_table_above() -> None:
    """No field goes untested: a new one must come with a value that it refuses."""
    named = {(cls, name) for cls, values, _ in REFUSED for name in values}
    missing = {(cls.__name__, f.name) for cls in NEEDED for f in fields(cls) if (cls, f.name) not in named}
    # Checked by the very lines that check a field of the table.
    same = {
        ("NormalMap", "normal_map"),
        *(("Quality", name) for name in KNOBS),
        # The fields of the classes they are derived from.
        *((cls.__name__, f.name) for cls in ENVIRONMENTS if cls is not LatLong for f in fields(Pictured)),
    }
    assert missing <= same


class Odd:
    """Has a length but no items, and a name of two lines."""

    def __len__(self) -> int:
        return 3

    def __repr__(self) -> str:
        return "odd\nthing"


JUNK: list[Any] = [
    None, "", "abc", "a\nb", b"1", b"x", True, NAN, INF, -INF, -1, 0, 1, 10**400, 1e308, -1e308, 1e-320, 2 + 3j,
    [], (), {}, {1, 2, 3}, {"x": 1}, [1], [1, 2], [1, 2, 3], [1, 2, 3, 4], [[1, 2], [3, 4]], [None] * 3,
    ["1", "2", "3"], [NAN] * 3, [INF, 0, 0], np.zeros(3), np.zeros((4, 3)), np.zeros(0), np.array(["a", "b", "c"]),
    np.zeros((2,) * 5), np.array(1.0), np.array([1.0]), np.float32(2), np.int64(3), Decimal(1), Decimal("nan"),
    Fraction(1, 3), object(), int, Sphere, Sphere(), Odd(), [Odd()] * 3, range(3), iter([1, 2, 3]), len, Material(),
    Camera(), [[0, 0, 0]] * 4, [[0, 0]] * 4, Path("x"), ["a"] * 6, [1] * 6, np.zeros((6, 4, 4, 3)),
]  # fmt: skip


@pytest.mark.parametrize("cls", NEEDED, ids=lambda cls: cls.__name__)
def test_any_value_in_any_field(cls: type[Any]) -> None:
    """Made whole, hashable and equal to itself, or refused in one line that names the field; nothing else."""
    made = 0
    for field in fields(cls):
        for value in JUNK:
            try:
                scene = cls(**{**NEEDED[cls], field.name: value})
            except SceneError as why:
                text = str(why)
                ok = "\n" not in text and (field.name in text or field.name == "preset")
                if not ok:
                    pytest.fail(f"{field.name} = {value!r}: {text}")
                continue
            made += 1
            assert hash(scene) == hash(scene)
            assert scene == scene
    assert made < len(JUNK) * len(fields(cls))


# What is allowed, and what becomes of it.


def test_values_are_stored_as_one_type() -> None:
    """Lists, arrays and NumPy numbers become tuples and floats, so equal scenes are equal."""
    assert Camera(eye=np.array([0, 0, 4])) == Camera(eye=[0, 0, 4]) == Camera()
    assert Material(metallic=np.float32(1)).metallic == 1.0
    assert type(Sphere(np.int64(2)).radius) is float
    assert Bump("a.png", 1, repeat=3).repeat == (3.0, 3.0)
    assert Transform(scale=2) == Transform(scale=(2, 2, 2))
    assert Scene(iter_surfaces(), LatLong("a")) == Scene((Surface(Sphere()),), LatLong(Path("a")))
    assert Quad(np.array(Quad().corners)) == Quad()
    assert LatLong("a.exr").image == Path("a.exr")
    assert Sky(up=[1, 1, 1]) == Sky(up=np.ones(3))
    assert Scene([]).environment == Sky()


def iter_surfaces() -> list[Surface]:
    return [Surface(Sphere())]


def test_scenes_are_frozen_arrays_included() -> None:
    pixels = np.ones((2, 2))
    bump = Bump(pixels, 1)
    pixels[:] = 7
    assert isinstance(bump.height, ArrayImage)
    assert np.all(bump.height.pixels == 1)
    with pytest.raises(ValueError, match="read-only"):
        bump.height.pixels[0, 0] = 3
    with pytest.raises(FrozenInstanceError):
        bump.amplitude = 3  # type: ignore[misc]
    assert bump == Bump(np.ones((2, 2)), 1)
    assert bump != Bump(np.zeros((2, 2)), 1)
    assert hash(bump) == hash(Bump(np.ones((2, 2)), 1))


def test_transform_order_and_sense() -> None:
    """Scaled, then turned about the world's x, y and z, counter-clockwise, then moved."""
    half = Transform(translate=(1, 2, 3), rotate=(90, 0, 0), scale=(2, 3, 4)).matrix()
    np.testing.assert_allclose(half @ [1, 1, 1, 1], [1 + 2, 2 - 4, 3 + 3, 1], atol=1e-15)
    np.testing.assert_allclose(Transform(rotate=(0, 90, 0)).matrix() @ [0, 0, 1, 1], [1, 0, 0, 1], atol=1e-15)
    np.testing.assert_allclose(Transform(rotate=(0, 0, 90)).matrix() @ [1, 0, 0, 1], [0, 1, 0, 1], atol=1e-15)
    both = Transform(rotate=(90, 90, 0)).matrix()  # x first: y -> z, then z -> x
    np.testing.assert_allclose(both @ [0, 1, 0, 1], [1, 0, 0, 1], atol=1e-15)


def test_quality_takes_what_is_not_given_from_its_preset() -> None:
    for preset, values in PRESETS.items():
        quality = Quality(preset)
        assert {name: getattr(quality, name) for name in values} == values
        assert Quality(preset, samples=9) == Quality(preset, **{**values, "samples": 9})
    assert quality_of("fast") == Quality("fast")
    assert quality_of(Quality("exact")) == Quality("exact")
    with pytest.raises(SceneError, match="unknown quality 'fats'; did you mean 'fast'"):
        quality_of("fats")


@pytest.mark.parametrize("size", [0, (0, 1), (1, -1), (10**6, 1), (1.5, 2), "512x512", (1, 2, 3), None, (NAN, 1)])
def test_sizes(size: Any) -> None:
    with pytest.raises(SceneError, match=r"^size(\[[01]\])? must be .*; got "):
        check_size(size)
    assert check_size(np.array([640.0, 480.0])) == (640, 480)


def with_value_cases() -> Iterator[Any]:
    scene = Scene([Surface(Sphere(), bump=Bump("b.png", 0.1))], LatLong("a.exr"))
    yield scene, "surface.0.bump.amplitude", 0.5, lambda s: s.surfaces[0].bump.amplitude == 0.5
    yield scene, "surface.0.shape", Torus(), lambda s: s.surfaces[0].shape == Torus()
    yield scene, "camera.eye.2", 9, lambda s: s.camera.eye == (0, 0, 9)
    yield scene, "environment.rotation", 90, lambda s: s.environment.rotation == 90


def test_with_value() -> None:
    for scene, name, value, reads in with_value_cases():
        assert reads(with_value(scene, name, value))
        assert not reads(scene)


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("surface.1.shape", Torus(), r"surface\.1\.shape: no item '1'; there are 1, counted from 0"),
        ("surface.²", Torus(), r"no item '²'"),
        ("surface.0.bump.amplitud", 1, r"bump\.amplitud: unknown field 'amplitud'; did you mean 'amplitude"),
        ("camera.fov.x", 1, r"camera\.fov\.x: fov has no fields to set; it is 40\.0"),
        ("camera.fov", 200, r"camera\.fov must be .*; got 200"),
    ],
)  # fmt: skip
def test_with_value_refuses(name: str, value: Any, said: str) -> None:
    scene = next(with_value_cases())[0]
    with pytest.raises(SceneError, match=said):
        with_value(scene, name, value)
