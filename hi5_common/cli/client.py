"""hi5's HTTP API, as the commands use it."""

import time
import uuid
from collections.abc import Iterator, Mapping
from datetime import datetime
from typing import Any, Self
from uuid import UUID

import httpx
from pydantic import BaseModel, ConfigDict, ValidationError

from hi5_common.cli.failures import ServiceUnreachable
from hi5_common.cli.fetch.source import TransferBroken
from hi5_common.domain.balance import Balance
from hi5_common.domain.errors import InvalidInput, PermanentError, Problem, TransientError, shown
from hi5_common.domain.manifest import Manifest, ManifestShard, Progress
from hi5_common.domain.records import DatasetStatus
from hi5_common.domain.rights import Rights
from hi5_common.domain.spec import DatasetSpec

TRIES = 4
_TIMEOUT = httpx.Timeout(30, connect=5)
_BLOCK_BYTES = 1 << 20


class RequestRefused(PermanentError):
    """The service refuses the request."""


class WrongAnswer(PermanentError):
    """The service answers what no hi5 answers. Check its address; `hi5 doctor` asks it."""


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


class _DatasetLines(BaseModel):
    """A page of datasets."""

    items: list[DatasetLine]
    next: str | None = None


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
            page = _checked(_DatasetLines, self._json("GET", address))
            yield from page.items
            address = _own_address(page.next)

    def dataset(self, dataset_id: UUID) -> DatasetLine:
        """Return how far a dataset is."""
        return _checked(DatasetLine, self._json("GET", f"/v1/datasets/{dataset_id}"))

    def manifest(self, dataset_id: UUID) -> Manifest:
        """Return the first page of the manifest."""
        return self._manifest(f"/v1/datasets/{dataset_id}/manifest")

    def shards(self, dataset_id: UUID) -> Iterator[ManifestShard]:
        """Yield every shard of the manifest, page by page. Raises WrongAnswer."""
        page, last = self.manifest(dataset_id), -1
        while True:
            for shard in page.shards:
                if shard.number <= last:
                    raise WrongAnswer(f"Shard {shard.number} comes after shard {last}.")
                last = shard.number
                yield shard
            address = _own_address(page.next)
            if address is None:
                return
            if not page.shards:
                raise WrongAnswer("A page of the manifest is empty and not the last.")
            page = self._manifest(address)

    def balance(self, dataset_id: UUID) -> Balance:
        """Return requested, planned and delivered counts."""
        return _checked(Balance, self._json("GET", f"/v1/datasets/{dataset_id}/balance"))

    def rights(self, dataset_id: UUID) -> Rights:
        """Return what the licences of a dataset's assets allow."""
        return _checked(Rights, self._json("GET", f"/v1/datasets/{dataset_id}/licences"))

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
        return _checked(Manifest, self._json("GET", address))

    def _json(self, method: str, address: str, **options: Any) -> dict[str, Any]:
        try:
            document = self._send(method, address, **options).json()
        except (ValueError, RecursionError) as error:
            raise WrongAnswer from error
        if not isinstance(document, dict):
            raise WrongAnswer
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


def _checked[Model: BaseModel](model: type[Model], document: object) -> Model:
    """Return what a service sent if it is what one sends. Raises WrongAnswer."""
    try:
        return model.model_validate(document)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(map(str, first["loc"]))
        raise WrongAnswer(f"{WrongAnswer.__doc__} {where}: {first['msg']}.") from error


def _own_address(following: str | None) -> str | None:
    """Return the address of a next page: never one of another host, which would get our key."""
    if following is None:
        return None
    if not following.startswith("/v1/") or any(ord(letter) <= 32 for letter in following):
        raise WrongAnswer(f"The next page is said to be at {shown(following)}.")
    return following


class _FieldProblem(BaseModel):
    model_config = ConfigDict(extra="ignore")
    field: str
    value: object
    remedy: str


def _refusal(answer: httpx.Response) -> Exception:
    """Turn problem details (RFC 9457) back into the error they came from."""
    details = _problem_details(answer)
    problems = [_checked(_FieldProblem, item) for item in details.get("problems") or ()]
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
