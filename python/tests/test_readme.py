"""Every example of the README, from top to bottom, and what it prints."""

import contextlib
import io
import re
from pathlib import Path

import pytest

README = (Path(__file__).parents[1] / "README.md").read_text()
EXAMPLES = re.findall(r"```python\n(.*?)```\n(?:```\n(.*?)```)?", README, re.DOTALL)


def test_every_example_does_what_it_says(tmp_path, monkeypatch):
    pytest.importorskip("unified_planning")
    monkeypatch.chdir(tmp_path)
    names = {}
    assert len(EXAMPLES) >= 7
    for code, expected in EXAMPLES:
        said = io.StringIO()
        with contextlib.redirect_stdout(said):
            exec(compile(code, "README.md", "exec"), names)
        assert said.getvalue().split() == expected.split(), f"{code}\n{said.getvalue()}"
