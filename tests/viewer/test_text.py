"""Words on the window: they fit, whatever they are."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from glbump.viewer import text

from .driving import in_window, press, settle, viewing


@pytest.mark.parametrize(
    "words",
    [
        "x",
        " ",
        "a\n\nb",
        "of words that are broken between two of them " * 5,
        "/a/path/without/a/space" * 20,
        "日本 ☃ 😀 \x07 \u202e",
        os.fsdecode(b"\xff"),
    ],
)
def test_rows_fit_and_nothing_is_lost(words: str) -> None:
    font, room = text._font(14), 200.0
    for line in words.split("\n"):
        rows = [row for row, _ in text._rows(line, font, room)]
        assert "".join(rows).replace(" ", "") == line.replace(" ", "")
        assert all(font.getlength(row) <= room for row in rows)
    assert text.plate(words, "error", 300).shape[1] <= 300


def test_a_long_word_takes_no_longer_than_as_many_short_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    """Measured in letters that are measured: rows of it each are looked at some ten times, not all of it every time."""
    font, letters = text._font(14), []

    class Counting:
        def getlength(self, row: str) -> float:
            letters.append(len(row))
            return font.getlength(row)

    text._rows("x" * 5000, Counting(), 200.0)
    assert sum(letters) < 100 * 5000


@in_window
def test_a_file_may_be_called_what_is_no_text(folder: Path) -> None:
    """Bytes that are not UTF-8: the scene is shown, under a name that can be."""
    from glbump.viewer.opening import opened

    file = folder / os.fsdecode(b"\xff.toml")
    try:
        file.write_text("[environment]\nkind = 'chrome'\n")
    except OSError:
        return  # Not on this file system.
    with viewing(lambda contents: opened(file, contents), size=(640, 480), folder=folder) as viewer:
        for key in ("f2", "f12", "i"):
            press(viewer, key)
            settle(viewer)
        assert viewer.shown.trouble == ""
        assert viewer.shown.subject.name == "?.toml"
        assert viewer.shown.note.endswith("?.png  " + "x".join(map(str, viewer.stage.room)))
