// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "pipeline/report/stages.h"

namespace supine::pipeline {

/// A patient whose supine skin was scanned.
inline Case measured_case() {
  Case measured;
  measured.name = "patient";
  measured.poses = {{"prone", {0, -1, 0}, {}, {}, {}, {}}, {"supine", {0, 1, 0}, "supine.ply", 0.7, {}, {}}};
  return measured;
}

/// Of that case, relative to where make runs.
inline const Places places = {"/nowhere/mycase", "/nowhere/mycase/out", "mycase", "mycase/out"};

}  // namespace supine::pipeline
