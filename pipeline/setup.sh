#!/bin/bash
# SPDX-License-Identifier: AGPL-3.0-or-later
# Installs the Debian packages that Supine needs and that are missing. Does nothing, and asks for nothing, when all are there.
set -euo pipefail

packages=(
  build-essential cmake ninja-build git jq python3
  libeigen3-dev libsuitesparse-dev libopenblas-pthread-dev
  libvtk9-dev libcgal-dev libtet1.5-dev libopenmesh-dev libceres-dev libpagmo-dev libteem-dev libgdcm-dev libboost-dev zlib1g-dev
  libcli11-dev libtomlplusplus-dev nlohmann-json3-dev libspdlog-dev libfmt-dev libssl-dev
  python3-dev python3-numpy pybind11-dev
  libgtest-dev libbenchmark-dev
  xvfb libgl1-mesa-dri
)

# npm fetches vtk.js for the 3-D view of the report; any npm will do, and without one the report has no 3-D view.
command -v npm >/dev/null || packages+=(nodejs npm)

installed=$(dpkg-query -W -f='${db:Status-Status} ${Package}\n' 2>/dev/null || true)
missing=()
for package in "${packages[@]}"; do
  grep -qx "installed $package" <<<"$installed" || missing+=("$package")
done
if ((${#missing[@]} == 0)); then exit 0; fi

if ! command -v apt-get >/dev/null; then
  echo "setup: no apt-get here. Supine is built on Debian 12; elsewhere, install what matches: ${missing[*]}" >&2
  exit 2
fi
as_root=()
if ((EUID != 0)); then
  if ! command -v sudo >/dev/null; then
    echo "setup: not root and no sudo. Ask an administrator for: apt-get install ${missing[*]}" >&2
    exit 2
  fi
  as_root=(sudo)
fi
echo "setup: installing ${missing[*]}"
"${as_root[@]}" apt-get update -qq
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}"
