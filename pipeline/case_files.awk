# SPDX-License-Identifier: AGPL-3.0-or-later
# Prints what a case.toml names, one "kind=name" a line, for the prerequisites in pipeline/Makefile:
# image=FILE, surface.POSE=FILE, landmarks.POSE=FILE, prone_landmarks=FILE, pose=NAME.
# Names with blanks cannot be prerequisites and are left out; the tools read them all the same.
/^[ \t]*\[/ {
  section = $0
  gsub(/[][ \t"]|#.*/, "", section)
  if (section ~ /^pose\./) print "pose=" substr(section, 6)
  next
}
match($0, /^[ \t]*[a-z_]+[ \t]*=[ \t]*["'][^"' \t]+["']/) {
  split(substr($0, RSTART, RLENGTH), part, /[ \t]*=[ \t]*/)
  key = part[1]; sub(/^[ \t]*/, "", key)
  value = substr(part[2], 2, length(part[2]) - 2)
  if (section == "image" && key == "file") print "image=" value
  if (section == "landmarks" && key == "prone") print "prone_landmarks=" value
  if (section ~ /^pose\./ && (key == "surface" || key == "landmarks")) print key "." substr(section, 6) "=" value
}
