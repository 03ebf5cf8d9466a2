// SPDX-License-Identifier: AGPL-3.0-or-later
#include "phantom/mri/torso.h"

#include <algorithm>
#include <cmath>

#include "phantom/random.h"
#include "phantom/random_field.h"

namespace supine::phantom {
namespace {

constexpr double texture_step_mm = 3.5, texture_length_mm = 7;
constexpr double nipple_radius_mm = 5, nipple_height_mm = 5;
constexpr double gland_under_skin_mm = 5, gland_over_chest_mm = 6;
constexpr double least_fat_mm = 3;  // between skin and pectoral muscle
constexpr int strands = 14;
constexpr double strand_mm = 2.2;  // radius at the nipple; it thins out

double distance_to_line(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b, double& along) {
  const Eigen::Vector3d way = b - a;
  along = std::clamp((p - a).dot(way) / way.squaredNorm(), 0.0, 1.0);
  return (p - a - along * way).norm();
}

}  // namespace

Torso::Torso(std::uint64_t seed) {
  Random shape(seed, "torso"), inside(seed, "gland"), sheet(seed, "fascia");
  half_width_ = shape.uniform(130, 165);
  depth_ = shape.uniform(75, 95);
  power_ = shape.uniform(2, 2.8);
  front_y_ = shape.uniform(10, 30);
  tilt_ = shape.uniform(-0.2, 0.05);
  fat_front_ = shape.uniform(8, 20);
  fat_side_ = shape.uniform(15, 32);
  pectoral_mm_ = shape.uniform(7, 14);
  pectoral_x_ = shape.uniform(85, 110);
  fascia_mm_ = sheet.uniform(0.3, 0.7);
  skin_mm_ = shape.uniform(1.5, 2.5);
  support_mm_ = shape.uniform(10, 25);
  const double radius = shape.uniform(50, 66), hang = shape.uniform(55, 130), share = inside.uniform();
  for (const int side : {0, 1}) {
    DrawnBreast& b = breasts_[side];
    const double sign = side == 0 ? -1 : 1;
    b.foot_mm = {sign * shape.uniform(72, 84), 0, shape.uniform(-8, 8)};
    b.half_mm = radius * Eigen::Vector2d(shape.uniform(0.95, 1.1), shape.uniform(0.95, 1.15));
    b.hang_mm = hang * shape.uniform(0.9, 1.1);
    b.blunt = shape.uniform(2, 3);
    b.lean_mm = {sign * shape.uniform(-5, 12), shape.uniform(-20, 5)};
    b.gland_share = share;
    b.foot_mm.y() = chest_y_mm(b.foot_mm.x(), b.foot_mm.z());
    for (int n = 0; n < strands; ++n) {
      const double turn = inside.uniform(0, 6.283), wide = std::sqrt(inside.uniform()) * 0.75;
      ducts_[side].push_back(b.foot_mm + Eigen::Vector3d(wide * b.half_mm.x() * std::cos(turn),
                                                         -inside.uniform(8, 0.4 * b.hang_mm),
                                                         wide * b.half_mm.y() * std::sin(turn)));
    }
    for (int n = 0; n < 4; ++n)
      nodes_.push_back(
          {{sign * shape.uniform(0.92, 1.05) * half_width_, front_y_ + shape.uniform(45, 80), shape.uniform(20, 70)},
           shape.uniform(3, 7)});
  }
  support_z_ = low_z_mm() - 8;
  // Where the superellipse has turned half way: reader's end. Found by walking along it.
  back_y_mm_ = front_y_ + depth_;
  for (double x = 20; x < half_width_; x += 0.5)
    if (chest_y_mm(x + 0.5, 0) - chest_y_mm(x, 0) > 0.5 && x > pectoral_x_ + 12) {
      back_y_mm_ = chest_y_mm(x, 0);
      break;
    }
  const RandomField field(seed, "gland texture", 1, texture_length_mm);
  texture_.grid.spacing_mm.setConstant(texture_step_mm);
  texture_.grid.size = {95, 60, 60};
  texture_.grid.origin_mm = {-165, front_y_ + 40 - 59 * texture_step_mm, -105};
  texture_.voxels.resize(texture_.grid.count());
  const Eigen::Vector3i size = texture_.grid.size;
#pragma omp parallel for schedule(static)
  for (int k = 0; k < size.z(); ++k)
    for (int j = 0; j < size.y(); ++j)
      for (int i = 0; i < size.x(); ++i)
        texture_.at(i, j, k) = static_cast<float>(field.at(texture_.grid.point(Eigen::Vector3d(i, j, k))));
}

double Torso::low_z_mm() const {
  return std::min(breasts_[0].foot_mm.z() - breasts_[0].half_mm.y(), breasts_[1].foot_mm.z() - breasts_[1].half_mm.y());
}

double Torso::high_z_mm() const {
  return std::max(breasts_[0].foot_mm.z() + breasts_[0].half_mm.y(), breasts_[1].foot_mm.z() + breasts_[1].half_mm.y());
}

double Torso::chest_y_mm(double x, double z) const {
  const double across = std::min(0.9999, std::abs(x) / half_width_);
  const double oval = front_y_ + tilt_ * z + depth_ * (1 - std::pow(1 - std::pow(across, power_), 1 / power_));
  // The pectoral muscle: from beside the sternum to its own outer edge, above the fold; thin at the edges.
  const double a = std::clamp((std::abs(x) - 6) / 12, 0.0, 1.0) *
                   std::clamp((pectoral_x_ - std::abs(x)) / 6, 0.0, 1.0) * std::clamp((z + 55) / 25, 0.0, 1.0);
  // Beside the sternum a thin body has little room for it: some fat stays between muscle and skin.
  return std::max(oval - pectoral_mm_ * a, bare_skin_y_mm(x, z) + skin_mm_ + least_fat_mm);
}

bool Torso::is_collagen(const Eigen::Vector3d& p) const {
  constexpr double aside_mm = 0.5, slanted = 8;  // along y the sheet is at most so many times as thick
  const double deep = p.y() - chest_y_mm(p.x(), p.z());
  if (deep < 0) return anatomy_ && part_at(p) == Anatomy::Part::ligament;
  if (deep > slanted * fascia_mm_ || std::abs(p.x()) >= half_width_) return false;
  const double slope = (chest_y_mm(p.x() + aside_mm, p.z()) - chest_y_mm(p.x() - aside_mm, p.z())) / (2 * aside_mm);
  return deep < fascia_mm_ * std::hypot(1, slope);
}

double Torso::bare_skin_y_mm(double x, double z) const {
  const double half = half_width_ + fat_side_, across = std::min(0.9999, std::abs(x) / half);
  return front_y_ + tilt_ * z - fat_front_ +
         (depth_ + fat_front_) * (1 - std::pow(1 - std::pow(across, power_), 1 / power_));
}

Eigen::Vector3d Torso::nipple_mm(int side) const {
  const DrawnBreast& b = breasts_[side];
  return b.foot_mm + Eigen::Vector3d(b.lean_mm.x(), -b.hang_mm, b.lean_mm.y());
}

bool Torso::in_breast(int side, const Eigen::Vector3d& p, double inward_mm) const {
  const DrawnBreast& b = breasts_[side];
  if (!b.there) return false;
  const double ahead = (b.foot_mm.y() - p.y()) / b.hang_mm;
  if (ahead < -0.5 || ahead > 1.2) return false;
  const double t = std::max(0.0, ahead);
  const double dx = (p.x() - b.foot_mm.x() - t * b.lean_mm.x()) / (b.half_mm.x() - inward_mm),
               dz = (p.z() - b.foot_mm.z() - t * b.lean_mm.y()) / (b.half_mm.y() - inward_mm);
  const double depth = (b.hang_mm - inward_mm) / b.hang_mm;
  return std::pow(std::hypot(dx, dz), b.blunt) + std::pow(t / depth, b.blunt) < 1;
}

bool Torso::in_body(const Eigen::Vector3d& p, double inward_mm) const {
  if (std::abs(p.x()) < half_width_ + fat_side_ - inward_mm && p.y() > bare_skin_y_mm(p.x(), p.z()) + inward_mm)
    return true;
  return in_breast(0, p, inward_mm) || in_breast(1, p, inward_mm);
}

double Torso::texture(const Eigen::Vector3d& p) const {
  const Eigen::Vector3d at = texture_.grid.continuous_index(p);
  const Eigen::Vector3i low = at.array().floor().cast<int>();
  if ((low.array() < 0).any() || ((low.array() + 2) > texture_.grid.size.array()).any()) return -9;
  const Eigen::Vector3d t = at - low.cast<double>();
  double sum = 0;
  for (int c = 0; c < 8; ++c) {
    const int x = c & 1, y = c >> 1 & 1, z = c >> 2;
    sum += (x ? t.x() : 1 - t.x()) * (y ? t.y() : 1 - t.y()) * (z ? t.z() : 1 - t.z()) *
           texture_.at(low.x() + x, low.y() + y, low.z() + z);
  }
  return sum;
}

bool Torso::may_hold_gland(int side, const Eigen::Vector3d& p) const {
  return in_breast(side, p, gland_under_skin_mm + skin_mm_) && p.y() <= chest_y_mm(p.x(), p.z()) - gland_over_chest_mm;
}

Anatomy::Part Torso::part_at(const Eigen::Vector3d& p) const {
  const int side = p.x() > 0;
  if (!may_hold_gland(side, p)) return Anatomy::Part::fat;
  const DrawnBreast& b = breasts_[side];
  const double ahead = (b.foot_mm.y() - p.y()) / b.hang_mm;
  const Eigen::Vector2d across =
      (Eigen::Vector2d(p.x() - b.foot_mm.x(), p.z() - b.foot_mm.z()) - ahead * b.lean_mm).cwiseQuotient(b.half_mm);
  return anatomy_->at({side == 0 ? -across.x() : across.x(), across.y(), ahead});
}

bool Torso::is_gland(const Eigen::Vector3d& p) const {
  const int side = p.x() > 0;
  const DrawnBreast& b = breasts_[side];
  if (!may_hold_gland(side, p)) return false;
  const Eigen::Vector3d nipple = nipple_mm(side);
  double along = 0;
  for (const Eigen::Vector3d& end : ducts_[side])
    if (distance_to_line(p, nipple, end, along) < strand_mm * (1.3 - along)) return true;
  // The body of the gland: a cone of the fan, in patches.
  const Eigen::Vector3d way = p - nipple, axis = (b.foot_mm - nipple).normalized();
  const double far = way.dot(axis) / b.hang_mm;
  const double aside = (way - way.dot(axis) * axis).norm() /
                       (0.25 * b.half_mm.x() + 0.75 * b.half_mm.x() * std::sqrt(std::max(0.0, far)));
  if (far < 0 || far > 0.85 || aside > 0.85) return false;
  return texture(p) > 1.6 - 2.4 * b.gland_share + 1.2 * aside * aside;
}

Stuff Torso::at(const Eigen::Vector3d& p) const {
  if (p.z() < support_z_ && p.y() < bare_skin_y_mm(0, p.z()) + 2 && p.y() > bare_skin_y_mm(0, p.z()) - support_mm_ &&
      std::abs(p.x()) < 120 && !in_body(p, 0))
    return Stuff::support;
  for (const int side : {0, 1})
    if (breasts_[side].there) {
      const Eigen::Vector3d way = p - nipple_mm(side);
      if (std::hypot(way.x(), way.z()) < nipple_radius_mm && way.y() > -nipple_height_mm && way.y() < 4)
        return Stuff::skin;
    }
  if (!in_body(p, 0)) return Stuff::air;
  if (!in_body(p, skin_mm_)) return Stuff::skin;
  const double deep = p.y() - chest_y_mm(p.x(), p.z());
  if (std::abs(p.x()) < half_width_ && deep > 0) {
    const double wall = pectoral_mm_ + 12;
    return deep < wall || std::abs(p.x()) > half_width_ - 10 ? Stuff::muscle : Stuff::organ;
  }
  for (const Ball& node : nodes_)
    if ((p - node.middle).norm() < node.radius) return Stuff::vessel;
  if (!anatomy_) return is_gland(p) ? Stuff::gland : Stuff::fat;
  const Anatomy::Part part = part_at(p);
  return part == Anatomy::Part::gland ? Stuff::gland : part == Anatomy::Part::vessel ? Stuff::vessel : Stuff::fat;
}

}  // namespace supine::phantom
