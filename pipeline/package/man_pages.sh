#!/bin/bash
# SPDX-License-Identifier: AGPL-3.0-or-later
# Man pages of the tools from what they say themselves: man_pages.sh FOLDER TOOL...
set -euo pipefail
folder=$1
shift
command -v help2man >/dev/null || { echo "man pages need help2man: apt-get install help2man" >&2; exit 2; }
mkdir -p "$folder"
for tool in "$@"; do
  name=$(basename "$tool")
  # The first sentence of --help is the line below NAME; the version is the first line of --version.
  what=$("$tool" --help | head -n 1 | sed 's/\([.:?]\) .*/\1/; s/[.:]$//')
  help2man --no-info --section 1 --name "$what" --version-string "$("$tool" --version | head -n 1)" --output "$folder/$name.1" "$tool"
  gzip -9nf "$folder/$name.1"
done
