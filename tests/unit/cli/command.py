"""The command line in this process, as a shell sees it."""

from dataclasses import dataclass
from typing import Protocol

import pytest

from hi5_common.cli import app


@dataclass(frozen=True)
class Finished:
    """Exit code and what was printed."""

    code: int
    out: str
    err: str


class Command(Protocol):
    """Runs `hi5` with arguments."""

    def __call__(self, *arguments: object) -> Finished: ...


@pytest.fixture
def hi5(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Command:
    """Return a function that runs `hi5` here."""

    def run(*arguments: object) -> Finished:
        monkeypatch.setattr("sys.argv", ["hi5", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            app.main()
        printed = capsys.readouterr()
        return Finished(int(ended.value.code or 0), printed.out, printed.err)

    return run
