# SPDX-License-Identifier: AGPL-3.0-or-later
"""Prone breast MRI to supine shape, and which effect a model lacks: docs/python.md.

Lengths are mm, moduli kPa, coordinates patient LPS. What the tools refuse is raised as supine.InputError with their
message, what has no solution as supine.NumericalFailure.
"""

import warnings

from . import _environment

_late = _environment.choose()

from ._supine import *  # noqa: E402,F401,F403
from ._supine import SupineWarning, __version__  # noqa: E402,F401
from .own import Effect, Residual, add_effect  # noqa: E402,F401

if _late:
    warnings.warn("another package has loaded OpenMP or OpenBLAS already (matplotlib, numpy): solves are slower, ten times "
                  "where the machine is busy, and last digits may differ from the tools'. Import supine first, or start "
                  "Python with " + " ".join(_late), SupineWarning, stacklevel=2)
