"""`hi5 migrate`: bring the database to this version of hi5."""

from hi5_common.cli import console
from hi5_common.settings import Settings


def migrate() -> None:
    """Create the tables of HI5_DATABASE_URL or bring them to this version."""
    from hi5_common.db import migrate as migrations

    settings = Settings()
    url = settings.resolved_database_url
    migrations.upgrade(url)
    migrations.register_admin(url, settings.admin_key)
    console.out.print(f"database at revision {migrations.current(url)}")
