"""A dataset's card into a folder: the one of its download, so that paths in it are right."""

import hashlib
import json
from pathlib import Path

from hi5_common.cards.croissant import croissant
from hi5_common.cards.datasheet import TITLE, datasheet
from hi5_common.cards.distribution import CHECKSUMS, TEXT, ListedFile, beside, sums
from hi5_common.cards.facts import CardFacts, facts_of, troubles_of
from hi5_common.cli.fetch.source import DatasetSource
from hi5_common.domain.errors import InvalidInput, Problem
from hi5_common.version import hi5_version

DATASHEET, CROISSANT, LICENCES = "README.md", "croissant.json", "licences.json"


def write_card(source: DatasetSource, root: Path, creator: str | None) -> CardFacts:
    """Write README.md, croissant.json, licences.json and SHA256SUMS; return what they say.

    Raises InvalidInput rather than write over a README.md that is no datasheet.
    """
    _spare_others(root / DATASHEET)
    shards = list(source.shards())
    facts = facts_of(
        source.manifest(),
        troubles_of(shards),
        source.rights(),
        address=source.address,
        hi5_version=hi5_version(),
        creator=creator,
    )
    root.mkdir(parents=True, exist_ok=True)
    checksums = sums(shards).encode()
    (root / CHECKSUMS).write_bytes(checksums)
    sha256 = hashlib.sha256(checksums).hexdigest()
    listed = ListedFile(CHECKSUMS, CHECKSUMS, TEXT, len(checksums), sha256)
    document = croissant(facts, beside(shards, listed))
    (root / CROISSANT).write_text(
        json.dumps(document, indent=1, ensure_ascii=False) + "\n", "utf-8"
    )
    (root / LICENCES).write_text(facts.rights.model_dump_json(indent=1) + "\n", "utf-8")
    (root / DATASHEET).write_text(datasheet(facts), "utf-8")
    return facts


def _spare_others(path: Path) -> None:
    if path.is_file() and not path.read_text("utf-8", errors="replace").startswith(TITLE):
        remedy = "It is no datasheet of hi5's and would be lost: name another --out."
        raise InvalidInput([Problem("--out", str(path), remedy)])
