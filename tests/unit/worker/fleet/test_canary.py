"""A machine that renders wrong never claims a shard; one that renders right is not kept waiting."""

import json
import threading
import time
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import pytest

from hi5_common.settings import RendererName, Settings
from services.worker.fleet import canary
from services.worker.fleet.admission import Admission, CanaryDied, refusal
from services.worker.fleet.attempt_errors import AttemptFailed, DrainRequested
from services.worker.fleet.opening import _trial
from tests.support import runners

Pixels = npt.NDArray[np.uint8]
REFERENCES = files("services.worker.fleet").joinpath(canary.REFERENCES)
LABEL = REFERENCES.joinpath("label.json").read_bytes()


def picture(renderer: RendererName) -> Pixels:
    png = REFERENCES.joinpath(f"{renderer.value}.png").read_bytes()
    decoded = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR)
    assert decoded is not None
    return decoded.astype(np.uint8)


def png(pixels: Pixels) -> bytes:
    return cv2.imencode(".png", pixels)[1].tobytes()


def noisy(pixels: Pixels) -> Pixels:
    rng = np.random.default_rng(3)
    return (pixels + rng.normal(0, 2.5, pixels.shape)).clip(0, 255).astype(np.uint8)


def dim(pixels: Pixels) -> Pixels:
    return (pixels * 0.9).astype(np.uint8)


WRONG: dict[str, Callable[[Pixels], Pixels]] = {
    "black": lambda p: p * 0,
    "red for blue": lambda p: p[..., ::-1],
    "a pixel to the right": lambda p: np.roll(p, 1, axis=1),
    "a pixel down": lambda p: np.roll(p, 1, axis=0),
    "mirrored": lambda p: p[:, ::-1],
    "dim": dim,
    "no hand": lambda p: np.where(np.arange(64)[None, :, None] < 40, p[:, -1:], p),
}


@pytest.mark.parametrize("renderer", RendererName)
def test_the_reference_passes_with_and_without_noise(renderer: RendererName) -> None:
    pixels = picture(renderer)
    for passing in (pixels, noisy(pixels)):
        canary.judge(renderer, png(passing), LABEL)


@pytest.mark.parametrize("renderer", RendererName)
@pytest.mark.parametrize("spoil", WRONG.values(), ids=WRONG)
def test_a_wrong_picture_fails(renderer: RendererName, spoil: Callable[[Pixels], Pixels]) -> None:
    with pytest.raises(CanaryDied, match=r"the picture is wrong: .* dB"):
        canary.judge(renderer, png(spoil(picture(renderer))), LABEL)


def test_another_renderers_picture_fails() -> None:
    with pytest.raises(CanaryDied, match="the picture is wrong"):
        canary.judge(RendererName.CYCLES, png(picture(RendererName.FAKE)), LABEL)


@pytest.mark.parametrize(
    ("image", "reason"),
    [(b"GIF89a", "no PNG file"), (png(np.zeros((48, 64, 3), np.uint8)), r"\(48, 64, 3\)")],
)
def test_what_is_no_such_picture_fails(image: bytes, reason: str) -> None:
    with pytest.raises(CanaryDied, match=reason):
        canary.judge(RendererName.FAKE, image, LABEL)


def changed(path: tuple[str | int, ...], value: Any) -> bytes:
    document = json.loads(LABEL)
    place = document
    for step in path[:-1]:
        place = place[step]
    place[path[-1]] = value(place[path[-1]]) if callable(value) else value
    return json.dumps(document).encode()


@pytest.mark.parametrize(
    ("path", "value", "told"),
    [
        (("keypoints", 4, "image_px", 0), lambda x: x + 0.01, r"keypoints\[4\].image_px\[0\]"),
        (("keypoints", 4, "image_px", 0), float("nan"), "is nan"),
        (("keypoints", 0, "name"), "thumb1", "'thumb1', not 'wrist'"),
        (("keypoints", 8, "visibility"), 0, "visibility is 0"),
        (("attributes", "handedness"), "right", "'right', not 'left'"),
        (("box",), None, "box is None"),
        (("camera", "world_to_camera_m", 0, 0), lambda x: -x, "world_to_camera_m"),
    ],
)
def test_a_wrong_label_fails(path: tuple[str | int, ...], value: object, told: str) -> None:
    with pytest.raises(CanaryDied, match=f"the label is wrong: .*{told}"):
        canary.judge(RendererName.FAKE, png(picture(RendererName.FAKE)), changed(path, value))


def test_rounding_of_another_processor_passes() -> None:
    moved = changed(("keypoints", 4, "image_px", 0), lambda x: x + 1e-6)
    canary.judge(RendererName.FAKE, png(picture(RendererName.FAKE)), moved)


@pytest.mark.slow
def test_the_fake_renderers_canary_flies_here(tmp_path: Path) -> None:
    settings = runners.settings(
        tmp_path, child_module="services.worker.render_child", renderer="fake", image_timeout_s=300
    )
    canary.fly(settings, lambda: False)
    (ledger,) = settings.health_dir.glob("children-*.json")
    assert json.loads(ledger.read_text("utf-8"))["network"] == "none"


def test_a_child_that_draws_nothing_fails(tmp_path: Path) -> None:
    settings = runners.settings(
        tmp_path, child_module="tests.support.stand_in_child", renderer="fake"
    )
    with pytest.raises(AttemptFailed, match="wrong_files"):
        canary.fly(settings, lambda: False)


def test_a_failed_canary_is_told_and_tried_again_after_a_pause_that_grows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    now_s = 1000.0
    monkeypatch.setattr(time, "time", lambda: now_s)
    flights: list[float] = []
    fit = False

    def fly() -> None:
        flights.append(now_s)
        if not fit:
            raise CanaryDied("all black")

    admitted = Admission(tmp_path / "worker", fly)
    for _ in range(300):
        assert not admitted()
        now_s += 1.0
    assert flights == [1000.0, 1010.0, 1030.0, 1070.0, 1150.0]
    assert refusal(tmp_path / "worker") == "its canary failed: all black"
    fit = True
    now_s += 600.0
    assert [admitted() for _ in range(3)] == [True] * 3
    assert refusal(tmp_path / "worker") is None
    assert len(flights) == 6
    assert Admission(tmp_path / "worker", fly)()  # another process of the same worker
    assert len(flights) == 6


def test_a_worker_that_cannot_write_to_its_store_claims_nothing(tmp_path: Path) -> None:
    (tmp_path / "store").write_text("a file where the folder should be")
    here = Settings.model_validate({"data_dir": tmp_path, "renderer": "fake"})
    admitted = Admission(tmp_path / "worker", lambda: _trial(here, lambda: False))
    assert not admitted()
    told = refusal(tmp_path / "worker")
    assert told is not None
    assert "put: " in told


def test_two_processes_of_a_worker_send_one_canary(tmp_path: Path) -> None:
    flights: list[int] = []
    both = threading.Barrier(2)

    def ask() -> None:
        both.wait()
        assert Admission(tmp_path, lambda: flights.append(1))()

    threads = [threading.Thread(target=ask) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert flights == [1]


def test_a_worker_that_is_told_to_stop_is_not_called_unfit(tmp_path: Path) -> None:
    def fly() -> None:
        raise DrainRequested

    assert not Admission(tmp_path, fly)()
    assert refusal(tmp_path) is None
