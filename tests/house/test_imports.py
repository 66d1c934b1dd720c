"""Each part imports at module level only what its own install brings."""

import ast
import sys
from collections.abc import Iterator
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest
from packaging.utils import canonicalize_name

from tests.house.requirements import ROOT, direct, read_lock

OURS = {"hi5_common", "services", "tests", "scripts", "benchmarks"}
# Not a distribution of its own: Blender's wheel brings it.
BROUGHT = {"mathutils": "bpy"}
# Runs in an environment of its own, pinned by benchmarks/detector/requirements.txt.
APART = {"mediapipe"}


def imported(path: Path, *, everywhere: bool) -> Iterator[str]:
    """Top-level names that a file imports; without `everywhere` only those at module level."""
    tree = ast.parse(path.read_text())
    for node in ast.walk(tree) if everywhere else tree.body:
        if isinstance(node, ast.Import):
            yield from (alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module.partition(".")[0]


def third_party(folder: str, *, everywhere: bool) -> dict[str, str]:
    """Canonical distribution name to one file that imports it, for the sources under a folder."""
    distributions = packages_distributions()
    found: dict[str, str] = {}
    for path in sorted((ROOT / folder).rglob("*.py")):
        for name in imported(path, everywhere=everywhere):
            if name in OURS or name in sys.stdlib_module_names:
                continue
            distribution = BROUGHT.get(name) or distributions.get(name, [name])[0]
            found[canonicalize_name(distribution)] = str(path.relative_to(ROOT))
    return found


@pytest.mark.parametrize(
    ("folder", "extras"),
    [("hi5_common", []), ("services/api", ["api"]), ("services/worker", ["worker"])],
)
def test_a_part_asks_for_what_it_imports(folder: str, extras: list[str]) -> None:
    asked = direct(*extras)
    found = third_party(folder, everywhere=False)
    assert {name: file for name, file in found.items() if name not in asked} == {}


def test_every_import_anywhere_is_pinned() -> None:
    pinned = read_lock("dev").keys()
    found: dict[str, str] = {}
    for folder in ("hi5_common", "services", "tests", "scripts", "benchmarks"):
        found |= third_party(folder, everywhere=True)
    assert {name: file for name, file in found.items() if name not in pinned | APART} == {}
