# SPDX-License-Identifier: AGPL-3.0-or-later
"""Two settings that libraries read from the environment when they are loaded, as the tools make them for themselves
(pipeline/tool/runtime_settings.h): without them solves are slower, and last digits may be others than the tools'."""

import os
import pathlib
import subprocess
import sys

from . import _settings

_CORE = ("import ctypes; f = ctypes.CDLL('libopenblas.so.0').openblas_get_corename; f.restype = ctypes.c_char_p; "
         "print(f().decode())")


def _fitting_kernels():
    """OPENBLAS_CORETYPE that OpenBLAS does not find by itself on this processor, or ''."""
    # By a process of its own: once loaded here, OpenBLAS would keep what it chose.
    done = subprocess.run([sys.executable, "-I", "-S", "-c", _CORE], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                          universal_newlines=True)
    return _settings.fitting_blas_kernels(done.stdout.strip()) if done.returncode == 0 else ""


def choose():
    """Makes the settings that the user has not made. Gives those that come too late, as VARIABLE=value."""
    wanted = {}
    if "OMP_WAIT_POLICY" not in os.environ and "GOMP_SPINCOUNT" not in os.environ:
        wanted["libgomp"] = ("GOMP_SPINCOUNT", "1000")
    if "OPENBLAS_CORETYPE" not in os.environ and sys.executable:
        kernels = _fitting_kernels()
        if kernels:
            wanted["libopenblas"] = ("OPENBLAS_CORETYPE", kernels)
    loaded = pathlib.Path("/proc/self/maps").read_text()
    os.environ.update(wanted.values())
    return ["=".join(setting) for library, setting in wanted.items() if library in loaded]
