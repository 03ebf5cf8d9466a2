# SPDX-License-Identifier: AGPL-3.0-or-later
# Prints what one stage reads of a case.toml, without comments: awk -v part=segment|simulate|compare -f case_part.awk case.toml
{ sub(/^[ \t]+/, ""); sub(/[ \t]*#[^"']*$/, ""); sub(/[ \t]+$/, "") }
/^$/ { next }
/^\[[a-z[]/ { section = $0; gsub(/[][ ]/, "", section) }
section ~ /^case/ ||
(part == "segment" && section ~ /^(image|segmentation)/) ||
(part == "simulate" && (section ~ /^landmarks/ || (section ~ /^pose/ && /^(\[|gravity)/))) ||
(part == "compare" && section ~ /^(pose|landmarks)/) { print }
