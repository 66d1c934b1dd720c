import subprocess
from pathlib import Path

import pytest

from scripts import tree_rules
from tests.house.requirements import ROOT


def test_the_tree_keeps_its_own_rules() -> None:
    assert list(tree_rules.breaches(ROOT)) == []


@pytest.mark.parametrize(
    ("text", "breach"),
    [
        ("x = 1\n" * 401, "401 lines"),
        ("def f():\n" + "    x = 1\n" * 60, "61 lines"),
        ("class ShardManager:\n    pass\n", "name it for what it is"),
        ("def f(n, rng=None):\n    pass\n", "rng must be a required argument"),
        ("def f(*, now=0.0):\n    pass\n", "now must be a required argument"),
    ],
)
def test_a_breach_in_code_is_found(text: str, breach: str) -> None:
    found = list(tree_rules.breaches_of_python(Path("hi5_common/domain/f.py"), text))
    assert len(found) == 1
    assert breach in found[0]


def test_code_that_keeps_the_rules_passes() -> None:
    text = "x = 1\n" * 398 + "def f(a, rng, *, now):\n    pass\n"
    assert list(tree_rules.breaches_of_python(Path("f.py"), text)) == []


@pytest.mark.parametrize(
    "words", [("py", "pi.org"), ("python", "hosted.org"), ("/wo", "rk/main"), ("/ho", "me/someone")]
)
def test_a_host_or_a_machine_path_is_found(words: tuple[str, str]) -> None:
    line = "see " + "".join(words)
    (found,) = tree_rules.breaches_of_text(Path("f.md"), f"a\n{line}\n")
    assert found.startswith("f.md:2:")


def test_tracked_and_new_files_are_read_and_ignored_ones_are_not(tmp_path: Path) -> None:
    subprocess.run(["git", "init", "-q"], cwd=tmp_path, check=True)
    (tmp_path / ".gitignore").write_text("out/\n")
    (tmp_path / "out").mkdir()
    for name in ("new.txt", "out/ignored.txt"):
        (tmp_path / name).write_text("py" + "pi.org\n")
    assert [line.partition(":")[0] for line in tree_rules.breaches(tmp_path)] == ["new.txt"]
