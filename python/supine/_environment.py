# SPDX-License-Identifier: AGPL-3.0-or-later
"""Two settings that libraries read from the environment when they are loaded, as the tools make them for themselves
(pipeline/tool/runtime_settings.h): without them solves are slower, and last digits may be others than the tools'."""

import os
import subprocess
import sys

from . import _settings

_CORE = ("import ctypes; f = ctypes.CDLL('libopenblas.so.0').openblas_get_corename; f.restype = ctypes.c_char_p; "
         "print(f().decode())")


def choose():
    if "OMP_WAIT_POLICY" not in os.environ:
        os.environ.setdefault("GOMP_SPINCOUNT", "1000")
    if "OPENBLAS_CORETYPE" in os.environ or not sys.executable:
        return
    # By a process of its own: once loaded here, OpenBLAS would keep what it chose.
    done = subprocess.run([sys.executable, "-I", "-S", "-c", _CORE], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                          universal_newlines=True)
    kernels = _settings.fitting_blas_kernels(done.stdout.strip()) if done.returncode == 0 else ""
    if kernels:
        os.environ["OPENBLAS_CORETYPE"] = kernels
