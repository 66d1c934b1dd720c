import pytest
from rich.console import Console
from rich.table import Table

from hi5_common.cli import console


def test_a_table_is_never_cut(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(console, "out", Console(width=20, soft_wrap=True))
    table = Table("id", "name", box=None)
    table.add_row("0123456789-0123456789-0123456789", "a name of several words")
    console.print_table(table)
    lines = capsys.readouterr().out.splitlines()
    assert lines[1].split(maxsplit=1)[0] == "0123456789-0123456789-0123456789"
    assert lines[1].rstrip().endswith("a name of several words")
