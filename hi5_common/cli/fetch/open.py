"""The source that the options of a command ask for."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from uuid import UUID

from hi5_common.cli.fetch.api_source import ApiSource
from hi5_common.cli.fetch.source import DatasetSource
from hi5_common.cli.target import open_service
from hi5_common.settings import Settings


@contextmanager
def open_source(
    dataset_id: UUID, url: str | None, data_dir: Path | None, key_file: Path | None, *, direct: bool
) -> Iterator[DatasetSource]:
    """Read through the service, or with `direct` from the settings' database and store."""
    if direct:
        with _direct(dataset_id, data_dir) as source:
            yield source
        return
    with open_service(url, data_dir, key_file) as service:
        yield ApiSource(service, dataset_id)


@contextmanager
def _direct(dataset_id: UUID, data_dir: Path | None) -> Iterator[DatasetSource]:
    from hi5_common.cli.fetch.direct_source import DirectSource
    from hi5_common.db.engine import open_database
    from hi5_common.storage.open import open_store

    settings = Settings(data_dir=data_dir.resolve()) if data_dir else Settings()
    database = open_database(settings.resolved_database_url)
    try:
        yield DirectSource(database, open_store(settings), dataset_id, settings.resolved_assets_dir)
    finally:
        database.dispose()
