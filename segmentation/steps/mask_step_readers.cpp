// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/steps/step_readers.h"

namespace supine::segmentation {
namespace {

constexpr double least_axis = 1e-9;  // length of a direction that is taken for zero
constexpr int most_islands = 1'000'000;

}  // namespace

Step read_islands(const StepTable& table) {
  Islands step;
  step.mask = table.required_text("mask");
  step.keep_largest = table.whole_number("keep_largest", 0, most_islands).value_or(0);
  step.min_ml = table.number("min_ml", not_negative).value_or(0);
  if (step.keep_largest == 0 && step.min_ml == 0)
    table.fail("keep_largest", "is missing; give keep_largest (number), min_ml or both, above 0");
  return step;
}

Step read_holes(const StepTable& table) {
  Holes step;
  step.mask = table.required_text("mask");
  step.max_ml = table.number("max_ml", positive).value_or(step.max_ml);
  return step;
}

Step read_combine(const StepTable& table) {
  Combine step{table.required_text("mask"), table.masks("any"), table.masks("without")};
  if (step.any.empty() && step.without.empty()) table.fail("any", "is missing; give masks in any, without or both");
  return step;
}

Step read_morph(const StepTable& table) {
  using Kind = Morph::Kind;
  Morph step;
  step.mask = table.required_text("mask");
  step.kind = table.required_choice<Kind>(
      "kind", {{"dilate", Kind::dilate}, {"erode", Kind::erode}, {"open", Kind::open}, {"close", Kind::close}});
  step.radius_mm = table.required_number("radius_mm", positive);
  return step;
}

Step read_layer(const StepTable& table) {
  return Layer{table.required_text("mask"), table.required_text("of"), table.required_number("thickness_mm", positive)};
}

Step read_region(const StepTable& table) {
  using Shape = Region::Shape;
  Region step;
  step.mask = table.required_text("mask");
  step.shape = table.required_choice<Shape>(
      "shape",
      {{"cylinder", Shape::cylinder}, {"sphere", Shape::sphere}, {"box", Shape::box}, {"halfspace", Shape::halfspace}});
  step.centre_mm = table.place("centre_mm");
  if (step.shape == Shape::cylinder || step.shape == Shape::halfspace) {
    step.axis = table.place("axis");
    if (step.axis.norm() < least_axis) table.fail("axis", "must not be zero");
  }
  if (step.shape == Shape::cylinder || step.shape == Shape::sphere)
    step.radius_mm = table.required_number("radius_mm", positive);
  if (step.shape == Shape::box) {
    table.require("half_mm");
    step.half_mm = *table.vector("half_mm");  // lengths: no frame
    if (!(step.half_mm.minCoeff() > 0)) table.fail("half_mm", "must be > 0, each half side");
  }
  return step;
}

Step read_paint(const StepTable& table) {
  Paint step;
  step.mask = table.required_text("mask");
  step.tissue = table.tissue("tissue", table.required_text("tissue"));
  for (const auto& name : table.masks("over")) step.over.push_back(table.tissue("over", name));
  return step;
}

}  // namespace supine::segmentation
