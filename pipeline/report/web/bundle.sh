#!/bin/bash
# SPDX-License-Identifier: AGPL-3.0-or-later
# Bundles the 3-D view with vtk.js into one script: bundle.sh WEB_FOLDER NPM_FOLDER TARGET.js
# Packages are those of package-lock.json, fetched by npm into NPM_FOLDER once. Where that cannot be done TARGET becomes
# an empty file, with a word on why: the rest of the report does not need it.
set -euo pipefail
web=${1:?folder of package.json and view3d/}
npm=${2:?folder for the packages}
target=${3:?script to write}

leave_out() {
  echo "supine-report will have no 3-D view: $1" >&2
  [ -f "$target" ] && [ ! -s "$target" ] || : >"$target"
  exit 0
}

# Nothing to do when the bundle is newer than all it is made of.
if [ -s "$target" ] && [ -z "$(find "$web/view3d" "$web/package-lock.json" "$web/bundle.sh" -newer "$target" -print -quit)" ]; then exit 0; fi

command -v npm >/dev/null || leave_out "npm is not installed (apt-get install npm)"
mkdir -p "$npm"
if ! cmp -s "$web/package-lock.json" "$npm/installed-lock.json"; then
  cp "$web/package.json" "$web/package-lock.json" "$npm/"
  rm -f "$npm/installed-lock.json"
  (cd "$npm" && npm ci --ignore-scripts --no-audit --no-fund --fetch-retries=1 --fetch-timeout=20000 >npm.log 2>&1) ||
    leave_out "npm could not fetch its packages, see $npm/npm.log"
  cp "$web/package-lock.json" "$npm/installed-lock.json"
fi
# The sources stand beside node_modules, where imports are looked for.
rm -rf "$npm/view3d" && cp -r "$web/view3d" "$npm/view3d"
(cd "$npm" && node_modules/.bin/esbuild view3d/index.js --bundle --minify --format=iife --target=es2020 \
  --legal-comments=eof --charset=ascii --log-level=warning --metafile=bundle.json --outfile=bundle.js) >"$npm/esbuild.log" 2>&1 ||
  { cat "$npm/esbuild.log" >&2; exit 1; }

# The licences of what is in the bundle go with it.
licences() {
  local package file
  jq -r '.inputs | keys[] | capture("node_modules/(?<package>(@[^/]+/)?[^/]+)").package' "$npm/bundle.json" | sort -u |
    while read -r package; do
      echo "$package $(jq -r '"\(.version), \(.license)"' "$npm/node_modules/$package/package.json")"
      for file in "$npm/node_modules/$package"/{LICENSE,LICENSE.md,LICENSE.txt}; do
        if [ -f "$file" ]; then sed 's#\*/#* /#g' "$file"; fi
      done
    done
}
{
  echo "/* The 3-D view of Supine, AGPL-3.0-or-later, with these packages:"
  licences
  echo "*/"
  cat "$npm/bundle.js"
} >"$target.part"
mv "$target.part" "$target"
