"""What may not be used commercially is refused where its file is, whoever let the spec through."""

from pathlib import Path

import numpy as np
import pytest

from hi5_common.domain.environments import EnvironmentKind
from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import DatasetSpec, parse_spec
from hi5_common.settings import RendererName
from services.worker import local_render
from services.worker.places.errors import NotCommercial
from services.worker.places.exr import write_panorama
from services.worker.places.intake import Terms, add_folder
from services.worker.sample import Studio
from services.worker.studio import open_studio


def added(folder: Path, assets: Path, licence: str) -> None:
    """Take a grey panorama in as `hi5 assets add` does."""
    folder.mkdir(exist_ok=True)
    write_panorama(folder / "mine.exr", np.full((32, 64, 3), 0.5, dtype=np.float32))
    add_folder(folder, assets, Terms(EnvironmentKind.INDOOR, licence, "A Test"))


def spec_of(*, safe: bool) -> DatasetSpec:
    return parse_spec(
        {
            "count": 1,
            "commercial_safe": safe,
            "image": {"width": 48, "height": 48},
            "attributes": {"environment": ["user:mine"]},
        }
    )


@pytest.fixture
def studio(tmp_path: Path) -> Studio:
    return open_studio(RendererName.FAKE, 1, tmp_path / "cache", tmp_path / "assets")


def test_a_worker_renders_no_panorama_that_may_not_be_traded(
    studio: Studio, tmp_path: Path
) -> None:
    added(tmp_path / "in", tmp_path / "assets", "CC-BY-NC-4.0")
    safe, free = spec_of(safe=True), spec_of(safe=False)
    with pytest.raises(NotCommercial, match=r"user:mine.*CC-BY-NC-4\.0 forbids commercial use"):
        studio.make_sample(safe, Plan.of(safe), 0)
    label = studio.make_sample(free, Plan.of(free), 0).label
    assert label.scene["place"]["licence"] == "CC-BY-NC-4.0"
    added(tmp_path / "in", tmp_path / "assets", "CC-BY-4.0")
    assert studio.make_sample(safe, Plan.of(safe), 0).label.scene["place"]["author"] == "A Test"


def test_rendering_here_is_refused_before_anything_is_opened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("HI5_ASSETS_DIR", str(tmp_path / "assets"))
    added(tmp_path / "in", tmp_path / "assets", "unknown")
    spec = tmp_path / "spec.json"
    spec.write_text(spec_of(safe=True).canonical_json(), "utf-8")
    code = local_render.main([str(spec), f"--out={tmp_path / 'out'}", "--renderer=fake"])
    assert code == local_render.WRONG_INPUT
    assert "user:mine" in (said := capsys.readouterr().err)
    assert "its licence is unknown" in said
    assert not (tmp_path / "out").exists()
