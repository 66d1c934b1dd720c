"""The dataset as Croissant 1.1, with the responsible-AI vocabulary 1.0."""

from collections.abc import Sequence
from typing import Any

from hi5_common.cards import words
from hi5_common.cards.citation import PAPER, bibtex, keeper
from hi5_common.cards.columns import COLUMNS, IMAGE, TEXT, Column
from hi5_common.cards.distribution import PARQUET, Distribution, ListedFile
from hi5_common.cards.facts import CardFacts
from hi5_common.domain.licences import licence_of
from hi5_common.domain.records import DatasetStatus
from hi5_common.domain.spec import ImageFormat

CROISSANT = "http://mlcommons.org/croissant/1.1"
RAI = "http://mlcommons.org/croissant/RAI/1.0"
MEDIA_TYPE = f'application/ld+json; profile="{CROISSANT}"'
WHOLE_VERSION, PART_VERSION = "1.0.0", "0.1.0"
"""A complete dataset never changes; one that grows is before its first version."""

LABELS, PICTURES = "labels", "pictures"
_PICTURE = {
    ImageFormat.JPEG: ("image/jpeg", "*.jpg"),
    ImageFormat.PNG: ("image/png", "*.png"),
}

Json = dict[str, Any]

_TERMS = """
    annotation arrayShape citeAs column containedIn equivalentProperty excludes extract field
    fileObject fileProperty fileSet format includes isArray isLiveDataset jsonPath key md5
    parentField path readLines recordSet references regex repeated replace samplingRate
    sdVersion separator source subField transform unArchive value
"""

CONTEXT: Json = {
    "@language": "en",
    "@vocab": "https://schema.org/",
    "sc": "https://schema.org/",
    "cr": "http://mlcommons.org/croissant/",
    "rai": "http://mlcommons.org/croissant/RAI/",
    "dct": "http://purl.org/dc/terms/",
    "conformsTo": "dct:conformsTo",
    "data": {"@id": "cr:data", "@type": "@json"},
    "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    "examples": {"@id": "cr:examples", "@type": "@json"},
    "description": {"@container": "@language"},
    "name": {"@container": "@language"},
    **{term: f"cr:{term}" for term in _TERMS.split()},
}


def croissant(facts: CardFacts, distribution: Distribution) -> Json:
    """Return the document, ready for JSON."""
    return {
        "@context": CONTEXT,
        "@type": "sc:Dataset",
        "conformsTo": [CROISSANT, RAI],
        "name": facts.spec.name,
        "description": _description(facts),
        "url": facts.address,
        "license": _licences(facts),
        "usageInfo": facts.rights.answer,
        "creator": {"@type": "sc:Organization", "name": keeper(facts)},
        "datePublished": facts.created_at.date().isoformat(),
        "dateCreated": facts.created_at.date().isoformat(),
        "version": WHOLE_VERSION if facts.is_settled else PART_VERSION,
        **({} if facts.is_settled else {"isLiveDataset": True}),
        "keywords": ["hand pose estimation", "synthetic", "hands", "keypoints", "fairness"],
        "citeAs": bibtex(facts),
        "isBasedOn": PAPER,
        **_responsible(facts),
        "distribution": _files(facts, distribution),
        "recordSet": [_labels(facts), _pictures()],
    }


def _description(facts: CardFacts) -> str:
    progress, image = facts.progress, facts.spec.image
    if facts.status is DatasetStatus.COMPLETE:
        how_far = f"{progress.count:,} images"
    else:
        how_far = f"{progress.done:,} of {progress.count:,} images ({facts.status.value})"
    return (
        f"Rendered pictures of hands with labels by hi5: {how_far}, {image.width} x {image.height} "
        f"px. Labels: {words.labels_in_words(facts)}. {words.missing(facts)}"
    )


def _licences(facts: CardFacts) -> list[str]:
    """Return the licences of all that stands in the dataset; one that has no address as a word."""
    return [licence_of(name).url or name for name in facts.rights.licences]


def _responsible(facts: CardFacts) -> Json:
    render = facts.spec.render
    return {
        "rai:dataCollection": words.COLLECTION,
        "rai:dataCollectionType": ["Software Collection", "Others: rendering"],
        "rai:dataCollectionRawData": words.RAW,
        "rai:dataCollectionMissingData": words.missing(facts),
        "rai:dataPreprocessingProtocol": [
            f"Rendered by {render.engine.value}; nothing was filtered or altered afterwards."
        ],
        "rai:dataAnnotationProtocol": [words.ANNOTATION],
        "rai:dataAnnotationPlatform": ["None: labels are computed with the pictures."],
        "rai:machineAnnotationTools": [f"hi5 {facts.hi5_version}"],
        "rai:annotationsPerItem": "1, computed; 0 by people",
        "rai:annotatorDemographics": ["None: no person labelled anything."],
        "rai:dataBiases": list(words.biases(facts)),
        "rai:dataLimitations": [
            *words.limitations(facts),
            *(f"Unfit for: {use}" for use in words.unfit_uses()),
        ],
        "rai:dataUseCases": list(words.uses()),
        "rai:dataSocialImpact": words.SOCIAL_IMPACT,
        "rai:personalSensitiveInformation": [words.sensitive(facts)],
        "rai:dataReleaseMaintenancePlan": words.MAINTENANCE,
    }


def _files(facts: CardFacts, distribution: Distribution) -> list[Json]:
    media_type, pattern = _PICTURE[facts.spec.image.format]
    pictures: Json = {
        "@type": "cr:FileSet",
        "@id": PICTURES,
        "name": PICTURES,
        "encodingFormat": media_type,
    }
    if distribution.tars_hold_pictures:
        pictures |= {
            "description": "The pictures, inside the tars.",
            "containedIn": [{"@id": file.id} for file in distribution.tars],
            "includes": pattern,
        }
    else:
        pictures |= {
            "description": "The pictures, as `hi5 download` unpacks them beside this file.",
            "includes": f"images/{pattern}",
        }
    labels = {
        "@type": "cr:FileSet",
        "@id": LABELS,
        "name": LABELS,
        "description": "One label table a shard, as `hi5 download` lays them beside this file; "
        f"{distribution.checksums}.",
        "encodingFormat": PARQUET,
        "includes": "shards/*/labels.parquet",
    }
    return [*map(_file, distribution.listed), labels, pictures]


def _file(file: ListedFile) -> Json:
    return {
        "@type": "cr:FileObject",
        "@id": file.id,
        "name": file.id,
        "contentUrl": file.url,
        "contentSize": f"{file.size_bytes} B",
        "encodingFormat": file.media_type,
        "sha256": file.sha256,
    }


def _labels(facts: CardFacts) -> Json:
    kinds = facts.spec.labels
    wanted = [column for column in COLUMNS if column.kind is None or column.kind in kinds]
    return _record_set(LABELS, "One row an image.", "index", [_column(column) for column in wanted])


def _column(column: Column) -> Json:
    source: Json = {"fileSet": {"@id": LABELS}, "extract": {"column": column.column}}
    if column.path is not None:
        source["transform"] = {"jsonPath": column.path}
    shape: Json = {}
    if column.shape is not None:
        shape = {"isArray": True, "arrayShape": ",".join(map(str, column.shape))}
    return {**_field(LABELS, column.name, column.type, column.meaning), **shape, "source": source}


def _pictures() -> Json:
    """Return the pictures' record set: join it to the labels by file_name."""
    content = _field(PICTURES, "picture", IMAGE, "The picture.")
    name = _field(PICTURES, "file_name", TEXT, "Its file name, as in the labels.")
    return _record_set(
        PICTURES,
        "One record a picture; its labels have the same file_name.",
        "file_name",
        [
            {**name, "source": _of_file("filename")},
            {**content, "source": _of_file("content")},
        ],
    )


def _of_file(what: str) -> Json:
    return {"fileSet": {"@id": PICTURES}, "extract": {"fileProperty": what}}


def _record_set(name: str, meaning: str, key: str, fields: Sequence[Json]) -> Json:
    return {
        "@type": "cr:RecordSet",
        "@id": name + "_records",
        "name": name,
        "description": meaning,
        "key": {"@id": f"{name}_records/{key}"},
        "field": list(fields),
    }


def _field(record_set: str, name: str, data_type: str, meaning: str) -> Json:
    return {
        "@type": "cr:Field",
        "@id": f"{record_set}_records/{name}",
        "name": name,
        "description": meaning,
        "dataType": data_type,
    }
