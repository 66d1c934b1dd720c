"""hi5's HTTP API, as the commands use it."""

import time
import uuid
from collections.abc import Generator, Iterator, Mapping
from contextlib import contextmanager
from datetime import datetime
from typing import Any, Self
from urllib.parse import quote
from uuid import UUID

import httpx
from pydantic import BaseModel, ConfigDict, ValidationError

from hi5_common.cli.failures import ServiceUnreachable
from hi5_common.cli.fetch.source import TransferBroken
from hi5_common.domain.balance import Balance
from hi5_common.domain.errors import InvalidInput, PermanentError, Problem, TransientError, shown
from hi5_common.domain.failure_report import FailurePage, FailureReport
from hi5_common.domain.manifest import Manifest, ManifestShard, Progress
from hi5_common.domain.records import DatasetStatus
from hi5_common.domain.rights import Rights
from hi5_common.domain.spec import DatasetSpec
from hi5_common.domain.workers import WorkerList

TRIES = 4
LONGEST_WAIT_S = 60.0
"""However much longer a service asks to be left alone."""
_TIMEOUT = httpx.Timeout(30, connect=5)
_BLOCK_BYTES = 1 << 20


class RequestRefused(PermanentError):
    """The service refuses the request."""


class KeyWanted(PermanentError):
    """The service does not know who asks."""

    def __init__(self, reason: str) -> None:
        super().__init__(
            f"The service wants a key that it knows. {reason} The file of --key-file, HI5_API_KEY "
            "or HI5_API_KEY_FILE can give one; `hi5 keys create` beside its database makes one."
        )


class WrongAnswer(PermanentError):
    """The service answers what no hi5 answers. Check its address; `hi5 doctor` asks it."""


class ServiceBusy(TransientError):
    """The service cannot answer now. Try again; `hi5 doctor` says what does not work."""

    def __init__(self, message: str, retry_after_s: float | None = None) -> None:
        self.retry_after_s = retry_after_s
        super().__init__(message)


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
    """A running hi5. Every method raises ServiceUnreachable, ServiceBusy, KeyWanted, InvalidInput.

    key: sent to this service alone, wherever its answers lead; None sends none.
    """

    def __init__(
        self, url: str, key: str | None, transport: httpx.BaseTransport | None = None
    ) -> None:
        self.url = url.rstrip("/")
        self._client = httpx.Client(
            base_url=self.url,
            timeout=_TIMEOUT,
            transport=transport,
            follow_redirects=True,
            auth=None if key is None else _KeyOf(httpx.URL(self.url), key),
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

    def failures(self, dataset_id: UUID) -> Iterator[FailureReport]:
        """Yield what failed of a dataset, the newest first."""
        address: str | None = f"/v1/datasets/{dataset_id}/failures"
        while address:
            page = _checked(FailurePage, self._json("GET", address))
            yield from page.items
            address = _own_address(page.next)

    def workers(self) -> WorkerList:
        """Return the machines that render."""
        return _checked(WorkerList, self._json("GET", "/v1/workers"))

    def unblock(self, name: str) -> None:
        """Let a machine claim again."""
        self._send("POST", f"/v1/workers/{quote(name, safe='')}/unblock")

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
            with self._opened(address) as answer:
                yield from answer.iter_bytes(_BLOCK_BYTES)
        except (httpx.ReadError, httpx.RemoteProtocolError) as error:
            raise TransferBroken from error
        except httpx.TransportError as error:
            raise ServiceUnreachable(self.url, _reason(error)) from error

    @contextmanager
    def _opened(self, address: str) -> Iterator[httpx.Response]:
        """Yield an answer to be read; waits as long as the service asks for."""
        for tries_left in reversed(range(TRIES)):
            with self._client.stream("GET", address) as answer:
                if answer.status_code == httpx.codes.NOT_FOUND:
                    raise FileNotFoundError(address)
                if not answer.is_error:
                    yield answer
                    return
                answer.read()
            refusal = _refusal(answer)
            wait_s = refusal.retry_after_s if isinstance(refusal, ServiceBusy) else None
            if wait_s is None or not tries_left:
                raise refusal
            time.sleep(wait_s)

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
            except ServiceBusy as error:
                time.sleep(error.retry_after_s or 0.2 * 2**attempt)
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


class _KeyOf(httpx.Auth):
    """Shows a key to one service, and to no other that an address or a redirection names."""

    def __init__(self, service: httpx.URL, key: str) -> None:
        self._origin, self._key = _origin(service), key

    def auth_flow(self, request: httpx.Request) -> Generator[httpx.Request, httpx.Response]:
        if _origin(request.url) == self._origin:
            request.headers["Authorization"] = f"Bearer {self._key}"
        yield request


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
    if answer.status_code == httpx.codes.UNAUTHORIZED:
        return KeyWanted(str(details.get("detail", "")))
    if answer.status_code == httpx.codes.TOO_MANY_REQUESTS:
        return ServiceBusy(str(details.get("detail", "Too many requests.")), _wait_s(answer))
    problems = [_checked(_FieldProblem, item) for item in details.get("problems") or ()]
    if problems:
        return InvalidInput([Problem(item.field, item.value, item.remedy) for item in problems])
    title = details.get("title", answer.reason_phrase)
    message = f"{title} ({answer.status_code}): {details.get('detail', answer.text[:200])}"
    return ServiceBusy(message) if answer.is_server_error else RequestRefused(message)


def _wait_s(answer: httpx.Response) -> float:
    asked = answer.headers.get("retry-after", "1")
    return min(LONGEST_WAIT_S, max(1.0, float(asked) if asked.isdecimal() else 1.0))


def _origin(url: httpx.URL) -> tuple[str, str, int | None]:
    return url.scheme, url.host, url.port


def _problem_details(answer: httpx.Response) -> Mapping[str, Any]:
    if "json" not in answer.headers.get("content-type", ""):
        return {}
    document = answer.json()
    return document if isinstance(document, dict) else {}


def _reason(error: httpx.TransportError) -> str:
    return str(error) or type(error).__name__
