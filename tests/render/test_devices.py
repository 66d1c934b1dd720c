"""Devices are listed, pinned by id, and nothing falls back to the CPU in silence."""

import json
import subprocess
import sys
from dataclasses import dataclass, field

import pytest

from services.worker.render.blender import devices, session
from services.worker.render.errors import DeviceMissing

pytestmark = pytest.mark.render


@dataclass
class Card:
    """A device as Cycles' preferences hold it."""

    type: str
    id: str
    name: str
    use: bool = True


@dataclass
class Preferences:
    """Cycles' preferences on a machine with the cards given; `deaf` takes no choice."""

    devices: list[Card]
    deaf: bool = False
    compute_device_type: str = "NONE"
    kinds: tuple[str, ...] = field(default=("NONE", "CUDA", "OPTIX"))

    def get_device_types(self, _context: object) -> list[tuple[str]]:
        return [(kind,) for kind in self.kinds]

    def get_devices_for_type(self, kind: str) -> list[Card]:
        return [card for card in self.devices if card.type in {kind, "CPU"}]

    def has_active_device(self) -> bool:
        return not self.deaf and any(card.use and card.type != "CPU" for card in self.devices)


def machine(*, deaf: bool = False) -> Preferences:
    cards = [Card("CPU", "CPU", "processor"), Card("CUDA", "CUDA_a", "first")]
    cards += [Card("OPTIX", "CUDA_a_OptiX", "first"), Card("OPTIX", "CUDA_b_OptiX", "second")]
    return Preferences(cards, deaf)


def test_a_device_that_is_not_here_is_refused_by_name() -> None:
    scene = session.open_session(1, persistent_data=False).scene
    assert devices.take(scene, "cpu") == "cpu"
    with pytest.raises(DeviceMissing, match="HI5_DEVICE: 'hip:none-such' is not here"):
        devices.take(scene, "hip:none-such")
    assert scene.cycles.device == "CPU"


def test_devices_are_listed_by_a_process_of_their_own() -> None:
    command = [sys.executable, "-m", "services.worker.render.blender.devices"]
    finished = subprocess.run(command, capture_output=True, text=True, check=True)
    listed = json.loads(finished.stdout.strip().splitlines()[-1])
    assert listed[0] == {"setting": "cpu", "name": "CPU"}


def test_exactly_the_device_of_an_id_is_used(monkeypatch: pytest.MonkeyPatch) -> None:
    here = machine()
    monkeypatch.setattr(devices, "_preferences", lambda: here)
    scene = session.open_session(1, persistent_data=False).scene
    assert devices.take(scene, "optix:CUDA_b_OptiX") == "OPTIX second"
    assert [card.id for card in here.devices if card.use] == ["CUDA_b_OptiX"]
    assert here.compute_device_type == "OPTIX"
    assert scene.cycles.device == "GPU"
    assert devices.take(scene, "cuda") == "CUDA first"
    with pytest.raises(DeviceMissing, match="cpu, optix:CUDA_a_OptiX, optix:CUDA_b_OptiX, cuda"):
        devices.take(scene, "metal")
    devices.take(scene, "cpu")
    assert scene.cycles.device == "CPU"


def test_a_device_that_cycles_does_not_take_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(devices, "_preferences", lambda: machine(deaf=True))
    scene = session.open_session(1, persistent_data=False).scene
    with pytest.raises(DeviceMissing, match="Cycles does not take optix:CUDA_a_OptiX"):
        devices.take(scene, "optix")
