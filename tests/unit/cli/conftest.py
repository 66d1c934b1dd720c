"""Commands run here never see a service or the data of the person who runs the tests."""

from pathlib import Path

import pytest

from tests.unit.cli.command import hi5

__all__ = ["alone", "hi5"]


@pytest.fixture(autouse=True)
def alone(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for name in ("HI5_URL", "HI5_API_KEY", "HI5_API_KEY_FILE", "HI5_DATABASE_URL"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HI5_DATA_DIR", str(tmp_path / "data"))
