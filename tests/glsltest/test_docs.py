"""What README and docs/shader-tests.md say works as they say it."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from glbump.glsltest import inputs

from .test_plugin import run

ROOT = Path(__file__).parents[2]
DOCS = (ROOT / "docs" / "shader-tests.md").read_text(encoding="utf-8")
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(text: str) -> list[str]:
    return re.findall(r"```python\n(.*?)```", text, re.DOTALL)


@pytest.mark.parametrize("text", [README, DOCS], ids=["README", "docs"])
def test_the_test_to_paste_passes_in_each_way_and_can_fail(text: str, tmp_path: Path) -> None:
    (pasted,) = (b for b in blocks(text) if "def test_fresnel" in b)
    status, said = run(tmp_path, pasted, "--glsl-backend=all")
    assert status == 0, said
    assert "3 passed" in said
    status, said = run(tmp_path, pasted.replace("cos_theta, 5.0", "cos_theta, 4.0"))
    assert status == 1
    assert re.search(r"fresnel: 9\d\d of 1000 rows differ", said)  # but where nothing is left of 1 - cos


def test_the_lines_without_pytest() -> None:
    (code,) = (b for b in blocks(DOCS) if "with Glsl()" in b)
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["[1.", "1.", "0.]"]


def test_what_it_names_is_there(tmp_path: Path) -> None:
    _, said = run(tmp_path, "def test_a(): pass\n", "--help")
    for option in set(re.findall(r"--glsl-[a-z-]+", DOCS)):
        assert option in said, option
    section = DOCS.split("## Rows that find bugs")[1].split("##")[0]
    for name in re.findall(r"`([a-z_]+)`", section.split("strategies")[0]):
        assert hasattr(inputs, name), name
