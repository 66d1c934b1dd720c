"""The API fetches nothing on a user's behalf: nothing that it takes is an address."""

from collections.abc import Iterator
from typing import Any

from tests.api.world import World

ADDRESSES = ("url", "uri", "href", "webhook", "callback", "endpoint", "host")


def names_and_formats(schema: Any) -> Iterator[str]:
    """Yield the names of fields and the formats of a schema, however deep."""
    if isinstance(schema, dict):
        yield from schema.get("properties", {})
        if "format" in schema:
            yield str(schema["format"])
        for part in schema.values():
            yield from names_and_formats(part)
    elif isinstance(schema, list):
        for part in schema:
            yield from names_and_formats(part)


def test_no_field_of_a_request_is_an_address(shared_world: World) -> None:
    document = shared_world.client.get("/openapi.json", timeout=60).json()
    taken = {name for name in document["components"]["schemas"] if name.startswith("SpecRequest")}
    found = set(names_and_formats([document["components"]["schemas"][name] for name in taken]))
    for methods in document["paths"].values():
        for operation in methods.values():
            for parameter in operation.get("parameters", ()):
                found |= {parameter["name"], *names_and_formats(parameter["schema"])}
    assert {"count", "attributes", "environment", "dataset_id", "uuid"} <= found
    assert [name for name in found if any(word in name.lower() for word in ADDRESSES)] == []


def test_an_environment_that_is_an_address_is_refused(shared_world: World) -> None:
    for value in ("http://127.0.0.1/a.exr", "https://x.example/a.hdr", "file:///a.exr", "//h/a"):
        body = {"count": 1, "attributes": {"environment": [value]}}
        answer = shared_world.client.post("/v1/plans", json=body)
        assert answer.status_code == 422
        assert answer.json()["problems"][0]["field"] == "attributes.environment"


def test_the_service_has_no_client(shared_world: World) -> None:
    """Its image could not fetch either: no module of it imports an HTTP client."""
    import ast
    from pathlib import Path

    import services.api

    imported: set[str] = set()
    for file in Path(services.api.__path__[0]).rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            if isinstance(node, ast.Import):
                imported |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                imported.add((node.module or "").partition(".")[0])
    assert "fastapi" in imported
    assert imported & {"httpx", "requests", "aiohttp", "urllib3", "socket"} == set()
