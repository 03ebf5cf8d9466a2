// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/steps/step_readers.h"

namespace supine::segmentation {

Step read_threshold(const StepTable& table) {
  return Threshold{table.required_text("mask"), table.greys(true), table.mask_or_none("within")};
}

Step read_otsu(const StepTable& table) {
  Otsu step;
  step.mask = table.required_text("mask");
  step.within = table.mask_or_none("within");
  step.classes = table.whole_number("classes", 2, 8).value_or(step.classes);
  step.first = table.whole_number("first", 1, step.classes).value_or(step.classes);
  step.last = table.whole_number("last", step.first, step.classes).value_or(step.classes);
  return step;
}

Step read_grow(const StepTable& table) {
  Grow step;
  step.mask = table.required_text("mask");
  step.seeds_mm = table.places("seeds_mm");
  const bool confidence = table.has("multiplier");
  step.grey = table.greys(!confidence);
  step.within = table.mask_or_none("within");
  Grow::Confidence options;
  options.multiplier = table.number("multiplier", positive).value_or(options.multiplier);
  options.iterations = table.whole_number("iterations", 0, 50).value_or(options.iterations);
  options.radius_mm = table.number("radius_mm", positive).value_or(options.radius_mm);
  if (confidence) step.confidence = options;
  return step;
}

Step read_march(const StepTable& table) {
  using Speed = March::Speed;
  March step;
  step.mask = table.required_text("mask");
  step.seeds_mm = table.places("seeds_mm");
  step.speed = table.required_choice<Speed>("speed", {{"gradient", Speed::gradient}, {"greys", Speed::greys}});
  if (step.speed == Speed::gradient) {
    step.sigma_mm = table.number("sigma_mm", not_negative).value_or(step.sigma_mm);
    step.half_per_mm = table.required_number("half_per_mm", positive);
  } else {
    step.mean = table.required_number("mean");
    step.sd = table.required_number("sd", positive);
  }
  step.stop_mm = table.required_number("stop_mm", positive);
  step.order = table.whole_number("order", 1, 2).value_or(step.order);
  step.within = table.mask_or_none("within");
  return step;
}

}  // namespace supine::segmentation
