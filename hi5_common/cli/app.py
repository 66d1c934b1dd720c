"""The `hi5` command: every subcommand by name, and what becomes of an error.

Only the module of the command that was asked for is imported: `hi5 render` needs no HTTP client,
and a second of imports is felt.
"""

import sys
from collections.abc import Sequence
from importlib import import_module

import pydantic
import typer

from hi5_common.cli import failures
from hi5_common.domain.errors import Hi5Error

COMMANDS = {
    "plan": "plan.plan",
    "schema": "vocabulary.schema",
    "vocabulary": "vocabulary.vocabulary",
    "render": "render.render",
    "clip": "clip.clip",
    "gallery": "gallery.gallery",
    "bench": "bench.app",
    "up": "up.up",
    "submit": "submit.submit",
    "watch": "watch.watch",
    "list": "listing.list_datasets",
    "manifest": "manifest.manifest",
    "balance": "balance.balance",
    "failures": "failures.failures",
    "workers": "workers.app",
    "cancel": "steer.cancel",
    "retry": "steer.retry",
    "delete": "steer.delete",
    "download": "download.download",
    "export": "export.app",
    "assets": "assets.app",
    "audit": "audit.audit",
    "card": "card.card",
    "migrate": "migrate.migrate",
    "doctor": "doctor.doctor",
    "demo": "demo.demo",
}
"""Where each command is, in hi5_common.cli.commands, in the order of the help."""


def command_line(arguments: Sequence[str]) -> typer.Typer:
    """Return the command line with the one command that the arguments begin with, or with all."""
    first = arguments[0] if arguments else None
    names = [first] if first in COMMANDS else list(COMMANDS)
    app = typer.Typer(
        name="hi5",
        help="Balanced, fully labelled synthetic hand-pose datasets.",
        no_args_is_help=True,
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    app.callback()(_no_command)  # a command line of one command alone would not take its name
    for name in names:
        module, attribute = COMMANDS[name].split(".")
        command = getattr(import_module(f"hi5_common.cli.commands.{module}"), attribute)
        if isinstance(command, typer.Typer):
            app.add_typer(command, name=name)
        else:
            app.command(name)(command)
    return app


def _no_command() -> None:
    """What belongs to no command: nothing."""


def main() -> None:
    """Run the command line; a mistake of the user's ends in words, never in a traceback."""
    try:
        command_line(sys.argv[1:])()
    except Hi5Error as error:
        sys.exit(failures.report(error))
    except pydantic.ValidationError as error:
        sys.exit(failures.report(failures.wrong_settings(error)))
    except BrokenPipeError:  # `hi5 plan --cells | head` is no error
        sys.exit(failures.quiet_pipe())
    except OSError as error:  # a folder that cannot be written, a disk that is full
        sys.exit(failures.report(failures.wrong_file(error)))
