# SPDX-License-Identifier: AGPL-3.0-or-later
# Bash completion of the tools: options from their own --help, the values of an option where it lists them, else files.
_supine_tool() {
  local current=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]} help values
  help=$("$1" --help 2>/dev/null) || return
  if [[ "$before" == --* ]]; then
    values=$(sed -n "s/^ *\(-[a-z],\)\?$before [A-Z]*:{\([^}]*\)}.*/\2/p" <<<"$help" | tr ',' ' ')
    if [ -n "$values" ]; then
      mapfile -t COMPREPLY < <(compgen -W "$values" -- "$current")
      return
    fi
  fi
  if [[ "$current" == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$(grep -o -E '(^| |,)--[a-z][a-z0-9-]*' <<<"$help" | tr -d ' ,' | sort -u)" -- "$current")
    return
  fi
  compopt -o filenames
  mapfile -t COMPREPLY < <(compgen -f -- "$current")
}
_supine() {
  local current=${COMP_WORDS[COMP_CWORD]}
  local stages="segment reconstruct decimate mesh simulate register compare calibrate diagnose ladder sensitivity targets warp report summary"
  local variables="CASE= COHORT= OUT= TARGET= PROFILE= THREADS= TRIANGLES= MAX_DISTANCE_MM= ORDER= METHOD= SAMPLES= PARTS="
  # Bash takes "=" for a word of its own.
  if [ "$current" = "=" ] || [ "${COMP_WORDS[COMP_CWORD - 1]}" = "=" ]; then
    compopt -o filenames
    mapfile -t COMPREPLY < <(compgen -d -- "${current#=}")
    return
  fi
  mapfile -t COMPREPLY < <(compgen -W "$stages $variables --help --version" -- "$current")
  [[ "${COMPREPLY[*]}" != *= ]] || compopt -o nospace
}
complete -F _supine supine
for _supine_name in segment reconstruct decimate tetrahedralise simulate compare register calibrate sensitivity diagnose targets warp model report phantom cohort; do
  complete -F _supine_tool "supine-$_supine_name"
done
unset _supine_name
