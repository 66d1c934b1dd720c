"""hi5's HTTP API, as the commands use it."""

import time
import uuid
from collections.abc import Iterator, Mapping
from datetime import datetime
from typing import Any, Self
from urllib.parse import quote
from uuid import UUID

import httpx
from pydantic import BaseModel, ConfigDict

from hi5_common.cli.failures import ServiceUnreachable
from hi5_common.cli.fetch.source import TransferBroken
from hi5_common.domain.balance import Balance
from hi5_common.domain.errors import InvalidInput, PermanentError, Problem, TransientError
from hi5_common.domain.failure_report import FailurePage, FailureReport
from hi5_common.domain.manifest import Manifest, ManifestShard, Progress
from hi5_common.domain.records import DatasetStatus
from hi5_common.domain.rights import Rights
from hi5_common.domain.spec import DatasetSpec
from hi5_common.domain.workers import WorkerList

TRIES = 4
_TIMEOUT = httpx.Timeout(30, connect=5)
_BLOCK_BYTES = 1 << 20


class RequestRefused(PermanentError):
    """The service refuses the request."""


class ServiceBusy(TransientError):
    """The service cannot answer now. Try again; `hi5 doctor` says what does not work."""


class DatasetLine(BaseModel):
    """What it is called and how far it is; the service says more."""

    model_config = ConfigDict(extra="ignore", frozen=True)
    id: UUID
    name: str
    status: DatasetStatus
    created_at: datetime
    progress: Progress


class Service:
    """A running hi5. Every method raises ServiceUnreachable, ServiceBusy or InvalidInput."""

    def __init__(self, url: str, transport: httpx.BaseTransport | None = None) -> None:
        self.url = url.rstrip("/")
        self._client = httpx.Client(
            base_url=self.url, timeout=_TIMEOUT, transport=transport, follow_redirects=True
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self._client.close()

    def submit(self, spec: DatasetSpec, idempotency_key: str | None) -> UUID:
        """Create a dataset and return its id. The key makes it safe to send again."""
        headers = {"Idempotency-Key": idempotency_key or str(uuid.uuid4())}
        body = spec.model_dump(mode="json")
        answer = self._json("POST", "/v1/datasets", json=body, headers=headers)
        return UUID(answer["id"])

    def datasets(self) -> Iterator[DatasetLine]:
        """Yield every dataset, the newest first."""
        address: str | None = "/v1/datasets"
        while address:
            page = self._json("GET", address)
            yield from map(DatasetLine.model_validate, page["items"])
            address = page.get("next")

    def dataset(self, dataset_id: UUID) -> DatasetLine:
        """Return how far a dataset is."""
        return DatasetLine.model_validate(self._json("GET", f"/v1/datasets/{dataset_id}"))

    def manifest(self, dataset_id: UUID) -> Manifest:
        """Return the first page of the manifest."""
        return self._manifest(f"/v1/datasets/{dataset_id}/manifest")

    def shards(self, dataset_id: UUID) -> Iterator[ManifestShard]:
        """Yield every shard of the manifest, page by page."""
        page = self.manifest(dataset_id)
        yield from page.shards
        while page.next:
            page = self._manifest(page.next)
            yield from page.shards

    def balance(self, dataset_id: UUID) -> Balance:
        """Return requested, planned and delivered counts."""
        return Balance.model_validate(self._json("GET", f"/v1/datasets/{dataset_id}/balance"))

    def failures(self, dataset_id: UUID) -> Iterator[FailureReport]:
        """Yield what failed of a dataset, the newest first."""
        address: str | None = f"/v1/datasets/{dataset_id}/failures"
        while address:
            page = FailurePage.model_validate(self._json("GET", address))
            yield from page.items
            address = page.next

    def workers(self) -> WorkerList:
        """Return the machines that render."""
        return WorkerList.model_validate(self._json("GET", "/v1/workers"))

    def unblock(self, name: str) -> None:
        """Let a machine claim again."""
        self._send("POST", f"/v1/workers/{quote(name, safe='')}/unblock")

    def rights(self, dataset_id: UUID) -> Rights:
        """Return what the licences of a dataset's assets allow."""
        return Rights.model_validate(self._json("GET", f"/v1/datasets/{dataset_id}/licences"))

    def cancel(self, dataset_id: UUID) -> None:
        """Cancel what is not rendered yet."""
        self._send("POST", f"/v1/datasets/{dataset_id}/cancel")

    def retry(self, dataset_id: UUID) -> int:
        """Make failed shards pending again; return how many."""
        answer = self._json("POST", f"/v1/datasets/{dataset_id}/retry")
        return int(answer["retried_shards"])

    def delete(self, dataset_id: UUID) -> None:
        """Delete a dataset; its objects are swept later."""
        self._send("DELETE", f"/v1/datasets/{dataset_id}")

    def stream(self, address: str) -> Iterator[bytes]:
        """Yield the body of an answer in pieces.

        Raises FileNotFoundError for a 404, TransferBroken when the body ends too early.
        """
        try:
            with self._client.stream("GET", address) as answer:
                if answer.status_code == httpx.codes.NOT_FOUND:
                    raise FileNotFoundError(address)
                if answer.is_error:
                    answer.read()
                    raise _refusal(answer)
                yield from answer.iter_bytes(_BLOCK_BYTES)
        except (httpx.ReadError, httpx.RemoteProtocolError) as error:
            raise TransferBroken from error
        except httpx.TransportError as error:
            raise ServiceUnreachable(self.url, _reason(error)) from error

    def _manifest(self, address: str) -> Manifest:
        return Manifest.model_validate(self._json("GET", address))

    def _json(self, method: str, address: str, **options: Any) -> dict[str, Any]:
        document: dict[str, Any] = self._send(method, address, **options).json()
        return document

    def _send(self, method: str, address: str, **options: Any) -> httpx.Response:
        """Send, and again after a pause while the service is away: every call may be repeated."""
        for attempt in range(TRIES - 1):
            try:
                return self._send_once(method, address, **options)
            except TransientError:
                time.sleep(0.2 * 2**attempt)
        return self._send_once(method, address, **options)

    def _send_once(self, method: str, address: str, **options: Any) -> httpx.Response:
        try:
            answer = self._client.request(method, address, **options)
        except httpx.TransportError as error:
            raise ServiceUnreachable(self.url, _reason(error)) from error
        if answer.is_error:
            raise _refusal(answer)
        return answer


class _FieldProblem(BaseModel):
    model_config = ConfigDict(extra="ignore")
    field: str
    value: object
    remedy: str


def _refusal(answer: httpx.Response) -> Exception:
    """Turn problem details (RFC 9457) back into the error they came from."""
    details = _problem_details(answer)
    problems = [_FieldProblem.model_validate(item) for item in details.get("problems", ())]
    if problems:
        return InvalidInput([Problem(item.field, item.value, item.remedy) for item in problems])
    title = details.get("title", answer.reason_phrase)
    message = f"{title} ({answer.status_code}): {details.get('detail', answer.text[:200])}"
    return ServiceBusy(message) if answer.is_server_error else RequestRefused(message)


def _problem_details(answer: httpx.Response) -> Mapping[str, Any]:
    if "json" not in answer.headers.get("content-type", ""):
        return {}
    document = answer.json()
    return document if isinstance(document, dict) else {}


def _reason(error: httpx.TransportError) -> str:
    return str(error) or type(error).__name__
