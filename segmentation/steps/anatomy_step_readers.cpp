// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/format.h>

#include "segmentation/steps/step_readers.h"

namespace supine::segmentation {
namespace {

Planes::Plane read_plane(const StepTable& table, const std::string& name, int axis) {
  Planes::Plane plane;
  plane.at_mm = table.coordinate(name + "_mm", axis);
  plane.offset_mm = table.coordinate(name + "_offset_mm", axis).value_or(0);
  if (plane.at_mm && plane.offset_mm != 0)
    table.fail(name + "_offset_mm", fmt::format("has no effect beside {}_mm; leave one of them out", name));
  return plane;
}

}  // namespace

Step read_body(const StepTable& table) {
  Body step;
  step.mask = table.required_text("mask");
  step.lower = table.grey("lower", 0, positive);
  step.air = table.grey("air", 0, positive);
  if (step.lower > 0 && step.air > step.lower)
    table.fail("air", fmt::format("must not be above lower = {}", step.lower));
  step.edge_share = table.grey("edge_share", 0, {.lower = 0, .upper = 0.9});
  step.gap_mm = table.number("gap_mm", not_negative).value_or(step.gap_mm);
  step.peel_mm = table.number("peel_mm", positive).value_or(step.peel_mm);
  step.open_mm = table.number("open_mm", not_negative).value_or(step.open_mm);
  return step;
}

Step read_chest(const StepTable& table) {
  using Border = ChestWallOptions::Border;
  Chest step;
  step.mask = table.required_text("mask");
  step.body = table.required_text("body");
  step.sternum_mm = table.coordinate("sternum_mm", 0);
  ChestWallOptions& o = step.options;
  o.border = table.choice<Border>("border", {{"step", Border::step}, {"line", Border::line}}).value_or(o.border);
  o.dark = table.grey("dark", o.dark);
  o.bright = table.grey("bright", o.bright);
  if (!(o.bright > o.dark)) table.fail("bright", fmt::format("must be above dark = {}", o.dark));
  o.band_mm = table.number("band_mm", positive).value_or(o.band_mm);
  o.centre_depth_mm = table.number("centre_depth_mm", positive).value_or(o.centre_depth_mm);
  o.stiffness_per_mm = table.number("stiffness_per_mm", positive).value_or(o.stiffness_per_mm);
  o.coupling_per_mm = table.number("coupling_per_mm", not_negative).value_or(o.coupling_per_mm);
  o.far_weight = table.number("far_weight", not_negative).value_or(o.far_weight);
  o.oval_pull_per_mm = table.number("oval_pull_per_mm", not_negative).value_or(o.oval_pull_per_mm);
  o.ahead_mm = table.number("ahead_mm", not_negative).value_or(o.ahead_mm);
  o.ahead_cost_per_mm = table.number("ahead_cost_per_mm", not_negative).value_or(o.ahead_cost_per_mm);
  o.refine_mm = table.number("refine_mm", not_negative).value_or(o.refine_mm);
  return step;
}

Step read_planes(const StepTable& table) {
  using Side = Planes::Side;
  Planes step;
  step.mask = table.required_text("mask");
  step.body = table.required_text("body");
  step.chest = table.required_text("chest");
  step.left = table.mask_or_none("left");
  step.right = table.mask_or_none("right");
  step.sternum = read_plane(table, "sternum", 0);
  step.mid_axillary = read_plane(table, "mid_axillary", 1);
  step.inframammary = read_plane(table, "inframammary", 2);
  step.superior = read_plane(table, "superior", 2);
  using Ends = Planes::Ends;
  step.ends = table.choice<Ends>("ends", {{"anatomy", Ends::anatomy}, {"reader", Ends::reader}}).value_or(step.ends);
  step.side = table.choice<Side>("side", {{"both", Side::both}, {"left", Side::left}, {"right", Side::right}});
  return step;
}

Step read_gland(const StepTable& table) {
  using Contrast = GlandOptions::Contrast;
  Gland step;
  step.mask = table.required_text("mask");
  step.body = table.required_text("body");
  step.breast = table.required_text("breast");
  step.chest = table.required_text("chest");
  GlandOptions& o = step.options;
  o.contrast = table.required_choice<Contrast>("contrast", {{"dark", Contrast::dark}, {"bright", Contrast::bright}});
  o.second = table.choice<Contrast>("second", {{"dark", Contrast::dark}, {"bright", Contrast::bright}});
  o.shading_mm = table.number("shading_mm", positive).value_or(o.shading_mm);
  o.neighbourhood = table.number("neighbourhood", not_negative).value_or(o.neighbourhood);
  o.skin_mm = table.number("skin_mm", positive).value_or(o.skin_mm);
  o.chest_mm = table.number("chest_mm", not_negative).value_or(o.chest_mm);
  o.superficial_mm = table.number("superficial_mm", not_negative).value_or(o.superficial_mm);
  o.fan_deg = table.number("fan_deg", {.lower = 10, .upper = 180}).value_or(o.fan_deg);
  o.bridge_mm = table.number("bridge_mm", not_negative).value_or(o.bridge_mm);
  o.least_ml = table.number("least_ml", not_negative).value_or(o.least_ml);
  o.least_share = table.number("least_share", {.lower = 0, .upper = 0.99}).value_or(o.least_share);
  o.least_deviations = table.number("least_deviations", not_negative).value_or(o.least_deviations);
  o.gap_mm = table.number("gap_mm", not_negative).value_or(o.gap_mm);
  o.failed_share = table.number("failed_share", {.lower = 1.1}).value_or(o.failed_share);
  o.find_fat_shift = table.choice<bool>("fat_shift", {{"find", true}, {"none", false}}).value_or(o.find_fat_shift);
  return step;
}

}  // namespace supine::segmentation
