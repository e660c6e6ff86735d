"""Each study runs, tiny, and its page has its pictures and figures; nothing here is timed."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from benchmarks.figures import Table
from benchmarks.studies import command, heights8, waves
from benchmarks.studies.settings import few, save
from glbump.maps.gradients import derivative

NUMBERS = re.compile(r"(?<![\w.])(nan|inf|None)(?![\w.])", re.IGNORECASE)


@pytest.mark.parametrize("name", command.STUDIES)
def test_a_study_writes_a_page_with_its_pictures(name: str, tmp_path: Path) -> None:
    command.main([name, "--quick", "-o", str(tmp_path)])  # what it promises is of its full size
    text = (tmp_path / f"{name}.md").read_text()
    assert text.startswith("# ")
    assert f"`python -m benchmarks.studies {name}`" in text
    rows = [line for line in text.splitlines() if line.startswith("|")]
    assert len(rows) >= 3
    assert not [row for row in rows if NUMBERS.search(row)]
    shown = re.findall(r"!\[[^]]*\]\(([^)]+)\)", text)
    assert shown
    assert len(set(shown)) == len(shown)
    for picture in shown:
        if picture.endswith(".svg"):
            assert (tmp_path / picture).read_text().startswith("<svg ")
            continue
        with Image.open(tmp_path / picture) as file:
            pixels = np.asarray(file.convert("RGB"))
        if "error" not in picture:
            assert np.ptp(pixels) > 50, picture  # something is to be seen


@pytest.mark.parametrize("page", sorted(command.PAGES.glob("*.md")), ids=lambda page: page.stem)
def test_a_page_that_is_kept_has_all_that_it_shows(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#]+)[^)]*\)", page.read_text()):
        assert (page.parent / target).is_file(), target


def test_pages_weigh_little() -> None:
    assert sum(file.stat().st_size for file in command.PAGES.glob("*")) < 3 * 2**20


def test_a_study_that_there_is_not_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stopped:
        command.main(["kernel"])
    assert stopped.value.code == 2
    assert "no study kernel; there are displacement, " in capsys.readouterr().err


def test_a_table_takes_the_place_of_the_one_before() -> None:
    table = Table(("a",), [["1"]])
    text = "x\n<!-- t: made by `make studies`, do not edit -->\nold\n<!-- end of t -->\ny\n"
    once = command.with_table(text, "t", table)
    assert "| 1 |" in once
    assert "old" not in once
    assert once.endswith("<!-- end of t -->\ny\n")
    assert command.with_table(once, "t", table) == once
    assert command.with_table(text, "other", table) == text


def test_pictures_keep_what_they_show_in_few_colours(tmp_path: Path) -> None:
    ramp = np.repeat(np.linspace(0, 255, 64).astype(np.uint8)[None, :, None], 32, axis=0).repeat(3, axis=2)
    assert save(tmp_path / "ramp.png", ramp) == "![](ramp.png)"
    with Image.open(tmp_path / "ramp.png") as file:
        assert np.abs(np.asarray(file.convert("RGB")).astype(int) - ramp).max() <= 2  # 64 greys fit in 128 colours


def test_quick_rows_are_the_first_and_the_last() -> None:
    rows = {"a": 1, "b": 2, "c": 3}
    assert few(rows, True) == {"a": 1, "c": 3}
    assert few(rows, False) == rows


def test_the_waves_have_the_slopes_they_say() -> None:
    height, slope = waves.of_waves(32)
    texel = waves.SIDE / len(height)
    # Along u and v, so that a turned map is seen; a spline's slopes of waves of 32 texels are off by 1e-4 of them.
    for i, axis in enumerate((1, 0)):
        assert np.abs(derivative(height, axis, "bspline", "wrap") / texel - slope[..., i]).max() < 1e-3
    assert np.sqrt((slope**2).sum(axis=-1).mean()) == pytest.approx(waves.SLOPE, rel=0.05)  # of one draw of phases


def test_heights_are_kept_in_their_steps() -> None:
    height, _ = waves.of_waves(8)
    kept = heights8.stored(height, 8, 0, 0)
    assert len(np.unique(kept)) <= 256
    assert np.abs(kept - height).max() <= np.ptp(height) / 255 / 2 * (1 + 1e-9)
    assert np.array_equal(heights8.stored(height, 0, 0, 0), height)
    smooth = heights8.stored(height, 0, 0, 1)
    assert smooth.mean() == pytest.approx(height.mean())
    assert np.ptp(smooth) < np.ptp(height)
    assert len(np.unique(heights8.stored(height, 8, 1, 0))) <= 256
