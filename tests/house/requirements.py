"""Reads the locks and what pyproject.toml asks for."""

import re
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parents[2]
LOCKS = ROOT / "locks"


@dataclass(frozen=True)
class LockEntry:
    """One pinned package: its canonical name, its version, and how many hashes pin its files."""

    name: str
    version: str
    hashes: int


def read_lock(name: str) -> dict[str, LockEntry]:
    """Return the entries of locks/<name>.txt by canonical name."""
    text = (LOCKS / f"{name}.txt").read_text().replace("\\\n", " ")
    return {entry.name: entry for line in text.splitlines() if (entry := _entry(line))}


def _entry(line: str) -> LockEntry | None:
    if not line.strip():
        return None
    found = re.fullmatch(r"([\w.-]+)==(\S+)( ; [^-]+?)?((?: +--hash=sha256:[0-9a-f]{64})*) *", line)
    assert found, f"not a pinned entry: {line[:80]!r}"
    return LockEntry(canonicalize_name(found[1]), found[2], found[4].count("--hash="))


def project() -> dict[str, Any]:
    """Return pyproject.toml's [project] table."""
    table: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    return table


def direct(*extras: str) -> set[str]:
    """Return the canonical names hi5 asks for itself, with the named extras."""
    table = project()
    lines: list[str] = list(table["dependencies"])
    for extra in extras:
        lines += table["optional-dependencies"][extra]
    return {str(canonicalize_name(Requirement(line).name)) for line in lines} - {"hi5"}
