"""`hi5 keys`: keys to the API, made and ended in the database itself."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from datetime import datetime
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape
from rich.table import Table

from hi5_common.cli import console
from hi5_common.cli.console import Json
from hi5_common.cli.options import DataDirOption, JsonOption
from hi5_common.cli.target import NoServiceRuns
from hi5_common.db import keys
from hi5_common.db.engine import Database, open_database
from hi5_common.db.keys import ApiKey, Granted, MadeKey
from hi5_common.domain.access import Quota, Scope
from hi5_common.domain.api_key import parse_key
from hi5_common.domain.errors import InvalidInput, Problem
from hi5_common.settings import Settings

app = typer.Typer(
    name="keys",
    help="Keys to the API, in the database of HI5_DATABASE_URL: create, list, revoke, rotate.",
)

SECONDS = {"m": 60, "h": 3600, "d": 86_400, "w": 604_800}
_DURATION = re.compile(r"([1-9]\d{0,6})([mhdw])")

IdArgument = Annotated[str, typer.Argument(metavar="ID", help="The key's id, not the key.")]
Most = Annotated[int | None, typer.Option(min=1, help="The most that its owner may have.")]


@app.command("create")
def create(
    owner: Annotated[str, typer.Option(help="Whose datasets it opens.")],
    scope: Annotated[Scope, typer.Option(help="read, write, or admin: all owners' datasets.")],
    expires: Annotated[
        str | None, typer.Option(help="How long it is good for: 90d, 12h; for ever unless given.")
    ] = None,
    images: Most = None,
    pixels: Most = None,
    samples: Most = None,
    as_json: JsonOption = False,
    data_dir: DataDirOption = None,
) -> None:
    """Make a key and print it, this once: only its SHA-256 is kept."""
    quota = Quota(images, pixels, samples)
    granted = Granted(owner, scope, quota, valid_s=_seconds(expires))
    with _database(data_dir) as database, database.transaction() as session:
        made = keys.create(session, granted)
    _print_made(made, as_json)


@app.command("list")
def list_keys(as_json: JsonOption = False, data_dir: DataDirOption = None) -> None:
    """List keys, the newest first: everything but the keys themselves."""
    with _database(data_dir) as database, database.snapshot() as session:
        found = keys.every(session)
    if as_json:
        console.write_json([_document(key) for key in found])
        return
    columns = ("id", "owner", "scope", "state", "created", "last used", "quota", "note")
    table = Table(*columns, box=None, padding=(0, 1, 0, 0))
    for key in found:
        table.add_row(
            key.id,
            key.owner,
            key.scope.value,
            _state(key),
            _day(key.created_at),
            _day(key.last_used_at),
            _quota(key.quota),
            escape(key.note),
        )
    console.print_table(table)


@app.command("revoke")
def revoke(key_id: IdArgument, data_dir: DataDirOption = None) -> None:
    """End a key and its sessions. A running service knows within seconds."""
    with _database(data_dir) as database, database.transaction() as session:
        keys.revoke(session, key_id)
    console.out.print(f"revoked {key_id}")


@app.command("rotate")
def rotate(
    key_id: IdArgument,
    overlap: Annotated[
        str | None, typer.Option(help="How long the old one stays good: 1d; not at all unless.")
    ] = None,
    expires: Annotated[str | None, typer.Option(help="How long the new one is good for.")] = None,
    as_json: JsonOption = False,
    data_dir: DataDirOption = None,
) -> None:
    """Make a key that allows what another does, print it, and end the other."""
    overlap_s, valid_s = _seconds(overlap, "--overlap"), _seconds(expires)
    with _database(data_dir) as database, database.transaction() as session:
        old = keys.get(session, key_id)
        if old.revoked_at is not None:
            raise InvalidInput([Problem("ID", key_id, "It was revoked: create a new one.")])
        made = keys.create(session, Granted(old.owner, old.scope, old.quota, old.note, valid_s))
        if overlap_s is None:
            keys.revoke(session, key_id)
        else:
            keys.expire_in(session, key_id, overlap_s)
    _print_made(made, as_json)


@app.command("link")
def link(data_dir: DataDirOption = None) -> None:
    """Print an address that signs a browser in to the local `hi5 up`, once."""
    from hi5_common.cli.stack import connection, own_key

    running = connection.find(data_dir)
    known = parse_key(running.key) if running is not None else None
    if running is None or known is None:
        raise NoServiceRuns(data_dir or Settings().data_dir)
    with _database(data_dir) as database:
        found = own_key.one_time_link(database, running.url, known.id)
    console.out.print(found, markup=False)


@contextmanager
def _database(data_dir: Path | None) -> Iterator[Database]:
    settings = Settings(data_dir=data_dir.resolve()) if data_dir else Settings()
    database = open_database(settings.resolved_database_url)
    try:
        yield database
    finally:
        database.dispose()


def _print_made(made: MadeKey, as_json: bool) -> None:
    if as_json:
        console.write_json({"key": made.text, **_document(made.key)})
        return
    console.out.print(made.text, markup=False)
    console.err.print(
        f"key {made.key.id}: {made.key.scope} for {made.key.owner}, "
        f"{_state(made.key)}. It is not shown again; give it as HI5_API_KEY, or in a file."
    )


def _seconds(duration: str | None, option: str = "--expires") -> float | None:
    if duration is None:
        return None
    found = _DURATION.fullmatch(duration)
    if found is None:
        remedy = "Give a whole number of m(inutes), h(ours), d(ays) or w(eeks), such as 90d."
        raise InvalidInput([Problem(option, duration, remedy)])
    return float(int(found[1]) * SECONDS[found[2]])


def _document(key: ApiKey) -> dict[str, Json]:
    return {
        name: value.isoformat() if isinstance(value, datetime) else value
        for name, value in asdict(key).items()
    }


def _state(key: ApiKey) -> str:
    if key.revoked_at is not None:
        return f"revoked {_day(key.revoked_at)}"
    return "valid" if key.expires_at is None else f"until {_day(key.expires_at)}"


def _day(moment: datetime | None) -> str:
    return "never" if moment is None else moment.strftime("%Y-%m-%d %H:%M")


def _quota(quota: Quota) -> str:
    limits = {"images": quota.images, "pixels": quota.pixels, "samples": quota.samples}
    return ", ".join(f"{n:,} {name}" for name, n in limits.items() if n is not None) or "none"
