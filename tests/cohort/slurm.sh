#!/bin/bash
# SPDX-License-Identifier: AGPL-3.0-or-later
# A cohort on a real one-node Slurm, set up here on the loopback and taken down again: slurm.sh WORK BIN [CASES] [DRAWS]
# Needs root and the Debian packages snakemake, slurm-wlm, munge. The controller is killed and started again in the middle; one
# case cannot be run, one needs more memory than it is given first. What comes out must be the bytes of make COHORT.
set -euo pipefail
work=$(realpath -m "${1:?slurm.sh WORK BIN [CASES] [DRAWS]}") bin=$(realpath "$2") count=${3:-20} draws=${4:-100}
cd "$(dirname "$0")/../.."
rm -rf "$work"
mkdir -p "$work"/{munge,state,spool,answers,cohort}
settings="ORDER=1 TRIANGLES=400 MAX_DISTANCE_MM=4 SAMPLES=$draws PARTS=4"

say() { echo "[$(date +%T)] $*"; }
stop_all() {
  for pid in "$work"/slurmctld.pid "$work"/slurmd.pid "$work"/munge/munged.pid; do
    if [ -f "$pid" ]; then kill "$(<"$pid")" 2>/dev/null || true; fi
  done
}
trap stop_all EXIT

start_munge() {
  chmod 0711 "$work/munge"
  dd if=/dev/urandom of="$work/munge/key" bs=128 count=1 status=none
  chmod 0600 "$work/munge/key"
  munged --force --key-file="$work/munge/key" --socket="$work/munge/socket" --pid-file="$work/munge/munged.pid" \
    --log-file="$work/munge/log" --seed-file="$work/munge/seed"
}

write_slurm_conf() {
  local host
  host=$(hostname -s)
  cat >"$work/slurm.conf" <<CONF
ClusterName=loopback
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=16817
SlurmdPort=16818
AuthType=auth/munge
AuthInfo=socket=$work/munge/socket
CryptoType=crypto/munge
SlurmUser=root
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
SlurmctldLogFile=$work/slurmctld.log
SlurmdLogFile=$work/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MailProg=/bin/true
ReturnToService=2
SlurmdTimeout=30
JobAcctGatherType=jobacct_gather/linux
JobAcctGatherFrequency=task=1
JobAcctGatherParams=OverMemoryKill
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
NodeName=$host NodeAddr=127.0.0.1 CPUs=2 RealMemory=8000 State=UNKNOWN
PartitionName=all Nodes=$host Default=YES MaxTime=INFINITE State=UP
CONF
  export SLURM_CONF=$work/slurm.conf
}

wait_for_controller() {
  for _ in {1..60}; do
    if scontrol ping 2>/dev/null | grep -q 'is UP'; then return; fi
    sleep 1
  done
  say "the controller does not come up"; tail "$work/slurmctld.log"; exit 1
}

make_cases() {
  local i name
  for ((i = 1; i <= count; ++i)); do
    name=$(printf 'case-%03d' "$i")
    "$bin/supine-phantom" --effect null --seed "$i" --rings 5 --order 1 --voxel-mm "$( ((i == 2)) && echo 0.5 || echo 3)" \
      -o "$work/cohort/$name" --answer "$work/answers/$name.json" --quiet
  done
  # One has no answer: nothing falls anywhere.
  sed -i '/^\[pose.prone\]/,/^gravity/ s/^gravity = .*/gravity = [0, 0, 0]/' "$work/cohort/case-001/case.toml"
  # One has an image of 42 million voxels, as many bytes.
  /usr/bin/python3 - "$work/cohort/case-002/labels.nrrd" <<'PYTHON'
import gzip, sys
header, _, data = open(sys.argv[1], "rb").read().partition(b"\n\n")
open(sys.argv[1], "wb").write(header.replace(b"encoding: gzip", b"encoding: raw") + b"\n\n" + gzip.decompress(data))
PYTHON
}

say "$count cases, $draws draws each in 4 parts; $(snakemake --version | sed 's/^/snakemake /'), $(slurmctld -V), $(nproc) cores"
make_cases
say "cases are made"
write_slurm_conf

say "a cluster that does not answer:"
if snakemake -s cohort/Snakefile --profile cohort/slurm --config cohort="$work/cohort" target=mesh out="$work/none" bin="$bin" \
    >"$work/refused.log" 2>&1; then say "it was taken for a cluster"; exit 1; fi
grep -h 'does not answer' "$work/refused.log"
[ ! -d "$work/none" ] || { say "something was submitted"; exit 1; }

start_munge
slurmctld -c
wait_for_controller
slurmd
sinfo

say "on Slurm"
start=$SECONDS
snakemake -s cohort/Snakefile --profile cohort/slurm --config cohort="$work/cohort" target=sensitivity out="$work/slurm" bin="$bin" \
  make="$settings" memory=0.3 >"$work/snakemake.log" 2>&1 &
runner=$!
while kill -0 $runner 2>/dev/null && (($(find "$work/slurm" -name 'draws-*.done' 2>/dev/null | wc -l) < count)); do sleep 2; done
kill -0 $runner || { tail -n 30 "$work/snakemake.log"; exit 1; }
say "a quarter of the parts is done: the controller is killed, $(squeue --noheader | wc -l) jobs in the queue"
kill -9 "$(<"$work/slurmctld.pid")"
sleep 30
say "and started again"
slurmctld
wait_for_controller
wait $runner || true
say "Slurm is done after $((SECONDS - start)) s"
sed -n '/^Set aside/,/cases done/p' "$work/snakemake.log"
say "killed for memory, and tried once more:"
grep -h 'exceeded memory' "$work"/slurmd.log | sed 's/.*error: /  /' | sort -u | head -n 6 || true
jobs=$(scontrol show job -o 2>/dev/null | wc -l)

say "the same on this machine alone"
start=$SECONDS
make --no-print-directory -s -f cohort/Makefile COHORT="$work/cohort" OUT="$work/alone" BIN="$bin" TARGET=sensitivity $settings THREADS=2 \
  >"$work/alone.log" 2>&1 || true
say "make COHORT is done after $((SECONDS - start)) s"
tail -n 4 "$work/alone.log"

same=0
for ((i = 2; i <= count; ++i)); do
  name=$(printf 'case-%03d' "$i")
  for file in labels.vti coarse.vtp mesh.vtu sensitivity.csv; do cmp "$work/slurm/$name/$file" "$work/alone/$name/$file"; done
  cmp <(jq 'del(.timing)' "$work/slurm/$name/sensitivity.json") <(jq 'del(.timing)' "$work/alone/$name/sensitivity.json")
  same=$((same + 1))
done
grep -q 'gravity' "$work/slurm/case-001/failed.txt"
grep -q 'gravity' "$work/alone/case-001/failed.txt"
say "$same cases have the same bytes, case-001 was set aside by both"

say "what is done is not run again:"
snakemake -s cohort/Snakefile --profile cohort/slurm --config cohort="$work/cohort" target=sensitivity out="$work/slurm" bin="$bin" \
  make="$settings" memory=0.3 >"$work/again.log" 2>&1 || true
grep -E '^(stage|part|total) ' "$work/again.log" || true
say "jobs that the controller still knows: $jobs"
