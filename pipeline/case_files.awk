# SPDX-License-Identifier: AGPL-3.0-or-later
# Prints what a case.toml names, one "kind=name" a line, for the prerequisites in pipeline/Makefile:
# image=FILE, image_kind=KIND, image_pose=POSE, place=FILE (of a support or part), surface.POSE=FILE, landmarks.POSE=FILE, prone_landmarks=FILE, cohort=FILE, pose=NAME.
# A name with a blank cannot be a prerequisite, so that make would miss its changes: blank=KEY.
/^[ \t]*\[/ {
  section = $0
  gsub(/[][ \t"]|#.*/, "", section)
  if (section ~ /^pose\./) print "pose=" substr(section, 6)
  next
}
match($0, /^[ \t]*(file|prone|surface|landmarks)[ \t]*=[ \t]*("[^"]*[ \t][^"]*"|'[^']*[ \t][^']*')/) {
  if (section ~ /^(image(\.(supports|parts)\..*)?|landmarks|pose\..*)$/) { sub(/^[ \t]*/, ""); print "blank=" substr($0, 1, match($0, /[ \t=]/) - 1) }
  next
}
match($0, /^[ \t]*[a-z_]+[ \t]*=[ \t]*["'][^"' \t]+["']/) {
  split(substr($0, RSTART, RLENGTH), part, /[ \t]*=[ \t]*/)
  key = part[1]; sub(/^[ \t]*/, "", key)
  value = substr(part[2], 2, length(part[2]) - 2)
  if (section == "image" && key == "file") print "image=" value
  if (section == "image" && (key == "kind" || key == "pose")) print "image_" key "=" value
  if (section ~ /^image\.(supports|parts)\./ && key == "file") print "place=" value
  if (section == "landmarks") print "prone_landmarks=" value
  if (section == "priors" && key == "cohort") print "cohort=" value
  if (section ~ /^pose\./ && (key == "surface" || key == "landmarks")) print key "." substr(section, 6) "=" value
}
