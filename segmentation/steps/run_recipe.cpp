// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/steps/run_recipe.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "common/error.h"
#include "segmentation/chest/leaks.h"
#include "segmentation/fronts/fast_marching.h"
#include "segmentation/masks.h"
#include "segmentation/steps/body.h"
#include "segmentation/steps/grow.h"
#include "segmentation/steps/intensity.h"
#include "segmentation/steps/otsu.h"

namespace supine::segmentation {
namespace {

constexpr double flank_mm = 15;  // no gland lies so near to where the chest turns to the side
// So that a bound of a whole number of voxels includes it.
constexpr double rounding = 1e-9;

/// The state the steps share; one overload of run per kind of step, which returns its line of the log.
class StepRunner {
 public:
  StepRunner(GreyImage image, std::optional<GreyImage> second)
      : image_(std::move(image)),
        second_(std::move(second)),
        labels_{image_.grid, std::vector<std::uint8_t>(image_.voxels.size(), 0)} {
    if (second_) remove_noise_floor(*second_, NoiseFloor{});
  }

  std::string run(const NoiseFloor& step) {
    return fmt::format("noise sigma {:.4g}", remove_noise_floor(image_, step));
  }
  std::string run(const Bias& step) {
    const BiasFit fit = correct_bias(image_, step, within(step.within));
    return fmt::format("shading {:.3f} to {:.3f}, residual sd {:.3f} over {} voxels", fit.lowest, fit.highest,
                       fit.residual_sd, fit.voxels);
  }
  std::string run(const Smooth& step) {
    smooth(image_, step);
    return fmt::format("{:g} mm", step.radius_mm);
  }
  std::string run(const Threshold& step);
  std::string run(const Grow& step);
  std::string run(const Islands& step) {
    return store(step.mask, keep_islands(mask(step.mask), grid(), static_cast<std::size_t>(step.keep_largest),
                                         voxels(step.min_ml) * (1 - rounding)));
  }
  std::string run(const Holes& step) {
    return store(step.mask, fill_holes(mask(step.mask), grid(), voxels(step.max_ml) * (1 + rounding)));
  }
  std::string run(const Combine& step);
  std::string run(const Morph& step);
  std::string run(const Layer& step);
  std::string run(const Region& step);
  std::string run(const Paint& step);
  std::string run(const Body& step) { return store(step.mask, find_body(image_, step)); }
  std::string run(const Chest& step);
  std::string run(const Planes& step);
  std::string run(const Otsu& step);
  std::string run(const March& step);
  std::string run(const Gland& step);

  const std::vector<CutPlane>& planes() const { return planes_; }
  std::vector<ChestWall> take_walls() {
    std::vector<ChestWall> walls;
    for (auto& [name, wall] : walls_) walls.push_back(std::move(wall));
    return walls;
  }
  const LabelImage& labels() const { return labels_; }
  const ChestWall& last_wall() const { return walls_.at(last_wall_); }
  std::vector<float> take_fraction() { return std::move(fraction_); }
  LabelImage take_labels() { return std::move(labels_); }

 private:
  const Grid& grid() const { return image_.grid; }
  double voxels(double ml) const { return ml * 1000 / grid().voxel_volume_mm3(); }
  const Mask& mask(const std::string& name) const;
  Mask within(const std::string& name) const { return name.empty() ? Mask() : mask(name); }
  std::string store(const std::string& name, Mask mask);

  GreyImage image_;
  std::optional<GreyImage> second_;
  LabelImage labels_;
  std::map<std::string, Mask> masks_;
  std::map<std::string, ChestWall> walls_;
  std::string last_wall_;
  std::vector<CutPlane> planes_;
  std::vector<float> fraction_;
};

const Mask& StepRunner::mask(const std::string& name) const {
  const auto found = masks_.find(name);
  if (found != masks_.end()) return found->second;
  std::string known;
  for (const auto& [other, voxels] : masks_) known += fmt::format("{}\"{}\"", known.empty() ? "" : ", ", other);
  throw InputError(
      fmt::format("no earlier step made the mask \"{}\"; there are {}", name, known.empty() ? "none" : known));
}

std::string StepRunner::store(const std::string& name, Mask mask) {
  const auto count = static_cast<std::size_t>(std::count(mask.begin(), mask.end(), 1));
  if (count == 0)
    throw InputError(
        fmt::format("the mask \"{}\" comes out empty; check the greys, seeds and places of this step", name));
  masks_[name] = std::move(mask);
  return fmt::format("{}: {} voxels, {:.1f} ml", name, count,
                     static_cast<double>(count) * grid().voxel_volume_mm3() / 1000);
}

std::string StepRunner::run(const Threshold& step) {
  Mask result = step.within.empty() ? Mask(image_.voxels.size(), 1) : mask(step.within);
  for (std::size_t n = 0; n < result.size(); ++n) result[n] = result[n] && step.grey.contains(image_.voxels[n]);
  return store(step.mask, std::move(result));
}

std::string StepRunner::run(const Grow& step) {
  GrowResult grown = grow(image_, step, within(step.within));
  return store(step.mask, std::move(grown.mask)) +
         fmt::format(", greys {:.4g} to {:.4g}", grown.range.lower, grown.range.upper);
}

std::string StepRunner::run(const Otsu& step) {
  Mask result = step.within.empty() ? Mask(image_.voxels.size(), 1) : mask(step.within);
  std::vector<float> greys;
  for (std::size_t n = 0; n < result.size(); ++n)
    if (result[n]) greys.push_back(image_.voxels[n]);
  const std::vector<double> levels = otsu_levels(greys, step.classes);
  GreyRange range;
  if (step.first > 1) range.lower = static_cast<float>(levels[step.first - 2]);
  if (step.last < step.classes) range.upper = std::nextafter(static_cast<float>(levels[step.last - 1]), -INFINITY);
  for (std::size_t n = 0; n < result.size(); ++n) result[n] = result[n] && range.contains(image_.voxels[n]);
  return store(step.mask, std::move(result)) + fmt::format(", levels {:.4g}", fmt::join(levels, ", "));
}

std::string StepRunner::run(const March& step) {
  Image<float> speed = step.speed == March::Speed::gradient
                           ? speed_from_gradient(image_, step.sigma_mm, step.half_per_mm)
                           : speed_from_greys(image_, step.mean, step.sd);
  if (!step.within.empty()) {
    const Mask& inside = mask(step.within);
    for (std::size_t n = 0; n < inside.size(); ++n)
      if (!inside[n]) speed.voxels[n] = 0;
  }
  std::vector<FrontSource> sources;
  for (const Eigen::Vector3d& seed : step.seeds_mm) sources.push_back({seed});
  const Image<float> time = fast_march(speed, sources, {step.order, step.stop_mm});
  Mask reached(time.voxels.size());
  for (std::size_t n = 0; n < reached.size(); ++n) reached[n] = time.voxels[n] <= step.stop_mm;
  return store(step.mask, std::move(reached)) + fmt::format(" within {:g} mm of the front's way", step.stop_mm);
}

std::string StepRunner::run(const Combine& step) {
  Mask result(image_.voxels.size(), step.any.empty() ? 1 : 0);
  for (const auto& name : step.any) {
    const Mask& other = mask(name);
    for (std::size_t n = 0; n < result.size(); ++n) result[n] |= other[n];
  }
  for (const auto& name : step.without) {
    const Mask& other = mask(name);
    for (std::size_t n = 0; n < result.size(); ++n) result[n] = result[n] && !other[n];
  }
  return store(step.mask, std::move(result));
}

std::string StepRunner::run(const Morph& step) {
  const Mask& before = mask(step.mask);
  const double r = step.radius_mm;
  switch (step.kind) {
    case Morph::Kind::dilate:
      return store(step.mask, dilate(before, grid(), r));
    case Morph::Kind::erode:
      return store(step.mask, erode(before, grid(), r));
    case Morph::Kind::open:
      return store(step.mask, dilate(erode(before, grid(), r), grid(), r));
    default:
      return store(step.mask, erode(dilate(before, grid(), r), grid(), r));
  }
}

std::string StepRunner::run(const Layer& step) {
  Mask result = mask(step.of);
  const Mask core = erode(result, grid(), std::max(step.thickness_mm, grid().spacing_mm.minCoeff()));
  for (std::size_t n = 0; n < result.size(); ++n) result[n] = result[n] && !core[n];
  return store(step.mask, std::move(result));
}

bool inside(const Region& region, const Eigen::Vector3d& point) {
  const Eigen::Vector3d from = point - region.centre_mm, axis = region.axis.normalized();
  switch (region.shape) {
    case Region::Shape::cylinder:
      return (from - axis * axis.dot(from)).norm() <= region.radius_mm;
    case Region::Shape::sphere:
      return from.norm() <= region.radius_mm;
    case Region::Shape::box:
      return (from.cwiseAbs().array() <= region.half_mm.array()).all();
    default:
      return axis.dot(from) >= 0;
  }
}

std::string StepRunner::run(const Region& step) {
  Mask result(image_.voxels.size());
  const Eigen::Vector3i size = grid().size;
#pragma omp parallel for schedule(static)
  for (int k = 0; k < size.z(); ++k)
    for (int j = 0; j < size.y(); ++j)
      for (int i = 0; i < size.x(); ++i)
        result[grid().index(i, j, k)] = inside(step, grid().point(Eigen::Vector3d(i, j, k)));
  return store(step.mask, std::move(result));
}

std::string StepRunner::run(const Paint& step) {
  const Mask& where = mask(step.mask);
  std::size_t painted = 0;
  for (std::size_t n = 0; n < where.size(); ++n) {
    const auto old = static_cast<Tissue>(labels_.voxels[n]);
    if (!where[n] || (!step.over.empty() && std::find(step.over.begin(), step.over.end(), old) == step.over.end()))
      continue;
    labels_.voxels[n] = static_cast<std::uint8_t>(step.tissue);
    ++painted;
  }
  return fmt::format("{}: {} voxels", tissue_names[static_cast<int>(step.tissue)], painted);
}

std::string StepRunner::run(const Chest& step) {
  const Mask& body = mask(step.body);
  const Torso torso = find_torso(front_skin(body, grid()), step.sternum_mm);
  ChestWall wall = find_chest_wall(image_, body, torso, step.options);
  Mask chest(body.size(), 0);
  const Eigen::Vector3i size = grid().size;
#pragma omp parallel for schedule(static)
  for (int k = 0; k < size.z(); ++k)
    for (int j = 0; j < size.y(); ++j)
      for (int i = 0; i < size.x(); ++i) {
        const std::size_t n = grid().index(i, j, k);
        chest[n] = body[n] && wall.depth_mm(grid().point(Eigen::Vector3d(i, j, k))) >= 0;
      }
  const Superellipse shape = wall.superellipse;
  walls_[step.mask] = std::move(wall);
  last_wall_ = step.mask;
  return store(step.mask, std::move(chest)) +
         fmt::format(
             "; middle line x = {:.1f} {:+.3f} z mm from {} levels, skin over the sternum at y = {:.1f} mm; oval "
             "half width {:.0f}, depth {:.0f} {:+.1f} z mm, power {}{}",
             torso.sternum_x_mm, torso.sternum_slope, torso.slices, torso.sternum_skin_y_mm, shape.half_width_mm,
             shape.depth_mm, shape.depth_slope, shape.power,
             shape.plate_mm > 0 ? fmt::format(", on it muscle of {:.0f} mm as far as {:.0f} mm to either side",
                                              shape.plate_mm, shape.plate_edge_mm)
                                : "");
}

std::string StepRunner::run(const Planes& step) {
  const Mask& body = mask(step.body);
  const auto wall = walls_.find(step.chest);
  if (wall == walls_.end())
    throw InputError(fmt::format("\"{}\" is not the mask of an earlier step chest", step.chest));
  planes_ = find_planes(front_skin(body, grid()), wall->second, step);
  PlaneMasks masks = cut_by_planes(body, grid(), wall->second, planes_, step.side.value_or(Planes::Side::both));
  if (!step.left.empty()) store(step.left, std::move(masks.left));
  if (!step.right.empty()) store(step.right, std::move(masks.right));
  std::string line = store(step.mask, std::move(masks.model));
  for (const CutPlane& plane : planes_)
    line += fmt::format("; {} {} = {:.1f} mm{}", plane.name, plane.axis, plane.at_mm, plane.given ? " (given)" : "");
  return line;
}

std::string shift_words(const GlandResult& result) {
  if (result.fat_shift_mm)
    return fmt::format("; fat lies ({:.1f}, {:.1f}, {:.1f}) mm aside, gland was put back", result.fat_shift_mm->x(),
                       result.fat_shift_mm->y(), result.fat_shift_mm->z());
  if (!result.second) return {};
  const GlandResult::Second& second = *result.second;
  return fmt::format(
      "; second series, moved by ({:.1f}, {:.1f}, {:.1f}) mm: fat scatters by {:.0f} %, pure gland differs from it by "
      "{:.0f} %; in the first fat lies ({:.1f}, {:.1f}, {:.1f}) mm aside",
      second.shift_mm.x(), second.shift_mm.y(), second.shift_mm.z(), 100 * second.fat_sd, 100 * second.pure,
      second.fat_shift_mm.x(), second.fat_shift_mm.y(), second.fat_shift_mm.z());
}

std::string StepRunner::run(const Gland& step) {
  const auto found = walls_.find(step.chest);
  if (found == walls_.end())
    throw InputError(fmt::format("\"{}\" is not the mask of an earlier step chest", step.chest));
  const ChestWall& wall = found->second;
  const GlandPlace place{mask(step.body),
                         mask(step.breast),
                         mask(step.chest),
                         wall.torso.sternum_x(wall.z(wall.radius_mm.cols() / 2)),
                         wall.torso.sternum_skin_y_mm,
                         half_turn_y_mm(wall) - flank_mm};
  GlandResult result = find_gland(image_, place, step.options, second_ ? &*second_ : nullptr);
  fraction_ = std::move(result.fraction);
  const auto voxels = std::count(result.gland.begin(), result.gland.end(), 1);
  masks_[step.mask] = std::move(result.gland);  // may be empty: some breasts show none
  return fmt::format("{}: {} voxels, {:.1f} ml", step.mask, voxels,
                     static_cast<double>(voxels) * grid().voxel_volume_mm3() / 1000) +
         fmt::format(
             "; fat scatters by {:.0f} %, pure gland differs from it by {:.0f} %, shading {:.2f} to {:.2f}, "
             "suppression failed in {:.0f} ml, {:.0f} ml look like gland but lie elsewhere (behind y = {:.0f} mm, "
             "small, "
             "under the skin)",
             100 * result.fat_sd, 100 * result.pure, result.shading_low, result.shading_high, result.failed_ml,
             result.aside_ml, place.back_y_mm) +
         shift_words(result);
}

}  // namespace

void Recipe::set_side(Planes::Side side) {
  for (Step& step : steps)
    if (auto* planes = std::get_if<Planes>(&step); planes && !planes->side) planes->side = side;
}

namespace {

bool looks_at_second(const Step& step) {
  const auto* gland = std::get_if<Gland>(&step);
  return gland != nullptr && gland->options.second.has_value();
}

/// Where the image shows no border between breast and muscle, or two that do not fit, in front of the model's back.
std::vector<Doubt> doubts_of_wall(const RecipeResult& result) {
  double back_mm = std::numeric_limits<double>::infinity();
  for (const CutPlane& plane : result.planes)
    if (plane.name == "mid_axillary") back_mm = plane.at_mm;
  std::vector<Doubt> doubts;
  for (const ChestWall& wall : result.walls) {
    for (const Leak& leak : find_leaks(wall, back_mm)) doubts.push_back({describe(leak), leak.middle_mm});
    for (const Leak& patch : find_uneven(wall, back_mm)) doubts.push_back({describe_uneven(patch), patch.middle_mm});
  }
  return doubts;
}

}  // namespace

RecipeResult run_recipe(GreyImage image, const Recipe& recipe, const std::function<void(const std::string&)>& progress,
                        std::optional<GreyImage> second) {
  if (second && std::none_of(recipe.steps.begin(), recipe.steps.end(), looks_at_second))
    throw InputError(
        "there is a second series, but no gland step of the recipe has `second` (\"dark\" or \"bright\": what gland "
        "is beside fat in it)");
  const GreyImage given = recipe.fat_suppressed ? image : GreyImage();
  StepRunner runner(std::move(image), std::move(second));
  RecipeResult result;
  for (std::size_t s = 0; s < recipe.steps.size(); ++s) {
    const std::string title = fmt::format("step {} ({})", s + 1, step_names[recipe.steps[s].index()]);
    if (progress) progress(fmt::format("{} of {}", title, recipe.steps.size()));
    try {
      const auto line = std::visit([&runner](const auto& step) { return runner.run(step); }, recipe.steps[s]);
      result.log.push_back(title + ": " + line);
      if (recipe.fat_suppressed && std::holds_alternative<Chest>(recipe.steps[s]))
        require_kind({given, runner.labels(), runner.last_wall(), *recipe.fat_suppressed});
    } catch (const InputError& error) {
      throw InputError(fmt::format("segmentation recipe, {}: {}", title, error.what()));
    }
  }
  result.labels = runner.take_labels();
  result.fraction_gland = runner.take_fraction();
  result.planes = runner.planes();
  result.walls = runner.take_walls();
  if (recipe.fat_suppressed && !result.walls.empty()) {
    result.doubts = find_doubts({given, result.labels, result.walls.back(), *recipe.fat_suppressed});
    for (Doubt& doubt : doubts_of_wall(result)) result.doubts.push_back(std::move(doubt));
  }
  return result;
}

}  // namespace supine::segmentation
