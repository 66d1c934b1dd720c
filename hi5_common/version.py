"""Which hi5 this is."""

import functools
import importlib.metadata
import tomllib
from pathlib import Path


@functools.cache
def hi5_version() -> str:
    """Return the version of the installed distribution, or of the source tree that is run."""
    try:
        return importlib.metadata.version("hi5")
    except importlib.metadata.PackageNotFoundError:
        project = Path(__file__).parent.parent / "pyproject.toml"
        version: str = tomllib.loads(project.read_text("utf-8"))["project"]["version"]
        return version
