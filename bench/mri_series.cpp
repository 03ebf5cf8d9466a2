// SPDX-License-Identifier: AGPL-3.0-or-later
// Made series of drawn torsos through the automatic recipes, against what they were made of.
//   bench_mri_series t1|fatsat|t2|both|second FIRST COUNT [FOLDER [GLAND]]
//     a row per seed, then medians; both: T1, the fat-suppressed one beside it; second: the fat-suppressed one, T1
//     beside it; GLAND: a labelled breast whose gland they carry (breastPhantom). What misses an aim is drawn in
//     FOLDER: four slices with what was found, under them the same with what is there
//   bench_mri_series planted SEED                        planted failures and what is said
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <optional>
#include <random>
#include <string>

#include "common/error.h"
#include "phantom/mri/anatomy.h"
#include "phantom/mri/series.h"
#include "segmentation/formats/image_io.h"
#include "segmentation/label_map.h"
#include "segmentation/overlay.h"
#include "segmentation/steps/recipe_toml.h"
#include "segmentation/steps/run_recipe.h"

using namespace supine;
using segmentation::Mask;

namespace {

struct Score {
  double breast = 0, gland = 0, breast_hd95 = 0, gland_hd95 = 0, breast_ml = 0, true_breast_ml = 0, gland_ml = 0,
         true_gland_ml = 0, share_ml = 0, gland_but_ligaments = 0, wall_median = 0, wall_95 = 0;
  std::size_t doubts = 0;
};

double dice(const Mask& a, const Mask& b) {
  std::size_t both = 0, sum = 0;
  for (std::size_t n = 0; n < a.size(); ++n) {
    both += a[n] && b[n];
    sum += a[n] + b[n];
  }
  return sum > 0 ? 2.0 * static_cast<double>(both) / static_cast<double>(sum) : 1;
}

double percentile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

/// 95 % of the distances from the border voxels of either mask to the other mask's.
double hausdorff95(const Mask& a, const Mask& b, const segmentation::Grid& grid) {
  const auto border = [&grid](const Mask& mask) {
    Mask rim = segmentation::erode(mask, grid, grid.spacing_mm.maxCoeff() * 1.01);
    for (std::size_t n = 0; n < rim.size(); ++n) rim[n] = mask[n] && !rim[n];
    return rim;
  };
  const Mask rim_a = border(a), rim_b = border(b);
  const auto to_a = segmentation::squared_distance_mm2(rim_a, grid),
             to_b = segmentation::squared_distance_mm2(rim_b, grid);
  std::vector<double> distances;
  for (std::size_t n = 0; n < a.size(); ++n) {
    if (rim_a[n] && std::isfinite(to_b[n])) distances.push_back(std::sqrt(to_b[n]));
    if (rim_b[n] && std::isfinite(to_a[n])) distances.push_back(std::sqrt(to_a[n]));
  }
  return percentile(std::move(distances), 0.95);
}

double ml(const Mask& mask, const segmentation::Grid& grid) {
  return static_cast<double>(std::count(mask.begin(), mask.end(), 1)) * grid.voxel_volume_mm3() / 1000;
}

/// Where a ray from inside the chest leaves it.
double true_radius_mm(const phantom::Torso& torso, const Eigen::Vector3d& centre, const Eigen::Vector3d& direction) {
  constexpr double step_mm = 0.1, farthest_mm = 250;
  double radius = 0;
  for (; radius < farthest_mm; radius += step_mm) {
    const Eigen::Vector3d p = centre + radius * direction;
    if (p.y() < torso.chest_y_mm(p.x(), p.z())) break;
  }
  return radius;
}

/// Whether a ligament passes through a voxel: where fat is bright it is as dark as gland.
bool holds_ligament(const phantom::Torso& torso, const segmentation::Grid& grid, int i, int j, int k) {
  constexpr int finer = 3;
  for (int n = 0; n < finer * finer * finer; ++n) {
    const Eigen::Array3d part(n % finer, n / finer % finer, n / finer / finer);
    const Eigen::Vector3d p = grid.point(Eigen::Vector3d(i, j, k).array() - 0.5 + (part + 0.5) / finer);
    if (p.y() < torso.chest_y_mm(p.x(), p.z()) && torso.is_collagen(p)) return true;
  }
  return false;
}

/// Between the levels of the breasts and in front of a reader's end: there truth and result mean the same.
bool is_compared(const phantom::Torso& torso, const Eigen::Vector3d& p) {
  return p.z() >= torso.low_z_mm() && p.z() <= torso.high_z_mm() && p.y() <= torso.back_y_mm() - 10;
}

/// What is there, as a tissue that a recipe labels.
segmentation::Tissue true_tissue(std::uint8_t stuff) {
  switch (static_cast<phantom::Stuff>(stuff)) {
    case phantom::Stuff::gland:
      return segmentation::Tissue::gland;
    case phantom::Stuff::fat:
    case phantom::Stuff::skin:
    case phantom::Stuff::vessel:
      return segmentation::Tissue::adipose;
    default:
      return segmentation::Tissue::air;
  }
}

Score score(const phantom::Torso& torso, const phantom::MadeSeries& made, const segmentation::RecipeResult& result) {
  const segmentation::Grid& grid = made.image.grid;
  const std::size_t count = grid.count();
  Mask breast(count), gland(count), true_breast(count), true_gland(count), ligament(count);
  Score s;
  for (int k = 0; k < grid.size.z(); ++k)
    for (int j = 0; j < grid.size.y(); ++j)
      for (int i = 0; i < grid.size.x(); ++i) {
        const std::size_t n = grid.index(i, j, k);
        const Eigen::Vector3d p = grid.point(Eigen::Vector3d(i, j, k));
        if (!is_compared(torso, p)) continue;
        const segmentation::Tissue is = true_tissue(made.truth.voxels[n]);
        true_gland[n] = is == segmentation::Tissue::gland;
        true_breast[n] = is != segmentation::Tissue::air;
        const auto tissue = static_cast<segmentation::Tissue>(result.labels.voxels[n]);
        gland[n] = tissue == segmentation::Tissue::gland;
        ligament[n] = gland[n] && !true_gland[n] && holds_ligament(torso, grid, i, j, k);
        breast[n] = segmentation::is_meshed(tissue);
        if (!result.fraction_gland.empty()) s.share_ml += result.fraction_gland[n] * grid.voxel_volume_mm3() / 1000;
      }
  s.breast = dice(breast, true_breast);
  s.gland = dice(gland, true_gland);
  s.breast_hd95 = hausdorff95(breast, true_breast, grid);
  s.gland_hd95 = hausdorff95(gland, true_gland, grid);
  s.breast_ml = ml(breast, grid);
  s.true_breast_ml = ml(true_breast, grid);
  s.gland_ml = ml(gland, grid);
  s.true_gland_ml = ml(true_gland, grid);
  for (std::size_t n = 0; n < count; ++n) gland[n] = gland[n] && !ligament[n];
  s.gland_but_ligaments = dice(gland, true_gland);
  s.doubts = result.doubts.size();
  std::vector<double> off;
  const segmentation::ChestWall& wall = result.walls.back();
  for (Eigen::Index k = 0; k < wall.radius_mm.cols(); ++k)
    for (Eigen::Index a = 0; a < wall.radius_mm.rows(); ++a) {
      if (wall.z(k) < torso.low_z_mm() || wall.z(k) > torso.high_z_mm()) continue;
      const Eigen::Vector3d centre = wall.centre(k), direction = wall.direction(a);
      const double true_mm = true_radius_mm(torso, centre, direction);
      const Eigen::Vector3d there = centre + true_mm * direction;
      if (std::abs(there.x()) > 110 || there.y() > torso.back_y_mm() - 10) continue;
      off.push_back(std::abs(wall.radius_mm(a, k) - true_mm));
    }
  s.wall_median = percentile(off, 0.5);
  s.wall_95 = percentile(off, 0.95);
  return s;
}

segmentation::RecipeResult segment(const segmentation::GreyImage& image, bool fat_bright,
                                   std::optional<segmentation::GreyImage> second = {}) {
  return segmentation::run_recipe(image, segmentation::read_shipped_recipe(fat_bright ? "t1_auto" : "fatsat_auto"), {},
                                  std::move(second));
}

/// Another series of the same visit: voxels, noise and ghosts of its own, and she has moved by some mm.
segmentation::GreyImage beside(const phantom::Torso& torso, std::uint64_t seed, phantom::Series series) {
  constexpr std::uint64_t other_noise = 1000003;
  constexpr double most_mm = 3;
  auto image = phantom::make_series(torso, seed + other_noise, {.series = series}).image;
  std::mt19937_64 generator(seed);
  std::uniform_real_distribution<double> along(-most_mm, most_mm);
  for (double& mm : image.grid.origin_mm) mm += along(generator);
  return image;
}

/// The levels of the breasts alone: both rows of a picture then show the same slices.
template <class Voxel>
std::vector<Voxel> levels(const std::vector<Voxel>& voxels, const segmentation::Grid& grid, int first, int last) {
  const auto slice = static_cast<std::ptrdiff_t>(grid.index(0, 0, 1));
  return {voxels.begin() + first * slice, voxels.begin() + (last + 1) * slice};
}

/// Four slices with what was found, under them the same with what is there.
void draw(const phantom::Torso& torso, const phantom::MadeSeries& made, const std::vector<std::uint8_t>& found,
          const std::string& file) {
  const segmentation::Grid& grid = made.image.grid;
  std::vector<std::uint8_t> truth(found.size()), labels = found;
  for (int k = 0; k < grid.size.z(); ++k)
    for (int j = 0; j < grid.size.y(); ++j)
      for (int i = 0; i < grid.size.x(); ++i) {
        const std::size_t n = grid.index(i, j, k);
        if (is_compared(torso, grid.point(Eigen::Vector3d(i, j, k))))
          truth[n] = static_cast<std::uint8_t>(true_tissue(made.truth.voxels[n]));
        else
          labels[n] = 0;
      }
  const auto shows = [&grid](const std::vector<std::uint8_t>& tissues, int from, int to) {
    const std::vector<std::uint8_t> part = levels(tissues, grid, from, to);
    return std::any_of(part.begin(), part.end(), [](std::uint8_t tissue) { return tissue != 0; });
  };
  int first = 0, last = grid.size.z() - 1;
  const bool refused = !shows(labels, first, last);
  const auto is_drawn = [&](int k) { return shows(truth, k, k) && (refused || shows(labels, k, k)); };
  while (first < last && !is_drawn(first)) ++first;
  while (last > first && !is_drawn(last)) --last;
  segmentation::GreyImage grey{grid, levels(made.image.voxels, grid, first, last)};
  grey.grid.size.z() = last - first + 1;
  grey.grid.origin_mm = grid.point(Eigen::Vector3d(0, 0, first));
  segmentation::Picture picture;
  for (const auto* shown : {&labels, &truth}) {
    std::vector<double> places;
    const segmentation::Picture row =
        segmentation::overlay({grey.grid, levels(*shown, grid, first, last)}, &grey, 2, {1, 4, 4}, places);
    picture.width = row.width;
    picture.height += row.height;
    picture.rgb.insert(picture.rgb.end(), row.rgb.begin(), row.rgb.end());
  }
  segmentation::write_png(picture, file);
}

struct Wanted {
  phantom::Series series = phantom::Series::t1;
  std::optional<phantom::Series> second;
  std::uint64_t first = 1, count = 1;
  std::string folder;
  std::shared_ptr<const phantom::Anatomy> gland;
};

int table(const Wanted& wanted) {
  std::vector<double> breast, gland, volume, wall, wall95, breast95, gland95;
  fmt::print(
      "| seed | breast Dice | HD95 mm | ml (true) | gland Dice | without ligaments | HD95 mm | ml (true), by share | "
      "wall median / 95 % mm "
      "| doubts |\n"
      "|---|---|---|---|---|---|---|---|---|---|\n");
  int failed = 0;
  for (std::uint64_t seed = wanted.first; seed < wanted.first + wanted.count; ++seed) {
    phantom::Torso torso(seed);
    if (wanted.gland) torso.carry(wanted.gland);
    const phantom::MadeSeries made = phantom::make_series(torso, seed, {.series = wanted.series});
    try {
      std::optional<segmentation::GreyImage> second;
      if (wanted.second) second = beside(torso, seed, *wanted.second);
      const auto result = segment(made.image, wanted.series == phantom::Series::t1, std::move(second));
      const Score s = score(torso, made, result);
      fmt::print(
          "| {} | {:.3f} | {:.1f} | {:.0f} ({:.0f}) | {:.3f} | {:.3f} | {:.1f} | {:.0f} ({:.0f}), {:.0f} | {:.1f} / "
          "{:.1f} "
          "| {} |\n",
          seed, s.breast, s.breast_hd95, s.breast_ml, s.true_breast_ml, s.gland, s.gland_but_ligaments, s.gland_hd95,
          s.gland_ml, s.true_gland_ml, s.share_ml, s.wall_median, s.wall_95, s.doubts);
      breast.push_back(s.breast);
      gland.push_back(s.gland);
      breast95.push_back(s.breast_hd95);
      gland95.push_back(s.gland_hd95);
      wall.push_back(s.wall_median);
      wall95.push_back(s.wall_95);
      if (s.true_gland_ml > 0) volume.push_back(s.gland_ml / s.true_gland_ml);
      if (!wanted.folder.empty() && (s.breast < 0.95 || s.gland < 0.75 || s.wall_median > 3 || s.wall_95 > 8))
        draw(torso, made, result.labels.voxels, fmt::format("{}/{}.png", wanted.folder, seed));
    } catch (const InputError& error) {
      ++failed;
      fmt::print("| {} | refused: {} |\n", seed, error.what());
      if (!wanted.folder.empty())
        draw(torso, made, std::vector<std::uint8_t>(made.truth.voxels.size(), 0),
             fmt::format("{}/{}_refused.png", wanted.folder, seed));
    }
    std::fflush(stdout);
  }
  fmt::print("| median | {:.3f} | {:.1f} | | {:.3f} | | {:.1f} | × {:.2f} | {:.1f} / {:.1f} | |\n",
             percentile(breast, 0.5), percentile(breast95, 0.5), percentile(gland, 0.5), percentile(gland95, 0.5),
             percentile(volume, 0.5), percentile(wall, 0.5), percentile(wall95, 0.5));
  fmt::print("| worst tenth | {:.3f} | {:.1f} | | {:.3f} | | {:.1f} | × {:.2f} | {:.1f} / {:.1f} | {} refused |\n",
             percentile(breast, 0.1), percentile(breast95, 0.9), percentile(gland, 0.1), percentile(gland95, 0.9),
             percentile(volume, 0.1), percentile(wall, 0.9), percentile(wall95, 0.9), failed);
  return 0;
}

/// With the truth of an image that ends at exit 0 or 1, how right it is all the same.
void plant(const char* what, const segmentation::GreyImage& image, bool fat_bright, const phantom::Torso* torso = {},
           const segmentation::LabelImage* truth = {}) {
  try {
    const auto result = segment(image, fat_bright);
    std::string said;
    for (const auto& doubt : result.doubts) said += fmt::format("{}{}", said.empty() ? "" : "; ", doubt.what);
    if (said.empty()) said = "nothing";
    if (torso) said += fmt::format(" (breast Dice {:.3f})", score(*torso, {image, *truth, {}}, result).breast);
    fmt::print("| {} | {} | {} |\n", what, result.doubts.empty() ? 0 : 1, said);
  } catch (const InputError& error) {
    fmt::print("| {} | 2 | {} |\n", what, error.what());
  }
  std::fflush(stdout);
}

/// The half of an image on one side of x = 0, less an edge.
segmentation::GreyImage half_of(const segmentation::GreyImage& image, double from_x_mm, double to_x_mm) {
  segmentation::GreyImage part{image.grid, {}};
  const int low = std::max(0, static_cast<int>(image.grid.continuous_index({from_x_mm, 0, 0}).x())),
            high =
                std::min(image.grid.size.x() - 1, static_cast<int>(image.grid.continuous_index({to_x_mm, 0, 0}).x()));
  part.grid.size.x() = high - low + 1;
  part.grid.origin_mm = image.grid.point(Eigen::Vector3d(low, 0, 0));
  for (int k = 0; k < image.grid.size.z(); ++k)
    for (int j = 0; j < image.grid.size.y(); ++j)
      for (int i = low; i <= high; ++i) part.voxels.push_back(image.at(i, j, k));
  return part;
}

/// An image with a bright plate between two depths.
segmentation::GreyImage with_plate(segmentation::GreyImage image, double from_y_mm, double to_y_mm) {
  const segmentation::Grid& grid = image.grid;
  for (int k = 0; k < grid.size.z(); ++k)
    for (int j = 0; j < grid.size.y(); ++j)
      for (int i = 0; i < grid.size.x(); ++i) {
        const Eigen::Vector3d p = grid.point(Eigen::Vector3d(i, j, k));
        if (p.y() > from_y_mm && p.y() < to_y_mm && std::abs(p.x()) < 150) image.at(i, j, k) += 400;
      }
  return image;
}

int planted(std::uint64_t seed) {
  using phantom::Series;
  const phantom::Torso torso(seed);
  const auto image = [&](const phantom::SeriesOptions& options) {
    return phantom::make_series(torso, seed, options).image;
  };
  fmt::print("| planted | exit | said |\n|---|---|---|\n");
  const segmentation::GreyImage t1 = image({}), fatsat = image({.series = Series::fatsat});
  plant("none, T1", t1, true);
  plant("none, fat-suppressed", fatsat, false);
  plant("fat-suppressed for T1", fatsat, true);
  plant("T1 for fat-suppressed", t1, false);
  const segmentation::GreyImage t2 = image({.series = Series::t2});
  plant("T2 for T1", t2, true);
  plant("T2 for fat-suppressed T1", t2, false);
  plant("no suppression at all", image({.series = Series::fatsat, .all_fails = true}), false);
  plant("inverted contrast", image({.inverted = true}), true);
  plant("upside down", image({.upside_down = true}), true);
  const double cut = torso.nipple_mm(1).x();
  plant("half a breast (the image ends in it)", half_of(t1, -300, cut), true);
  plant("one breast in the image", half_of(t1, 5, 300), true);
  phantom::Torso lone(seed);
  lone.remove(0);
  plant("one breast absent", phantom::make_series(lone, seed, {}).image, true);
  const phantom::MadeSeries clean = phantom::make_series(torso, seed, {});
  const double tip = torso.nipple_mm(0).y();
  plant("table in the body (a bright plate through the nipples)", with_plate(t1, tip - 2, tip + 10), true, &torso,
        &clean.truth);
  plant("table that the breasts lie on, as bright as they are", with_plate(t1, tip - 22, tip + 6), true, &torso,
        &clean.truth);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc >= 3 && std::strcmp(argv[1], "planted") == 0) return planted(std::strtoull(argv[2], nullptr, 10));
  if (argc < 4) {
    fmt::print(stderr, "bench_mri_series t1|fatsat|t2|both|second FIRST COUNT [FOLDER [GLAND]], or planted SEED\n");
    return 2;
  }
  using phantom::Series;
  const std::string kind = argv[1];
  Wanted wanted;
  wanted.first = std::strtoull(argv[2], nullptr, 10);
  wanted.count = std::strtoull(argv[3], nullptr, 10);
  wanted.series = kind == "t1" || kind == "both" ? Series::t1 : kind == "t2" ? Series::t2 : Series::fatsat;
  if (kind == "both") wanted.second = Series::fatsat;
  if (kind == "second") wanted.second = Series::t1;
  if (argc > 4) wanted.folder = argv[4];
  if (argc > 5) wanted.gland = std::make_shared<phantom::Anatomy>(segmentation::read_image(argv[5], "LPS").image);
  return table(wanted);
}
