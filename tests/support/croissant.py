"""Croissant files as mlcroissant reads them."""

import warnings
from collections.abc import Mapping
from itertools import islice
from pathlib import Path
from typing import Any


def records(source: Path | Mapping[str, Any], record_set: str, most: int) -> list[dict[str, Any]]:
    """Validate a file or a document, and return the first records of a record set.

    Raises mlcroissant's ValidationError.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of rdflib, in what mlcroissant calls
        return list(islice(_open(source).records(record_set), most))


def metadata(source: Path | Mapping[str, Any]) -> Any:
    """Validate a file or a document and return its metadata; a warning is an error here."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        found = _open(source).metadata
    assert found.ctx.issues.report() == ""
    return found


def _open(source: Path | Mapping[str, Any]) -> Any:
    import mlcroissant

    return mlcroissant.Dataset(jsonld=source)
