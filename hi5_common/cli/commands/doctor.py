"""`hi5 doctor`: what works here and what to do about the rest."""

from dataclasses import asdict

from rich.markup import escape

from hi5_common.cli import console
from hi5_common.cli.checks.check import CheckResult
from hi5_common.cli.checks.children import children_check
from hi5_common.cli.checks.machine import machine_checks
from hi5_common.cli.checks.services import service_checks
from hi5_common.cli.failures import OutcomeError
from hi5_common.cli.options import DataDirOption, JsonOption
from hi5_common.settings import Settings


class NotHealthy(OutcomeError):
    """Something that hi5 needs does not work."""


def doctor(as_json: JsonOption = False, data_dir: DataDirOption = None) -> None:
    """Look at everything hi5 needs; ends with 1 if something does not work."""
    settings = Settings(data_dir=data_dir.resolve()) if data_dir else Settings()
    results = []
    for check in (*machine_checks(), *service_checks(settings), children_check(settings)):
        result = check.run()
        results.append(result)
        if not as_json:
            _print(result)
    if as_json:
        console.write_json([asdict(result) for result in results])
    sick = [result.name for result in results if not result.ok]
    if sick:
        raise NotHealthy(f"not in order: {', '.join(sick)}")


def _print(result: CheckResult) -> None:
    mark = "[green]ok[/]    " if result.ok else "[red]failed[/]"
    console.out.print(f"{mark} {result.name}: {escape(result.found)}")
    if not result.ok:
        console.out.print(f"       {escape(result.remedy)}")
