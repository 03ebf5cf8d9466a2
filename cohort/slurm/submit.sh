#!/bin/bash
# SPDX-License-Identifier: AGPL-3.0-or-later
# Submits a job script of Snakemake to Slurm and prints the job's number: submit.sh JOBSCRIPT
# A controller that does not answer is asked again for a quarter of an hour; a job it had taken before is not submitted twice.
set -uo pipefail
script=$1
properties=$(sed -n 's/^# properties = //p' "$script")
read -r name threads memory minutes < <(jq -r '[([.rule] + [.wildcards[]] + [(.jobid | tostring)] | join(".")),
  .threads, .resources.mem_mb, .resources.runtime] | @tsv' <<<"$properties")
logs=$(dirname "$(jq -r '.output[0]' <<<"$properties")")
mkdir -p "$logs"
name=supine.$name.$(basename "$(dirname "$script")")
for attempt in {1..90}; do
  if ((attempt > 1)); then
    taken=$(squeue --noheader --name "$name" --format %i 2>/dev/null | head -n 1)
    if [ -n "$taken" ]; then
      echo "$taken"
      exit 0
    fi
  fi
  if answer=$(sbatch --parsable --job-name "$name" --cpus-per-task "$threads" --mem "${memory}M" --time "$minutes" \
      --output "$logs/slurm-%j.log" "$script" 2>&1); then
    echo "${answer%%;*}"
    exit 0
  fi
  # Only a controller that does not answer is worth waiting for.
  grep -q -i -e 'unable to contact' -e 'connect failure' -e 'timed out' -e 'temporarily' <<<"$answer" || break
  sleep 10
done
echo "submit.sh: $name was not submitted: $answer" >&2
exit 1
