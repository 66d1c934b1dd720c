"""Rendering here what failed there: one image, one draw of its cell."""

from pathlib import Path

import pytest

from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import parse_spec
from hi5_common.settings import RendererName
from services.worker import local_render
from services.worker.scene.sampling import Take
from services.worker.studio import open_studio


def test_a_draw_is_rendered_as_the_fleet_renders_it(tmp_path: Path) -> None:
    studio = open_studio(RendererName.FAKE, 1, tmp_path / "cache")
    image = {"width": 64, "height": 64, "format": "png"}
    spec = parse_spec({"count": 3, "image": image, "attributes": {"environment": ["studio"]}})
    made = {}
    for draw in (0, 1):
        out = tmp_path / str(draw)
        tally = local_render.render_all(studio, spec, [Take(2, draw)], out)
        (path,) = (out / "images").iterdir()
        made[draw] = path.read_bytes()
        sample = studio.make_sample(spec, Plan.of(spec), Take(2, draw))
        assert (path.name, made[draw]) == (sample.label.file_name, sample.image)
        assert [label.index for label in tally.labels] == [2]
    assert made[0] != made[1]


def test_a_draw_without_its_image_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spec = tmp_path / "spec.yaml"
    spec.write_text("count: 3\n")
    code = local_render.main([str(spec), f"--out={tmp_path / 'out'}", "--draw=1"])
    assert code == local_render.WRONG_INPUT
    assert "--index" in capsys.readouterr().err
