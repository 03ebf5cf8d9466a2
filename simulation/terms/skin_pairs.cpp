// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/terms/skin_pairs.h"

#include <algorithm>
#include <array>
#include <numeric>

#include "simulation/laws/skin_contact_law.h"

namespace supine::simulation {
namespace {

// Neighbours: what is reached over faces whose middles lie within so many reaches, 1.2 edges of such a face. Fewer
// would take the two sides of a ridge for skins that have passed through each other.
constexpr double neighbours_in_reaches = 2;

/// Samples in the cubes of a grid.
class Grid {
 public:
  Grid(const Points& places, double cell_mm) : cell_mm_(cell_mm), sample_(places.rows()), key_(places.rows()) {
    lowest_ = places.colwise().minCoeff().transpose();
    const Eigen::Vector3d size = places.colwise().maxCoeff().transpose() - lowest_;
    for (int i = 0; i < 3; ++i) cubes_[i] = static_cast<std::int64_t>(size[i] / cell_mm) + 1;
    std::vector<std::int64_t> keys(places.rows());
    for (Eigen::Index s = 0; s < places.rows(); ++s) keys[s] = key(cube(places.row(s).transpose()));
    std::iota(sample_.begin(), sample_.end(), 0);
    std::stable_sort(sample_.begin(), sample_.end(), [&keys](int a, int b) { return keys[a] < keys[b]; });
    for (std::size_t i = 0; i < sample_.size(); ++i) key_[i] = keys[sample_[i]];
  }

  /// @param visit  void(int sample): of the cube of @p place and those around it
  template <class Visit>
  void around(const Eigen::Vector3d& place, const Visit& visit) const {
    const std::array<std::int64_t, 3> at = cube(place);
    for (std::int64_t i = std::max<std::int64_t>(0, at[0] - 1); i <= std::min(at[0] + 1, cubes_[0] - 1); ++i)
      for (std::int64_t j = std::max<std::int64_t>(0, at[1] - 1); j <= std::min(at[1] + 1, cubes_[1] - 1); ++j) {
        // Cubes along the last axis follow each other.
        const std::int64_t first = key({i, j, std::max<std::int64_t>(0, at[2] - 1)});
        const std::int64_t last = key({i, j, std::min(at[2] + 1, cubes_[2] - 1)});
        auto found = std::lower_bound(key_.begin(), key_.end(), first) - key_.begin();
        for (; found < static_cast<std::ptrdiff_t>(key_.size()) && key_[found] <= last; ++found) visit(sample_[found]);
      }
  }

 private:
  std::array<std::int64_t, 3> cube(const Eigen::Vector3d& place) const {
    std::array<std::int64_t, 3> at{};
    for (int i = 0; i < 3; ++i)
      at[i] = std::clamp<std::int64_t>(static_cast<std::int64_t>((place[i] - lowest_[i]) / cell_mm_), 0, cubes_[i] - 1);
    return at;
  }
  std::int64_t key(const std::array<std::int64_t, 3>& at) const {
    return (at[0] * cubes_[1] + at[1]) * cubes_[2] + at[2];
  }

  double cell_mm_;
  Eigen::Vector3d lowest_;
  std::array<std::int64_t, 3> cubes_{};
  std::vector<int> sample_;
  std::vector<std::int64_t> key_;  // of each sample, sorted
};

Points middles(const SkinSamples& samples, const Points& x) {
  Points middle = Points::Zero(samples.faces().rows(), 3);
  for (Eigen::Index f = 0; f < middle.rows(); ++f)
    for (int corner = 0; corner < 3; ++corner) middle.row(f) += x.row(samples.faces()(f, corner)) / 3;
  return middle;
}

/// Faces that share a node with each, itself among them.
std::vector<std::vector<int>> adjacent_faces(const Indices& faces, Eigen::Index nodes) {
  std::vector<std::vector<int>> at_node(nodes), adjacent(faces.rows());
  for (int f = 0; f < faces.rows(); ++f)
    for (int corner = 0; corner < 3; ++corner) at_node[faces(f, corner)].push_back(f);
  for (int f = 0; f < faces.rows(); ++f) {
    for (int corner = 0; corner < 3; ++corner) {
      const auto& more = at_node[faces(f, corner)];
      adjacent[f].insert(adjacent[f].end(), more.begin(), more.end());
    }
    std::sort(adjacent[f].begin(), adjacent[f].end());
    adjacent[f].erase(std::unique(adjacent[f].begin(), adjacent[f].end()), adjacent[f].end());
  }
  return adjacent;
}

}  // namespace

SkinPairs::SkinPairs(const SkinSamples& samples, const Points& imaged) : samples_(samples), cell_mm_(0) {
  const int faces = static_cast<int>(samples.faces().rows());
  const Points middle = middles(samples, imaged);
  const auto adjacent = adjacent_faces(samples.faces(), imaged.rows());
  std::vector<std::pair<int, int>> neighbours;
  std::vector<int> seen(faces, -1), ring;
  for (int f = 0; f < faces; ++f) {
    cell_mm_ = std::max(cell_mm_, samples.reach_mm(f));
    const double near = neighbours_in_reaches * samples.reach_mm(f);
    ring = {f};
    seen[f] = f;
    for (std::size_t at = 0; at < ring.size(); ++at)
      for (const int next : adjacent[ring[at]])
        if (seen[next] != f && (middle.row(next) - middle.row(f)).norm() < near) {
          seen[next] = f;
          ring.push_back(next);
        }
    for (const int other : adjacent[f])  // however large they are
      if (seen[other] != f) ring.push_back(other);
    for (const int other : ring) neighbours.emplace_back(f, other);
  }
  apart_.resize(faces);
  leave_out(neighbours);
}

void SkinPairs::leave_out(const std::vector<std::pair<int, int>>& faces) {
  for (const auto& [a, b] : faces) {
    apart_[a].push_back(b);
    if (a != b) apart_[b].push_back(a);
  }
  for (auto& list : apart_) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
}

bool SkinPairs::apart(int face, int other) const {
  return std::binary_search(apart_[face].begin(), apart_[face].end(), other);
}

void SkinPairs::find(const SkinShape& now, std::vector<Group>& groups) const {
  const Grid grid(now.place, cell_mm_);
  groups.clear();
  Group group;
  for (int s = 0; s < samples_.count(); ++s) {
    const Eigen::RowVector3d place = now.place.row(s), normal = now.normal.row(s);
    const int face = SkinSamples::face_of(s);
    group = {s, {}};
    grid.around(place.transpose(), [&](int other) {
      const double reach = samples_.reach_mm(SkinSamples::face_of(other));
      if ((now.place.row(other) - place).squaredNorm() >= reach * reach) return;
      if (facing_weight(now.normal.row(other).dot(normal)).value <= 0) return;
      if (!apart(face, SkinSamples::face_of(other))) group.opposite.push_back(other);
    });
    if (group.opposite.empty()) continue;
    std::sort(group.opposite.begin(), group.opposite.end());
    groups.push_back(group);
  }
}

}  // namespace supine::simulation
