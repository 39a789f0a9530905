"""Samples of lost frames and codes for errors are told before they spoil a fit."""

from __future__ import annotations

import h5py
from problem_workshop import Workshop

from friction_ocp.problem_file.check import check_before_fit
from friction_ocp.problem_file.load import load_problem


def test_stray_samples_are_told_unless_a_robust_loss_bears_them(workshop: Workshop) -> None:
    """Two samples of an encoder that lost its frames."""

    def lose(file: h5py.File) -> None:
        file["channels/position"][700:702] = -9999.0

    workshop.recording("sweep.h5", lose)
    for loss, told in (("squares", True), ("huber", False)):
        path = workshop.problem(lambda content, loss=loss: content.update(estimation={"loss": loss}))
        said = [str(finding) for finding in check_before_fit(load_problem(path))]
        strays = "leaves its course for 2 samples and comes back, first at 1.4000 s with -9999 rad"
        assert any(strays in line and "make these samples NaN, or state `loss: huber`" in line for line in said) == told
