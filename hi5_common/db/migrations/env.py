"""What Alembic runs: the revisions, inside the transaction that migrate.py has begun."""

from alembic import context

from hi5_common.db.tables import Base

connection = context.config.attributes["connection"]
context.configure(
    connection=connection,
    target_metadata=Base.metadata,
    transactional_ddl=True,
    render_as_batch=connection.dialect.name == "sqlite",
)
context.run_migrations()
