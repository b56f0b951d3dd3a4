"""The named numbers of each package: names in capitals at the top of a module whose value holds a number."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MOST = {"drivers": 286, "restore": 1034, "station": 340}  # may fall, and not rise


def named_numbers(package: str) -> list[str]:
    """Module and name of each."""
    found = []
    for path in (ROOT / package).rglob("*.py"):
        for node in ast.parse(path.read_text("utf-8")).body:
            value = node.value if isinstance(node, ast.Assign | ast.AnnAssign) else None
            numbers = (part for part in ast.walk(value or ast.Pass()) if isinstance(part, ast.Constant))
            if value is not None and any(type(part.value) in (int, float) for part in numbers):
                targets = node.targets if isinstance(node, ast.Assign) else [node.target]
                names = {part.id for target in targets for part in ast.walk(target) if isinstance(part, ast.Name)}
                found += [f"{path.relative_to(ROOT)}: {name}" for name in sorted(names) if name.isupper()]
    return found


@pytest.mark.parametrize("package", MOST)
def test_named_numbers_become_no_more(package):
    """A limit that follows from the noise, or a method that needs none, comes before a new number."""
    assert len(named_numbers(package)) <= MOST[package]
