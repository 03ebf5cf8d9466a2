#!/bin/bash
# SPDX-License-Identifier: AGPL-3.0-or-later
# Asked by cohort/Snakefile before anything is submitted: exit code 0 when the cluster answers, else what it said.
if ! command -v scontrol >/dev/null; then
  echo "there is no scontrol on this machine"
  exit 1
fi
answer=$(timeout 60 scontrol ping 2>&1)
grep -q 'is UP' <<<"$answer" && exit 0
echo "scontrol ping: ${answer:-no answer within a minute}"
exit 1
