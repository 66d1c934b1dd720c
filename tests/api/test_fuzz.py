"""Schemathesis in all its phases against the real service: no 5xx, nothing undeclared."""

from collections.abc import Iterator

import pytest

from tests.support.api_process import api_process
from tests.support.fuzz import Fuzzed, fuzz

REQUESTS = 5000
EXAMPLES = 25
SEED = 20_261_129
MAX_MEMORY_MB = 300.0

pytestmark = [pytest.mark.slow, pytest.mark.integration, pytest.mark.timeout(1800)]


@pytest.fixture(scope="module")
def fuzzed(
    tmp_path_factory: pytest.TempPathFactory, valkey_server: str
) -> Iterator[tuple[Fuzzed, float]]:
    """Yield what came of it, and the most memory that the service took, in MB."""
    folder = tmp_path_factory.mktemp("fuzz")
    with api_process(folder / "api", broker_url=valkey_server) as api:
        found = fuzz(api, folder, EXAMPLES, SEED, spared=True)
        yield found, api.peak_mb()


def test_no_request_breaks_the_service_or_the_contract(fuzzed: tuple[Fuzzed, float]) -> None:
    found, _ = fuzzed
    assert not found.failed, "\n".join(report[-6000:] for report in found.reports)
    assert found.requests >= REQUESTS
    assert not any(status >= 500 for status in found.statuses()), found.statuses()


def test_every_route_answered_something_good_and_refused_something(
    fuzzed: tuple[Fuzzed, float],
) -> None:
    """A fuzzer that never gets past the door proves nothing."""
    found, _ = fuzzed
    good = {(method, path) for method, path, status in found.answers if status < 300}
    expected = {
        *(("GET", path) for path in ("/v1/datasets", "/v1/vocabulary", "/v1/presets", "/readyz")),
        *(("POST", path) for path in ("/v1/datasets", "/v1/plans", "/v1/datasets/ID/cancel")),
        *(("GET", f"/v1/datasets/ID/{name}") for name in ("manifest", "balance", "audit", "card")),
        *(("GET", f"/v1/datasets/ID/{name}") for name in ("croissant", "licences", "events")),
        *(("GET", f"/v1/datasets/ID/images/5{rest}") for rest in ("", "/labels")),
        ("GET", "/v1/datasets/ID/shards/1/objects/samples.tar"),
        ("DELETE", "/v1/datasets/ID"),
    }
    assert expected - good == set()
    assert {404, 405, 409, 415, 422} <= found.statuses().keys()


def test_memory_stays_small_throughout(fuzzed: tuple[Fuzzed, float]) -> None:
    _, peak_mb = fuzzed
    assert peak_mb < MAX_MEMORY_MB
