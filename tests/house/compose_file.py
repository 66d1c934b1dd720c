"""Reads docker-compose.yml as Compose does: anchors, merges, and ${NAME:-default}."""

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from tests.house.requirements import ROOT

_VARIABLE = re.compile(r"\$\{(\w+)(?::([-?])([^}]*))?\}")
SECRETS_MOUNT = "/run/secrets/"


@dataclass(frozen=True)
class Service:
    """What the file says of one service; the rest of its keys are in `raw`."""

    name: str
    command: tuple[str, ...]
    environment: Mapping[str, str]
    healthcheck: tuple[str, ...]
    raw: Mapping[str, Any]


@dataclass(frozen=True)
class ComposeFile:
    """The services, and where the secret files are on the host."""

    services: Mapping[str, Service]
    secrets: Mapping[str, Path]
    raw: Mapping[str, Any]

    def on_host(self, value: str) -> str:
        """Return a value with the mount of a secret replaced by the file that is mounted there."""
        if not value.startswith(SECRETS_MOUNT):
            return value
        return str(self.secrets[value.removeprefix(SECRETS_MOUNT)])


def read_compose_file(
    variables: Mapping[str, str], name: str = "docker-compose.yml"
) -> ComposeFile:
    """Parse the file with the given variables in place of the shell's."""
    raw = _interpolated(yaml.safe_load((ROOT / name).read_text()), variables)
    return ComposeFile(
        services={key: _service(key, value) for key, value in raw["services"].items()},
        secrets={
            key: Path(os.path.normpath(ROOT / value["file"]))
            for key, value in raw.get("secrets", {}).items()
        },
        raw=raw,
    )


def _service(name: str, raw: Mapping[str, Any]) -> Service:
    test = raw.get("healthcheck", {}).get("test", ["NONE"])
    return Service(
        name=name,
        command=tuple(raw.get("command", ())),
        environment=dict(raw.get("environment", {})),
        healthcheck=tuple(test[1:]) if test[0] == "CMD" else (),
        raw=raw,
    )


def _interpolated(value: Any, variables: Mapping[str, str]) -> Any:
    if isinstance(value, dict):
        return {key: _interpolated(item, variables) for key, item in value.items()}
    if isinstance(value, list):
        return [_interpolated(item, variables) for item in value]
    if isinstance(value, str):
        return _VARIABLE.sub(lambda found: _variable(found, variables), value)
    return value


def _variable(found: re.Match[str], variables: Mapping[str, str]) -> str:
    name, mark, rest = found.groups()
    if given := variables.get(name):
        return given
    if mark == "-":
        return str(rest)
    raise KeyError(f"{name}: {rest or 'not set'}")
