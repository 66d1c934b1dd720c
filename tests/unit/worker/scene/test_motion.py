import numpy as np
import pytest

from services.worker.scene.motion import MOTIONS, Keys, keyed

KEYS = sorted({keys for motion in MOTIONS.values() for keys in motion.keys.values()})


@pytest.mark.parametrize("keys", KEYS)
def test_a_loop_goes_through_its_keys_and_never_past_them(keys: Keys) -> None:
    assert [keyed(keys, at / (len(keys) - 1)) for at in range(len(keys))] == pytest.approx(keys)
    way = np.array([keyed(keys, phase) for phase in np.linspace(0.0, 1.0, 401)])
    assert way.min() == pytest.approx(min(keys), abs=0.02)
    assert way.max() == pytest.approx(max(keys), abs=0.02)


@pytest.mark.parametrize("keys", KEYS)
def test_a_swing_is_fastest_midway_and_does_not_stop_there(keys: Keys) -> None:
    step = 1e-4
    way = np.array([keyed(keys, phase) for phase in np.arange(0.0, 1.0 + step, step)])
    usual = np.abs(np.diff(way)).mean() / step
    loop = keys[:-1]
    for number, here in enumerate(loop):
        before, after = loop[number - 1], loop[(number + 1) % len(loop)]
        at = number / len(loop)
        speed = abs(keyed(keys, at + step) - keyed(keys, at - step)) / (2.0 * step)
        turns = (here - before) * (after - here) <= 0.0
        assert speed == pytest.approx(0.0, abs=0.01 * usual) if turns else speed > 1.3 * usual
