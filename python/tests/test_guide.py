"""Runs the examples of the guide."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"
GUIDE, RECORDED = DOCS / "python.md", DOCS / "python_recorded.md"
DATA = Path(os.environ.get("VOXTILE_DATA", DOCS.parent.parent / "shared" / "data")).resolve()


def blocks(text: str) -> list[str]:
    """Returns the Python blocks that are not marked as excluded."""
    found = re.findall(r"(<!-- not run by the test: [^\n]+ -->\n)?```python\n(.*?)```", text, re.DOTALL)
    return [block for left_out, block in found if not left_out]


def run(page: Path, folder: Path) -> str:
    parts = blocks(page.read_text())
    assert len(parts) >= 5
    program = folder / "guide.py"
    program.write_text("\n".join(parts))
    environment = {**os.environ, "VOXTILE_DATA": str(DATA)}
    done = subprocess.run(
        [sys.executable, program], cwd=folder, capture_output=True, text=True, check=False, env=environment
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_the_guide(tmp_path: Path) -> None:
    if not GUIDE.exists():
        pytest.skip("the guide is only in the repository")
    printed = run(GUIDE, tmp_path)
    assert "10 of 10" in printed and "nothing no_map" in printed


def test_the_guide_with_recorded_scans(tmp_path: Path) -> None:
    if not RECORDED.exists() or not (DATA / "mulran_riverside02_a").is_dir():
        pytest.skip(f"recorded sets are not at {DATA}; set VOXTILE_DATA to their folder")
    printed = run(RECORDED, tmp_path)
    assert "collides: False - sunk into the road: True" in printed
