#!/bin/bash
# SPDX-License-Identifier: AGPL-3.0-or-later
# Installs the Debian packages in a bare Debian 12 root and uses them there: package_test.sh PACKAGES WORK
# The sample goes from its MRI to the report, Python predicts it to the same bytes, samples/own_effect is built and run. Needs root, debootstrap and a registry.
# DEV=no leaves out supine-dev and own_effect. A root from an earlier call is used again.
set -euo pipefail
packages=$(realpath "$1") work=$(realpath -m "$2") mirror=${MIRROR:-http://deb.debian.org/debian}
root=$work/root
say() { echo "[$(date +%T)] $*"; }
inside() { chroot "$root" env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive "$@"; }

command -v debootstrap >/dev/null || { echo "package_test.sh needs debootstrap: apt-get install debootstrap" >&2; exit 2; }
mkdir -p "$work"
if [ ! -d "$root/var/lib/dpkg" ]; then
  say "a bare Debian 12"
  debootstrap --variant=minbase bookworm "$root" "$mirror" >"$work/debootstrap.log"
fi
cleanup() { umount "$root/dev" "$root/proc" 2>/dev/null || true; }
trap cleanup EXIT
mountpoint -q "$root/proc" || mount -t proc proc "$root/proc"
mountpoint -q "$root/dev" || mount --bind /dev "$root/dev"
# The proxy of this machine, where it has one.
apt-config dump | grep -i '^Acquire::https\?::Proxy ' >"$root/etc/apt/apt.conf.d/99proxy" || true
mkdir -p "$root/packages"
cp "$packages"/*.deb "$root/packages/"
inside apt-get update -qq

say "install supine"
inside sh -c 'apt-get install -y -qq --no-install-recommends /packages/supine_*.deb' >"$work/install.log" 2>&1 || { tail "$work/install.log"; exit 1; }
say "installed: $(inside dpkg-query -W supine)"
inside supine --version
inside sh -c 'for tool in /usr/bin/supine-*; do $tool --version >/dev/null && test -f /usr/share/man/man1/$(basename $tool).1.gz || exit 1; done'
inside bash -c 'source /usr/share/bash-completion/completions/supine-segment && COMP_WORDS=(supine-calibrate --meth) && COMP_CWORD=1 &&
  _supine_tool supine-calibrate && [ "${COMPREPLY[*]}" = --method ]'
say "every tool starts and has its man page; completion knows --method"

say "the sample, from its MRI to the report"
rm -rf "$root/root/mycase"
inside cp -r /usr/share/supine/samples/ligament /root/mycase
inside supine CASE=/root/mycase calibrate report THREADS=2 ${TRIANGLES:+TRIANGLES=$TRIANGLES} >"$work/sample.log" 2>&1 || { tail "$work/sample.log"; exit 1; }
grep -q view3d "$root/root/mycase/out/report.html" && say "report: $(stat -c %s "$root/root/mycase/out/report.html") bytes"
jq -r '"RMS \(.rms_mm) mm after calibration"' "$root/root/mycase/out/calibration.json"
inside mkdir -p /root/cohort && inside cp -r /root/mycase /root/cohort/
inside supine COHORT=/root/cohort TARGET=calibrate THREADS=2 | tail -n 1

say "install python3-supine"
inside sh -c 'apt-get install -y -qq --no-install-recommends /packages/python3-supine_*.deb' >"$work/install-python.log" 2>&1 || { tail "$work/install-python.log"; exit 1; }
inside python3 -c '
import supine
case = supine.Case("/root/mycase")
mesh = supine.Mesh("/root/mycase/out/mesh.vtu", case)
supine.simulate(case, mesh, supine.Model("/root/mycase/model.toml")).write("supine", "/root/python.vtu", force=True)'
cmp "$root/root/python.vtu" "$root/root/mycase/out/supine.vtu" && say "Python predicts the bytes of the tools"

[ "${DEV:-yes}" = yes ] || exit 0
say "install supine-dev"
inside sh -c 'apt-get install -y -qq --no-install-recommends /packages/supine-dev_*.deb' >"$work/install-dev.log" 2>&1 || { tail "$work/install-dev.log"; exit 1; }
say "build samples/own_effect"
inside sh -c 'cp -r /usr/share/supine/samples/own_effect /root/ && cmake -S /root/own_effect -B /root/own && cmake --build /root/own --target supine-model supine-simulate' \
  >"$work/own.log" 2>&1 || { tail "$work/own.log"; exit 1; }
inside /root/own/bin/supine-model add scar /root/mycase/model.toml --force --quiet
inside /root/own/bin/supine-simulate /root/mycase /root/mycase/out/mesh.vtu -o /root/scarred --quiet
if cmp -s "$root/root/scarred/supine.vtu" "$root/root/mycase/out/supine.vtu"; then say "the scar changes nothing"; exit 1; fi
say "own effect built against the package and simulated"
