"""Those who use the service while it suffers: one submits; one reads, cancels and deletes."""

import queue
import threading
import time
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any
from uuid import UUID

import httpx

from benchmarks.nemesis.history import History
from hi5_common.domain.seeding import factor_rng

TIMEOUT_S = 5.0
PAUSE_S = 0.2
LOOK_EVERY_S = 1.0
CHANGE_OF_MIND_S = 15.0
"""A user who cancels or deletes a dataset does so at most this long after submitting it."""


class Fate(StrEnum):
    """What its user does with a dataset."""

    KEEP = "keep"
    CANCEL = "cancel"
    DELETE = "delete"
    RETRY = "retry"
    """Keep it, and ask again for the shards that hi5 gave up."""


FATES = (Fate.KEEP, Fate.CANCEL, Fate.DELETE)
FATE_SHARES = (0.88, 0.06, 0.06)


def fate(seed: int, number: int) -> Fate:
    """Return what becomes of the number-th dataset of a run."""
    return FATES[int(factor_rng(seed, number, "fate").choice(len(FATES), p=FATE_SHARES))]


@dataclass(frozen=True)
class Shape:
    """How large every dataset is, and how long an image takes, in seconds."""

    shards: int
    images_per_shard: int
    image_s: float

    def spec(self, seed: int) -> dict[str, Any]:
        """Return the spec of a dataset."""
        return {
            "name": f"nemesis {self.image_s:g}",
            "seed": seed,
            "count": self.shards * self.images_per_shard,
            "images_per_shard": self.images_per_shard,
            "image": {"width": 64, "height": 48},
        }


@dataclass
class Users:
    """Two threads that ask the API and write down what it answered."""

    url: str
    key: str
    history: History
    shape: Shape
    seed: int
    asked: int = 0
    """Datasets that were to be submitted so far."""
    kept: int = 0
    """Those of them that nobody will cancel or delete."""
    deleted: int = 0
    acknowledged: list[UUID] = field(default_factory=list)
    _wanted: "queue.SimpleQueue[int | None]" = field(default_factory=queue.SimpleQueue)
    _changes: "queue.SimpleQueue[tuple[float, Fate, UUID]]" = field(
        default_factory=queue.SimpleQueue
    )
    _hurry: threading.Event = field(default_factory=threading.Event)
    _stop: threading.Event = field(default_factory=threading.Event)
    _threads: list[threading.Thread] = field(default_factory=list)

    def start(self) -> None:
        """Begin to work through what is wanted, and to read."""
        self._threads = [
            threading.Thread(target=target, name=target.__name__, daemon=True)
            for target in (self._submit_all, self._read_all)
        ]
        for thread in self._threads:
            thread.start()

    def left(self) -> int:
        """Return how much that users want is not answered yet."""
        return self.asked - len(self.acknowledged) + self._changes.qsize()

    def hurry(self) -> None:
        """Have those who will change their mind do so now."""
        self._hurry.set()

    def stop(self) -> None:
        """End both threads. Raises RuntimeError if the API keeps one from that."""
        self._wanted.put(None)
        self._stop.set()
        for thread in self._threads:
            thread.join(4 * TIMEOUT_S)
        if any(thread.is_alive() for thread in self._threads):
            raise RuntimeError("the API does not answer users any more")

    def want(self) -> None:
        """Have one more dataset submitted."""
        self._wanted.put(self.asked)
        self.kept += fate(self.seed, self.asked) is Fate.KEEP
        self.asked += 1

    def retry_soon(self, dataset_id: UUID) -> None:
        """Have a user ask for the failed shards of a dataset again."""
        self._changes.put((0.0, Fate.RETRY, dataset_id))

    def _submit_all(self) -> None:
        while (number := self._wanted.get()) is not None:
            dataset_id = self._submit(number)
            self._submit(number)  # as a user would who does not trust the answer
            self.acknowledged.append(dataset_id)
            chosen = fate(self.seed, number)
            if chosen is not Fate.KEEP:
                wait_s = CHANGE_OF_MIND_S * factor_rng(self.seed, number, "wait").random()
                self._changes.put((time.monotonic() + wait_s, chosen, dataset_id))

    def _submit(self, seed: int) -> UUID:
        key = f"nemesis-{seed}"
        self.history.append("submit", key=key, seed=seed)
        answer = self._asked_until_answered(
            "POST", "/v1/datasets", json=self.shape.spec(seed), headers={"Idempotency-Key": key}
        )
        dataset_id = UUID(answer.json()["id"])
        self.history.append("acknowledged", key=key, seed=seed, dataset_id=dataset_id)
        return dataset_id

    def _asked_until_answered(
        self,
        method: str,
        path: str,
        settled: Collection[int] = (),
        headers: Mapping[str, str] | None = None,
        **rest: Any,
    ) -> httpx.Response:
        """Send a request again and again until it is answered with success, or with one of these.

        Any other refusal but 503 is an error of hi5.
        """
        sent = {**self._shown(), **(headers or {})}
        while True:
            try:
                answer = httpx.request(
                    method, self.url + path, timeout=TIMEOUT_S, headers=sent, **rest
                )
            except httpx.TransportError:
                time.sleep(PAUSE_S)
                continue
            if answer.status_code < 300 or answer.status_code in settled:
                return answer
            if answer.status_code != 503:
                self.history.append(
                    "refused", path=path, status=answer.status_code, body=answer.text[:500]
                )
            time.sleep(PAUSE_S)

    def _shown(self) -> dict[str, str]:
        return {"Authorization": f"Bearer {self.key}"}

    def _read_all(self) -> None:
        """Note what is published of one dataset after another; cancel and delete some."""
        turn = 0
        while not self._stop.wait(LOOK_EVERY_S):
            if not self.acknowledged:
                continue
            recent = self.acknowledged[-3:]
            self._read(recent[turn % len(recent)])
            turn += 1
            self._change_minds()

    def _change_minds(self) -> None:
        """Do what is due."""
        for _ in range(self._changes.qsize()):
            at_s, chosen, dataset_id = self._changes.get()
            if at_s <= time.monotonic() or self._hurry.is_set():
                self._change(chosen, dataset_id)
            else:
                self._changes.put((at_s, chosen, dataset_id))

    def _change(self, chosen: Fate, dataset_id: UUID) -> None:
        path = f"/v1/datasets/{dataset_id}"
        self.history.append(f"{chosen}_asked", dataset_id=dataset_id)
        match chosen:
            case Fate.DELETE:  # 404: an answer before this one was lost
                answer = self._asked_until_answered("DELETE", path, (404,))
                self.deleted += 1
            case Fate.CANCEL:  # 409: it is complete
                answer = self._asked_until_answered("POST", f"{path}/cancel", (409,))
            case _:  # 404, 409: another user deleted or cancelled it meanwhile
                answer = self._asked_until_answered("POST", f"{path}/retry", (404, 409))
        self.history.append(f"{chosen}_done", dataset_id=dataset_id, status=answer.status_code)

    def _read(self, dataset_id: UUID) -> None:
        try:
            answer = httpx.get(
                f"{self.url}/v1/datasets/{dataset_id}/manifest?limit=200",
                timeout=TIMEOUT_S,
                headers=self._shown(),
            )
        except httpx.TransportError:
            return
        if answer.status_code != 200:
            self.history.append("unanswered", dataset_id=dataset_id, status=answer.status_code)
            return
        published = {
            shard["number"]: shard["objects"][0]["key"]
            for shard in answer.json()["shards"]
            if shard["status"] == "done"
        }
        self.history.append("seen", dataset_id=dataset_id, published=published)
