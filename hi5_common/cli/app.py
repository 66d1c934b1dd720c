"""The `hi5` command: every subcommand by name, and what becomes of an error."""

import sys

import pydantic
import typer

from hi5_common.cli import failures
from hi5_common.cli.commands import (
    assets,
    audit,
    balance,
    clip,
    demo,
    doctor,
    download,
    export,
    gallery,
    listing,
    manifest,
    migrate,
    plan,
    render,
    steer,
    submit,
    up,
    vocabulary,
    watch,
)
from hi5_common.domain.errors import Hi5Error

app = typer.Typer(
    name="hi5",
    help="Balanced, fully labelled synthetic hand-pose datasets.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

app.command("plan")(plan.plan)
app.command("schema")(vocabulary.schema)
app.command("vocabulary")(vocabulary.vocabulary)
app.command("render")(render.render)
app.command("clip")(clip.clip)
app.command("gallery")(gallery.gallery)
app.command("up")(up.up)
app.command("submit")(submit.submit)
app.command("watch")(watch.watch)
app.command("list")(listing.list_datasets)
app.command("manifest")(manifest.manifest)
app.command("balance")(balance.balance)
app.command("cancel")(steer.cancel)
app.command("retry")(steer.retry)
app.command("delete")(steer.delete)
app.command("download")(download.download)
app.add_typer(export.app, name="export")
app.add_typer(assets.app, name="assets")
app.command("audit")(audit.audit)
app.command("migrate")(migrate.migrate)
app.command("doctor")(doctor.doctor)
app.command("demo")(demo.demo)


def main() -> None:
    """Run the command line; a mistake of the user's ends in words, never in a traceback."""
    try:
        app()
    except Hi5Error as error:
        sys.exit(failures.report(error))
    except pydantic.ValidationError as error:
        sys.exit(failures.report(failures.wrong_settings(error)))
    except BrokenPipeError:  # `hi5 plan --cells | head` is no error
        sys.exit(failures.quiet_pipe())
    except OSError as error:  # a folder that cannot be written, a disk that is full
        sys.exit(failures.report(failures.wrong_file(error)))
