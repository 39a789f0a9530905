"""Spectra at uneven places against fits of each wave by itself."""

from __future__ import annotations

import numpy as np
import pytest

from friction_ocp.effects.spectrum import LINES, spectrum


@pytest.mark.parametrize("lines", [0, 1, 7, LINES + 50])
def test_a_wave_takes_what_a_fit_of_it_alone_does(lines: int) -> None:
    """Of what is left beside a multiple of what it is multiplied with; also where lines are looked at in parts."""
    rng = np.random.default_rng(2)
    place = np.sort(rng.uniform(0.0, 20.0, 400))
    factor = np.where(np.sin(place) > 0.0, 1.0, -0.5)
    values = factor * (0.3 + np.cos(2.0 * np.pi * 3.1 * place)) + rng.standard_normal(place.size)
    frequencies = np.linspace(0.05, 12.0, lines)
    found = spectrum(place, np.zeros(place.size), values, factor, frequencies)
    plain = values - factor * (factor @ values) / (factor @ factor)
    expected = list[float]()
    for frequency in frequencies:
        turned = 2.0 * np.pi * frequency * place
        basis = factor[:, None] * np.column_stack([np.cos(turned), np.sin(turned)])
        left = plain - basis @ np.linalg.lstsq(basis, plain, rcond=None)[0]
        expected.append(float(plain @ plain - left @ left))
    assert found == pytest.approx(np.array(expected), rel=1e-9, abs=1e-9)


def test_a_wave_takes_what_a_fit_to_means_does() -> None:
    """Over places so far apart that a mean leaves a part of a wave, or, of what is passed within it, nothing."""
    rng = np.random.default_rng(3)
    place, across = np.sort(rng.uniform(0.0, 20.0, 400)), rng.uniform(0.0, 0.5, 400)
    values = np.sinc(3.1 * across) * np.cos(2.0 * np.pi * 3.1 * place) + 0.1 * rng.standard_normal(place.size)
    frequencies = np.linspace(3.09, 3.11, 5)
    found = spectrum(place, across, values, np.ones(place.size), frequencies)
    plain, seen = values - values.mean(), np.where(3.1 * across < 1.0, np.sinc(3.1 * across), 0.0)
    for power, frequency in zip(found, frequencies, strict=True):
        turned = 2.0 * np.pi * frequency * place
        basis = seen[:, None] * np.column_stack([np.cos(turned), np.sin(turned)])
        left = plain - basis @ np.linalg.lstsq(basis, plain, rcond=None)[0]
        assert power == pytest.approx(plain @ plain - left @ left, rel=1e-9)
