// SPDX-License-Identifier: AGPL-3.0-or-later
#include "phantom/mri/series.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "phantom/random.h"

namespace supine::phantom {
namespace {

using Eigen::Vector3d;
using Greys = std::array<double, stuff_count>;

// Greys against the brightest tissue, of air, fat, gland, skin, muscle, organ, vessel, support. T1 and fatsat as in a
// series at 1.5 T (muscle 0.26 and 0.85 of fat, gland about 0.4 and 2.7 of it).
constexpr Greys t1_greys{0, 1, 0.38, 0.42, 0.26, 0.3, 0.22, 0.07},
    fatsat_greys{0, 0.37, 1, 1.05, 0.32, 0.36, 0.8, 0.06}, t2_greys{0, 0.16, 0.75, 0.3, 0.14, 0.35, 1, 0.06};
constexpr double collagen_grey = 0.05;  // hardly any signal
constexpr double full_scale = 1000;
constexpr int across = 2, along = 3;  // finer points a voxel
constexpr int finer = 4;              // across, where fat and water meet in a series that shows it
constexpr double fat_shift_hz = 217;  // of fat against water at 1.5 T (3.4 ppm)
constexpr double coil_mm = 70;        // of the sensitivity's decay

struct Spoiling {
  double noise, shift_mm, ghost, coil_depth, fat_phase;
  std::array<Vector3d, 2> coil, failure;
  std::array<double, 2> failure_gain{}, failure_mm{};
};

const Greys& greys_of(Series series) {
  return series == Series::t1 ? t1_greys : series == Series::fatsat ? fatsat_greys : t2_greys;
}

/// Of fat against water at the echo. Of fast gradient echoes with fat suppression half are read before both are in
/// phase again, half then, after 4.6 ms; T1 is made in phase, a spin echo (t2) brings both back.
double draw_fat_phase(std::uint64_t seed, Series series) {
  Random random(seed, "echo");
  const double early_s = random.uniform(1.4e-3, 2.7e-3);
  return series == Series::fatsat && random.uniform() < 0.5 ? 2 * std::numbers::pi * fat_shift_hz * early_s : 0;
}

Spoiling draw(const Torso& torso, Random& random, std::uint64_t seed, const SeriesOptions& options) {
  Spoiling s;
  s.fat_phase = options.fat_phase_rad.value_or(draw_fat_phase(seed, options.series));
  const bool fat = options.series != Series::t1;
  s.noise = full_scale * (fat ? random.uniform(0.02, 0.05) : random.uniform(0.008, 0.02));
  s.shift_mm = random.uniform(0, 2);
  s.ghost = random.uniform(0, 0.03);
  s.coil_depth = random.uniform(0.7, 1.3) * coil_mm;
  for (const int side : {0, 1}) {
    const double sign = side == 0 ? -1 : 1;
    s.coil[side] = torso.nipple_mm(side) +
                   Vector3d(sign * random.uniform(0, 30), random.uniform(-30, 10), random.uniform(-20, 20));
    const DrawnBreast& b = torso.breasts()[side];
    s.failure[side] =
        b.foot_mm + Vector3d(-sign * b.half_mm.x(), -random.uniform(0, 40), -random.uniform(0.2, 0.8) * b.half_mm.y());
    const bool fails = fat && options.suppression_fails && random.uniform() < 0.6;
    s.failure_gain[side] = fails ? random.uniform(1, 3) : 0;
    s.failure_mm[side] = random.uniform(12, 25);
  }
  return s;
}

double sensitivity(const Spoiling& s, const Vector3d& p) {
  double sum = 0.08;
  for (const Vector3d& coil : s.coil) {
    const double d = (p - coil).norm() / s.coil_depth;
    sum += 1.2 / (1 + d * d);
  }
  return sum;
}

double fat_gain(const Spoiling& s, const Vector3d& p, bool all_fails) {
  double gain = all_fails ? 2.7 : 1;
  for (const int n : {0, 1}) {
    const double d = (p - s.failure[n]).norm() / s.failure_mm[n];
    gain += s.failure_gain[n] * std::exp(-d * d / 2);
  }
  return gain;
}

segmentation::Grid draw_grid(const Torso& torso, Random& random, const SeriesOptions& options) {
  segmentation::Grid grid;
  grid.spacing_mm = {random.uniform(1.1, 1.5), 0, random.uniform(2, 4)};
  grid.spacing_mm.y() = grid.spacing_mm.x();
  if (options.voxel_mm.x() > 0) grid.spacing_mm = options.voxel_mm;
  const double tip = std::min(torso.nipple_mm(0).y(), torso.nipple_mm(1).y()) - 35;
  const Vector3d low(-195, tip, torso.low_z_mm() - 40), high(195, torso.back_y_mm() + 70, torso.high_z_mm() + 30);
  grid.size = ((high - low).array() / grid.spacing_mm.array()).cast<int>() + 1;
  grid.origin_mm = low + random.uniform() * grid.spacing_mm;
  return grid;
}

/// Sums over the finer points of a voxel.
struct VoxelSample {
  std::array<int, stuff_count> count{};
  double water = 0, fat = 0, points = 0;

  bool is_mixed() const { return water > 0 && fat > 0; }
  /// Fat and water of one voxel cancel where they are out of phase: a dark line on every border between the two.
  double grey(double phase) const { return std::hypot(water + fat * std::cos(phase), fat * std::sin(phase)) / points; }
};

VoxelSample sample_voxel(const Torso& torso, const Spoiling& s, const SeriesOptions& options, const Vector3d& middle,
                         const Vector3d& spacing_mm, int across_points) {
  const Greys& greys = greys_of(options.series);
  VoxelSample sample;
  for (int c = 0; c < along; ++c)
    for (int b = 0; b < across_points; ++b)
      for (int a = 0; a < across_points; ++a) {
        const Vector3d p =
            middle + spacing_mm.cwiseProduct(Vector3d((a + 0.5) / across_points - 0.5, (b + 0.5) / across_points - 0.5,
                                                      (c + 0.5) / along - 0.5));
        const Stuff here = torso.at(p);
        ++sample.count[static_cast<int>(here)];
        if ((here == Stuff::muscle || here == Stuff::fat) && torso.is_collagen(p))
          sample.water += collagen_grey;
        else if (here != Stuff::fat)
          sample.water += greys[static_cast<int>(here)];
        const Vector3d from = p - Vector3d(s.shift_mm, 0, 0);
        if (torso.at(from) == Stuff::fat && !torso.is_collagen(from))
          sample.fat += greys[static_cast<int>(Stuff::fat)] * fat_gain(s, from, options.all_fails);
      }
  sample.points = across_points * across_points * along;
  return sample;
}

/// Greys without noise, the truth and the share of gland, by finer sampling.
void sample_torso(const Torso& torso, const Spoiling& s, const SeriesOptions& options, MadeSeries& made) {
  const segmentation::Grid& grid = made.image.grid;
#pragma omp parallel for schedule(dynamic)
  for (int k = 0; k < grid.size.z(); ++k)
    for (int j = 0; j < grid.size.y(); ++j)
      for (int i = 0; i < grid.size.x(); ++i) {
        const Vector3d middle = grid.point(Vector3d(i, j, k));
        VoxelSample sample = sample_voxel(torso, s, options, middle, grid.spacing_mm, across);
        if (options.series == Series::fatsat && sample.is_mixed())
          sample = sample_voxel(torso, s, options, middle, grid.spacing_mm, finer);
        const std::size_t n = grid.index(i, j, k);
        made.image.voxels[n] = static_cast<float>(full_scale * sensitivity(s, middle) * sample.grey(s.fat_phase));
        made.truth.voxels[n] = static_cast<std::uint8_t>(std::max_element(sample.count.begin(), sample.count.end()) -
                                                         sample.count.begin());
        made.gland_share[n] = static_cast<float>(sample.count[static_cast<int>(Stuff::gland)] / sample.points);
      }
}

/// Copies of the moving chest, a third of the field of view aside along x.
void add_ghosts(double share, segmentation::GreyImage& image) {
  const segmentation::GreyImage before = image;
  const Eigen::Vector3i size = image.grid.size;
  const int aside = size.x() / 3;
  for (int k = 0; k < size.z(); ++k)
    for (int j = 0; j < size.y(); ++j)
      for (int i = 0; i < size.x(); ++i)
        image.at(i, j, k) += static_cast<float>(share) * (before.at((i + aside) % size.x(), j, k) +
                                                          before.at((i + size.x() - aside) % size.x(), j, k));
}

void turn_round(segmentation::Grid& grid) {  // the same voxels, said to lie with the front at the back
  grid.direction.col(1) = -grid.direction.col(1);
  grid.origin_mm.y() = -grid.origin_mm.y();
}

}  // namespace

MadeSeries make_series(const Torso& torso, std::uint64_t seed, const SeriesOptions& options) {
  Random random(seed, "series"), noise(seed, "noise");
  const Spoiling spoiling = draw(torso, random, seed, options);
  MadeSeries made;
  made.image.grid = made.truth.grid = draw_grid(torso, random, options);
  const std::size_t count = made.image.grid.count();
  made.image.voxels.resize(count);
  made.truth.voxels.resize(count);
  made.gland_share.resize(count);
  sample_torso(torso, spoiling, options, made);
  add_ghosts(spoiling.ghost, made.image);
  float brightest = 0;
  for (float& grey : made.image.voxels) {
    grey = std::round(
        static_cast<float>(std::hypot(grey + spoiling.noise * noise.normal(), spoiling.noise * noise.normal())));
    brightest = std::max(brightest, grey);
  }
  if (options.inverted)
    for (float& grey : made.image.voxels) grey = brightest - grey;
  if (options.upside_down) {
    turn_round(made.image.grid);
    made.truth.grid = made.image.grid;
  }
  return made;
}

}  // namespace supine::phantom
