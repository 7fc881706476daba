"""The guide runs from top to bottom."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

GUIDE = Path(__file__).parents[2] / "docs" / "python.md"


def blocks(text: str) -> list[str]:
    """The blocks of Python that are not said to be left out."""
    found = re.findall(r"(<!-- not run by the test: [^\n]+ -->\n)?```python\n(.*?)```", text, re.DOTALL)
    return [block for left_out, block in found if not left_out]


def test_the_guide(tmp_path: Path) -> None:
    if not GUIDE.exists():
        pytest.skip("the guide is in the repository")
    parts = blocks(GUIDE.read_text())
    assert len(parts) >= 7
    program = tmp_path / "guide.py"
    program.write_text("\n".join(parts))
    done = subprocess.run(
        [sys.executable, program], cwd=tmp_path, capture_output=True, text=True, check=False, env=dict(os.environ)
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "10 of 10" in done.stdout and "nothing no_map" in done.stdout
