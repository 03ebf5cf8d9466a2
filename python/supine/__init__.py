# SPDX-License-Identifier: AGPL-3.0-or-later
"""Prone breast MRI to supine shape, and which effect a model lacks: docs/python.md.

Lengths are mm, moduli kPa, coordinates patient LPS. What the tools refuse is raised as supine.InputError with their
message, what has no solution as supine.NumericalFailure.
"""

from . import _environment

_environment.choose()

from ._supine import *  # noqa: E402,F401,F403
from ._supine import __version__  # noqa: E402,F401
from .own import Effect, Residual, add_effect  # noqa: E402,F401
