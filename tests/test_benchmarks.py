"""The benchmarks run, and their bookkeeping is right; nothing here is timed."""

from __future__ import annotations

import json
from pathlib import Path

import moderngl
import numpy as np
import pytest

from benchmarks import (
    accuracy,
    capture,
    command,
    conversion,
    diffuse,
    first_picture,
    frame_cost,
    gloss,
    kernels,
    layouts,
    model,
    normal_formats,
    normals,
    plain,
    scenes,
    soak,
    window,
)
from benchmarks.figures import Section, Table, Target, markdown, write
from benchmarks.noted import deviation, largest
from benchmarks.recording import listening
from glbump.gl.native import Native
from glbump.meshfile import load_mesh
from glbump.trade import timing
from glbump.trade.metrics import compare

# Figures


def test_a_target_is_kept_up_to_its_limit_and_never_by_nan() -> None:
    assert Target.at_most("x", 1.0, 1.0).kept
    assert not Target.at_most("x", 1.0001, 1.0).kept
    assert not Target.at_most("x", float("nan"), 1.0).kept
    assert Target.at_most("x", 0.51, 0.7, " times").got == "0.51 times"


def test_a_table_refuses_rows_that_do_not_fit() -> None:
    with pytest.raises(ValueError, match="a row of 1 under 2 headings"):
        Table(("a", "b"), [["only one"]])


def test_sections_become_markdown_and_json(tmp_path: Path) -> None:
    kept, broken = Target.at_most("speed", 0.5, 0.7), Target.at_most("growth", 9.0, 8.0, " MiB")
    section = Section("Title", "How.", (Table(("name", "value"), [["a", 1.23456], ["b", 12345.6]]),), (kept, broken))
    text = markdown(section)
    assert "| a    |  1.23 |\n| b    | 12346 |" in text
    assert "| growth   | 9 MiB    | at most 8 MiB | **no** |" in text
    write(tmp_path, "Intro.", {"CPUs": 2}, [section])
    page = (tmp_path / "benchmarks.md").read_text()
    assert page.startswith("# Benchmarks\n\nIntro.\n\n| machine |")
    assert "| CPUs    | 2 |" in page
    content = json.loads((tmp_path / "benchmarks.json").read_text())
    assert content["machine"] == {"CPUs": 2}
    assert [t["kept"] for t in content["sections"][0]["targets"]] == [True, False]


def test_what_was_noted_is_compared_as_it_was_printed() -> None:
    assert deviation(0.1049, "0.10") == 0  # 0.10 may have been 0.105
    assert deviation(0.115, "0.10") == pytest.approx(10)
    assert deviation(1e-5, "0.0") == 0
    assert deviation(1.0, "0.0") == float("inf")
    assert not largest("x", [0.0, 5.1]).kept


def test_sections_named_leave_the_others_as_they_are(tmp_path: Path) -> None:
    here, there = {"CPUs": 2}, {"CPUs": 16}
    write(tmp_path, "Intro.", here, [Section("A", "How.", ()), Section("B", "Old.", (Table(("x",), [["1"]]),))])
    write(tmp_path, "Intro.", there, [Section("C", "More.", ()), Section("A", "Again.", ())], keep=True)
    page = (tmp_path / "benchmarks.md").read_text()
    assert page.index("| CPUs    | 2 |") < page.index("## A") < page.index("## B") < page.index("## C")
    assert "## A\n\nMeasured on: CPUs 16.\n\nAgain." in page
    assert "## B\n\nOld.\n\n| x |" in page
    write(tmp_path, "Intro.", there, [Section("C", "All.", ())])
    assert "## A" not in (tmp_path / "benchmarks.md").read_text()


# Timing


def test_calls_take_turns_in_an_order_of_chance() -> None:
    made: list[str] = []
    calls = {name: (lambda n=name: made.append(n)) for name in "abc"}
    clock = iter(np.arange(0.0, 1000.0, 0.5))
    times = timing.in_turns(calls, 60, warm_up=1, cpu=lambda: float(next(clock)))
    assert made[:3] == ["a", "b", "c"]
    turns = ["".join(made[i : i + 3]) for i in range(3, len(made), 3)]
    assert len(turns) == 60
    assert set(turns) == {"abc", "acb", "bac", "bca", "cab", "cba"}
    for name in "abc":
        assert len(times[name].wall) == 60
        assert set(times[name].cpu) == {0.5}


def test_ratios_are_taken_turn_by_turn() -> None:
    # The machine is ten times slower in two of the turns, for both: their ratio does not notice.
    base, times = [1.0, 10.0, 1.0, 10.0, 1.0], [1.5, 15.0, 1.5, 15.0, 1.5]
    assert timing.ratios(times, base) == timing.Spread(1.5, 1.5, 1.5)
    assert timing.spread([1.0, 2.0, 3.0, 4.0, 5.0]) == timing.Spread(3.0, 2.0, 4.0)
    assert timing.differences([3.0, 5.0], [1.0, 1.0]).median == 3.0


# What is compared is the same picture


def test_a_recorded_frame_replays_to_the_same_pixels() -> None:
    scene = scenes.bumped_ball(scenes.evening())
    renderer, bare = frame_cost.bare_draw((64, 48), "balanced", scene)
    with renderer:
        wanted = renderer.render(scene, (64, 48), "balanced")
        renderer.render(scenes.mirror_ball(scenes.evening()), (64, 48), "balanced")  # draws over everything
        renderer.render(scene, (64, 48), "balanced")
        first, second = bare(), bare()
        assert isinstance(first, np.ndarray)
        assert isinstance(second, np.ndarray)
        assert first is not second
        assert np.array_equal(first[::-1].astype(np.float32), wanted.pixels)
        assert np.array_equal(first, second)


def test_listening_leaves_moderngl_as_it_was() -> None:
    before = moderngl.VertexArray.render, moderngl.Uniform.value, Native.entry
    with listening() as recording:
        assert moderngl.VertexArray.render is not before[0]
    assert (moderngl.VertexArray.render, moderngl.Uniform.value, Native.entry) == before
    assert recording.calls == []


def test_the_bare_script_draws_what_glbump_draws(tmp_path: Path) -> None:
    lines = first_picture.commands(tmp_path, 64)
    for quality in ("fast", "balanced"):
        for name in (f"bare, {quality}", quality):
            first_picture.run(lines[name], tmp_path)
    from glbump.maps.images import read_colour

    if not (scenes.DATA / "openexr" / "KernerEnvLatLong.exr").is_file():
        pytest.skip("the bare script reads OpenEXR's lat-long with the header obeyed, as the photograph has it")
    for quality, most in (("fast", 0.02), ("balanced", 0.02)):
        ours, bare = (read_colour(tmp_path / f"{name}.png").pixels for name in (quality, f"bare-{quality}"))
        # Fast looks up a cube, balanced finds its levels otherwise; a wrong sign or turn differs by 0.1 and more.
        assert compare(ours, bare, perceptual=False)["mean"] < most


def test_the_cushion_is_a_sound_mesh() -> None:
    mesh = load_mesh(scenes.cushion_file())
    assert len(mesh.triangles) == 2 * 48 * 23
    assert mesh.notes == ()
    assert mesh.normals is not None
    assert mesh.dpdu is not None
    assert np.abs((np.abs(mesh.positions) ** 3).sum(axis=1) - 1).max() < 1e-6  # float32's rounding
    outwards = np.einsum("vi,vi->v", mesh.normals, mesh.positions)
    assert outwards.min() > 0.5


# The sections, tiny


SECTIONS = [
    accuracy,
    frame_cost,
    capture,
    plain,
    first_picture,
    soak,
    kernels,
    layouts,
    diffuse,
    gloss,
    conversion,
    normal_formats,
    normals,
    window,
    model,
]


@pytest.mark.parametrize("section", SECTIONS, ids=lambda m: m.__name__)
def test_a_section_measures(section: object) -> None:
    result = section.measure(True)  # type: ignore[attr-defined]
    assert result.tables[0].rows or section is accuracy
    assert markdown(result).startswith(f"## {result.title}\n")
    if section is soak:
        # Counts, not times: these hold at any size.
        assert [t.what for t in result.targets if not t.kept] == []


def test_the_command_refuses_what_it_does_not_know(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stopped:
        command.main(["acuracy"])
    assert stopped.value.code == 2
    assert "no section acuracy" in capsys.readouterr().err


def test_the_command_writes_what_it_measured(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sections = {"plain": Section("Fast", "How.", (), (Target.at_most("speed", 0.5, 0.7),))}
    monkeypatch.setattr(plain, "measure", lambda quick: sections["plain"])
    assert command.main(["plain", "-o", str(tmp_path)]) == 0
    assert "## Fast" in (tmp_path / "benchmarks.md").read_text()
    monkeypatch.setattr(plain, "measure", lambda quick: Section("Slow", "", (), (Target.at_most("speed", 1.0, 0.7),)))
    assert command.main(["plain", "-o", str(tmp_path)]) == 1
