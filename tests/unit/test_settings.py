import hashlib
from pathlib import Path

import pytest

from hi5_common.settings import RendererName, Settings
from hi5_common.storage.open import open_store


def test_one_machine_needs_no_settings(tmp_path: Path) -> None:
    settings = Settings(data_dir=tmp_path)
    assert settings.resolved_database_url == f"sqlite:///{tmp_path}/hi5.sqlite"
    assert settings.resolved_store_url == f"file://{tmp_path}/store"
    assert settings.renderer is RendererName.CYCLES


def test_settings_come_from_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HI5_LEASE_S", "30")
    monkeypatch.setenv("HI5_RENEW_S", "5")
    assert (Settings().lease_s, Settings().renew_s) == (30, 5)


def test_secrets_may_lie_in_files(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "url").write_text("postgresql://hi5:secret@db/hi5\n", "utf-8")
    monkeypatch.setenv("HI5_DATABASE_URL_FILE", str(tmp_path / "url"))
    settings = Settings()
    assert settings.resolved_database_url == "postgresql://hi5:secret@db/hi5"
    assert "secret" not in repr(settings)


def test_a_secret_file_that_is_not_there_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HI5_BROKER_URL_FILE", "/nowhere/broker")
    with pytest.raises(ValueError, match=r"HI5_BROKER_URL_FILE.*/nowhere/broker"):
        Settings()


def test_a_lease_must_be_renewable_in_time() -> None:
    with pytest.raises(ValueError, match="HI5_RENEW_S"):
        Settings(lease_s=60, renew_s=45)


def test_a_childs_limits_must_agree() -> None:
    with pytest.raises(ValueError, match="HI5_CHILD_MEMORY_LIMIT_MB"):
        Settings(child_memory_mb=4000, child_memory_limit_mb=3000)


def test_a_data_folder_may_have_any_name(tmp_path: Path) -> None:
    folder = tmp_path / "50%20 off #1?"
    store = open_store(Settings(data_dir=folder))
    store.put("key", b"data", hashlib.sha256(b"data").hexdigest())
    assert (folder / "store" / "key").read_bytes() == b"data"
