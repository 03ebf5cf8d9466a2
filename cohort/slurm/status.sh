#!/bin/bash
# SPDX-License-Identifier: AGPL-3.0-or-later
# Says running, success or failed of a Slurm job: status.sh JOB
# As long as the controller does not answer, a job counts as running: it goes on without its controller.
state=$(scontrol --oneliner show job "$1" 2>&1)
if [[ "$state" == *"Invalid job id"* ]]; then
  # Too long ago for the controller; the accounting may know. Where there is none the job is asked for again: make finds what is done.
  state=JobState=$(sacct --allocations --noheader --parsable2 --format State --jobs "$1" 2>/dev/null | head -n 1)
  [ "$state" != JobState= ] || state=JobState=FAILED
fi
case "$state" in
  *JobState=COMPLETED*) echo success ;;
  *JobState=FAILED* | *JobState=CANCELLED* | *JobState=TIMEOUT* | *JobState=OUT_OF_MEMORY* | *JobState=NODE_FAIL* | \
    *JobState=BOOT_FAIL* | *JobState=DEADLINE* | *JobState=PREEMPTED*) echo failed ;;
  *) echo running ;;
esac
