"""`hi5 schema` and `hi5 vocabulary`: what a spec may say."""

from hi5_common.cli import console
from hi5_common.cli.console import Json
from hi5_common.cli.options import JsonOption
from hi5_common.domain.spec_schema import spec_json_schema
from hi5_common.domain.vocabulary import KEYPOINTS, VALUES


def schema() -> None:
    """Print the JSON Schema of a spec."""
    document: Json = spec_json_schema()  # type: ignore[assignment]
    console.write_json(document)


def vocabulary(as_json: JsonOption = False) -> None:
    """Print every attribute with its values, and the names of the 21 keypoints."""
    words = {attribute.value: list(values) for attribute, values in VALUES.items()}
    words["keypoints"] = list(KEYPOINTS)
    if as_json:
        console.write_json(words)
        return
    for name, values in words.items():
        console.out.print(f"[bold]{name}[/] ({len(values)}): {', '.join(values)}")
