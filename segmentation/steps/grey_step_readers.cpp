// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/steps/step_readers.h"

namespace supine::segmentation {

Step read_noise_floor(const StepTable& table) { return NoiseFloor{table.grey("air_below", 0, positive)}; }

Step read_bias(const StepTable& table) {
  Bias step;
  step.tissue = table.greys(false);
  step.within = table.mask_or_none("within");
  step.local_mm = table.number("local_mm", positive).value_or(step.local_mm);
  step.degree = table.whole_number("degree", 0, 4).value_or(step.degree);
  step.level = table.grey("level", step.level, positive);
  return step;
}

Step read_smooth(const StepTable& table) {
  using Kind = Smooth::Kind;
  Smooth step;
  step.kind = table.required_choice<Kind>("kind", {{"median", Kind::median}, {"gaussian", Kind::gaussian}});
  step.radius_mm = table.required_number("radius_mm", positive);
  return step;
}

}  // namespace supine::segmentation
