"""The tree's own rules, which no linter knows: sizes, names, and what no tracked file may say.

Run by scripts/check from the repository's root; prints one line a breach and exits 1.
"""

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

MAX_FILE_LINES = 400
MAX_FUNCTION_LINES = 60
BANNED_CLASS_SUFFIXES = ("Manager", "Helper", "Util", "Utils", "Utility")
TEXT_MAX_BYTES = 2_000_000
DECLARATIVE = "hi5_common/db/migrations/"  # a table's columns are one list, however long
PURE = ("hi5_common/domain/", "services/worker/scene/", "services/worker/label/")
PYTHON_ROOTS = ("hi5_common", "services", "tests", "scripts", "benchmarks")

# Put together from parts, or this file would break its own rule.
_HOSTS = (
    "py" + r"pi\.org",
    "python" + r"hosted\.org",
    "npm" + r"js\.(org|com)",
    "deb" + r"ian\.org",
)
_PLACES = ("/wo" + "rk/", "/ro" + r"ot/\.", "/tm" + "p/ev/", r"/ho" + r"me/[a-z]")
FORBIDDEN_TEXT = re.compile("|".join((*_HOSTS, *_PLACES)))


def tracked_files(root: Path) -> list[Path]:
    """Every file git knows, and every new one it would take, relative to `root`."""
    listing = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        cwd=root,
        check=True,
        capture_output=True,
        text=True,
    ).stdout
    return [Path(name) for name in listing.split("\0") if name]


def breaches_of_text(path: Path, text: str) -> Iterator[str]:
    """Registry hosts and paths of one machine: a clone elsewhere must not lean on them."""
    for number, line in enumerate(text.splitlines(), start=1):
        if found := FORBIDDEN_TEXT.search(line):
            yield f"{path}:{number}: names a registry host or a machine's path: {found[0]!r}"


def breaches_of_python(path: Path, text: str) -> Iterator[str]:
    """Files past 400 lines, functions past 60, names that say nothing."""
    if (count := len(text.splitlines())) > MAX_FILE_LINES:
        yield f"{path}: {count} lines, more than {MAX_FILE_LINES}: two nouns in one file?"
    for node in ast.walk(ast.parse(text)):
        yield from _breaches_of_node(path, node)


def _breaches_of_node(path: Path, node: ast.AST) -> Iterator[str]:
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
        lines = (node.end_lineno or node.lineno) - node.lineno + 1
        if lines > MAX_FUNCTION_LINES and not str(path).startswith(DECLARATIVE):
            yield f"{path}:{node.lineno}: {node.name}: {lines} lines, over {MAX_FUNCTION_LINES}"
        yield from _breaches_of_defaults(path, node)
    if isinstance(node, ast.ClassDef) and node.name.endswith(BANNED_CLASS_SUFFIXES):
        yield f"{path}:{node.lineno}: class {node.name}: name it for what it is"


def _breaches_of_defaults(
    path: Path, node: ast.FunctionDef | ast.AsyncFunctionDef
) -> Iterator[str]:
    arguments = node.args.posonlyargs + node.args.args
    with_default = arguments[len(arguments) - len(node.args.defaults) :] + [
        argument
        for argument, default in zip(node.args.kwonlyargs, node.args.kw_defaults, strict=True)
        if default is not None
    ]
    # Where a database is at hand its own clock may be the default; in pure code nothing may.
    required = {"rng", "now"} if str(path).startswith(PURE) else {"rng"}
    for argument in with_default:
        if argument.arg in required:
            yield f"{path}:{node.lineno}: {node.name}: {argument.arg} must be a required argument"


def breaches(root: Path) -> Iterator[str]:
    """Every breach in the tracked tree under `root`, as `path:line: what is wrong`."""
    for path in tracked_files(root):
        if not (root / path).is_file() or (root / path).stat().st_size > TEXT_MAX_BYTES:
            continue
        try:
            text = (root / path).read_text(encoding="utf-8")
        except UnicodeDecodeError:
            continue  # a picture or an archive
        yield from breaches_of_text(path, text)
        if path.suffix == ".py" and path.parts[0] in PYTHON_ROOTS:
            yield from breaches_of_python(path, text)


def main() -> int:
    """Print every breach; 1 when there is one."""
    found = list(breaches(Path.cwd()))
    for breach in found:
        print(breach)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
