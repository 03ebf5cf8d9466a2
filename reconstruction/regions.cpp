// SPDX-License-Identifier: AGPL-3.0-or-later
#include "reconstruction/regions.h"

#include <fmt/core.h>
#include <vtkIdList.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkStaticPointLocator.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <vector>

#include "common/error.h"
#include "reconstruction/mesh_edges.h"

namespace supine::reconstruction {
namespace {

using segmentation::LabelImage;
using segmentation::Tissue;

constexpr int averaging_passes = 4;
constexpr int region_count = static_cast<int>(region_names.size());

Tissue tissue_at(const LabelImage& image, const VoxelIndices& voxels, Eigen::Index p) {
  return static_cast<Tissue>(image.at(voxels(p, 0), voxels(p, 1), voxels(p, 2)));
}

bool in_image(const LabelImage& image, const VoxelIndices& voxels, Eigen::Index p) {
  return image.grid.contains(voxels(p, 0), voxels(p, 1), voxels(p, 2));
}

// A cut that case.toml does not allow: counted, and told at its first place.
class Refusal {
 public:
  Refusal(const char* what, const char* rule) : what_(what), rule_(rule) {}
  void add(const VoxelSurface& breast, const LabelImage& image, Eigen::Index p) {
    if (count_++ > 0) return;
    place_ = image.grid.point(breast.inside.row(p).transpose().cast<double>());
    tissue_ = segmentation::tissue_names[static_cast<int>(tissue_at(image, breast.inside, p))];
  }
  long count() const { return count_; }
  void throw_if_any() const {
    if (count_ == 0) return;
    throw InputError(
        fmt::format("tissue to be meshed {} at {} voxel faces, the first ({}) at ({:.1f}, {:.1f}, {:.1f}) mm LPS; the "
                    "model would end "
                    "there in a cut face. If the body goes on there, add \"{}\" to the list `cut` under [image] in "
                    "case.toml; if not, "
                    "correct the labels or the field of view",
                    what_, count_, tissue_, place_.x(), place_.y(), place_.z(), rule_));
  }

 private:
  const char* what_;
  const char* rule_;
  long count_ = 0;
  Eigen::Vector3d place_ = Eigen::Vector3d::Zero();
  std::string_view tissue_;
};

// Finds whether a point is near the muscle, by the muscle voxels that border on another tissue or the image's edge.
class NearMuscle {
 public:
  explicit NearMuscle(const LabelImage& image) {
    const VoxelSurface muscle = voxel_surface(image, only(Tissue::muscle));
    vtkNew<vtkPoints> points;
    points->SetDataTypeToDouble();
    for (Eigen::Index p = 0; p < muscle.inside.rows(); ++p) {
      const Eigen::Vector3d at = muscle.inside.row(p).transpose().cast<double>().cwiseProduct(image.grid.spacing_mm);
      points->InsertNextPoint(at.data());
    }
    data_->SetPoints(points);
    if (points->GetNumberOfPoints() == 0) return;
    locator_->SetDataSet(data_);
    locator_->BuildLocator();
  }
  bool within(const Eigen::Vector3d& along_axes_mm, double radius_mm) {
    if (data_->GetNumberOfPoints() == 0) return false;
    double distance2 = 0;
    return locator_->FindClosestPointWithinRadius(radius_mm, along_axes_mm.data(), distance2) >= 0;
  }

 private:
  vtkNew<vtkPolyData> data_;
  vtkNew<vtkStaticPointLocator> locator_;
};

// Region of every point of the staircase surface.
std::vector<Region> point_regions(const VoxelSurface& breast, const LabelImage& image, const CutRules& rules) {
  Refusal at_edge("touches the edge of the image", "edge"), at_excluded("borders on excluded tissue", "excluded"),
      bare("borders on air without skin next to the muscle", "rim");
  const bool has_skin = std::find(image.voxels.begin(), image.voxels.end(), static_cast<std::uint8_t>(Tissue::skin)) !=
                        image.voxels.end();
  NearMuscle near_muscle(image);
  std::vector<Region> region(breast.inside.rows(), Region::skin);
  for (Eigen::Index p = 0; p < breast.inside.rows(); ++p) {
    if (!in_image(image, breast.outside, p)) {
      region[p] = Region::cut;
      if (!rules.edge) at_edge.add(breast, image, p);
      continue;
    }
    const Tissue beyond = tissue_at(image, breast.outside, p), here = tissue_at(image, breast.inside, p);
    if (beyond == Tissue::muscle) {
      region[p] = Region::inner;
    } else if (beyond == Tissue::excluded) {
      region[p] = Region::cut;
      if (!rules.excluded) at_excluded.add(breast, image, p);
    } else if (here != Tissue::skin && here != Tissue::nipple && (rules.rim || has_skin) &&
               near_muscle.within(breast.surface.points.row(p).transpose(), rules.rim_mm)) {
      if (rules.rim)
        region[p] = Region::cut;
      else
        bare.add(breast, image, p);
    }
  }
  at_edge.throw_if_any();
  at_excluded.throw_if_any();
  // Where skin is labelled, a broad bare face is a body cut off; a few bare voxels are gaps in the label.
  constexpr double bare_share = 0.02;
  if (static_cast<double>(bare.count()) > bare_share * static_cast<double>(breast.inside.rows())) bare.throw_if_any();
  return region;
}

// The region with the largest averaged share at the triangle's corners.
Eigen::VectorXi averaged_regions(const Surface& surface, const std::vector<MeshEdge>& edges,
                                 const std::vector<Region>& region) {
  const auto neighbours = point_neighbours(edges, surface.points.rows());
  Table share = Table::Zero(surface.points.rows(), region_count);
  for (Eigen::Index p = 0; p < share.rows(); ++p) share(p, static_cast<int>(region[p])) = 1;
  for (int pass = 0; pass < averaging_passes; ++pass) {
    Table next = share;
    for (Eigen::Index p = 0; p < share.rows(); ++p) {
      for (const int n : neighbours[p]) next.row(p) += share.row(n);
      next.row(p) /= static_cast<double>(neighbours[p].size() + 1);
    }
    share = next;
  }
  Eigen::VectorXi result(surface.triangles.rows());
  for (Eigen::Index t = 0; t < result.size(); ++t) {
    const Eigen::RowVectorXd sum =
        share.row(surface.triangles(t, 0)) + share.row(surface.triangles(t, 1)) + share.row(surface.triangles(t, 2));
    sum.maxCoeff(&result(t));
  }
  return result;
}

struct Patch {
  int region;
  double area_mm2 = 0;
  std::vector<int> triangles;
  std::map<int, double> border_mm;  // length shared with each other region
};

std::vector<Patch> patches_of(const Surface& surface, const std::vector<MeshEdge>& edges,
                              const Eigen::VectorXi& region) {
  std::vector<std::vector<int>> across(surface.triangles.rows());
  for (const MeshEdge& edge : edges) {
    if (edge.count != 2 || region(edge.triangles[0]) != region(edge.triangles[1])) continue;
    across[edge.triangles[0]].push_back(edge.triangles[1]);
    across[edge.triangles[1]].push_back(edge.triangles[0]);
  }
  std::vector<Patch> patches;
  std::vector<int> patch_of(surface.triangles.rows(), -1);
  for (int seed = 0; seed < surface.triangles.rows(); ++seed) {
    if (patch_of[seed] >= 0) continue;
    Patch patch{region(seed), 0, {seed}, {}};
    patch_of[seed] = static_cast<int>(patches.size());
    for (std::size_t i = 0; i < patch.triangles.size(); ++i) {
      const auto corner = [&, t = patch.triangles[i]](int c) { return surface.points.row(surface.triangles(t, c)); };
      patch.area_mm2 += 0.5 * (corner(1) - corner(0)).cross(corner(2) - corner(0)).norm();
      for (const int next : across[patch.triangles[i]])
        if (patch_of[next] < 0) {
          patch_of[next] = static_cast<int>(patches.size());
          patch.triangles.push_back(next);
        }
    }
    patches.push_back(std::move(patch));
  }
  for (const MeshEdge& edge : edges) {
    if (edge.count != 2 || patch_of[edge.triangles[0]] == patch_of[edge.triangles[1]]) continue;
    const double length = (surface.points.row(edge.points[0]) - surface.points.row(edge.points[1])).norm();
    for (int side = 0; side < 2; ++side)
      patches[patch_of[edge.triangles[side]]].border_mm[region(edge.triangles[1 - side])] += length;
  }
  return patches;
}

// The smallest island goes first, because its going may join others. @return whether there was one
bool absorb_islands(const Surface& surface, const std::vector<MeshEdge>& edges, Eigen::VectorXi& region) {
  std::vector<Patch> patches = patches_of(surface, edges, region);
  std::sort(patches.begin(), patches.end(), [](const Patch& a, const Patch& b) {
    return std::pair(a.area_mm2, a.triangles[0]) < std::pair(b.area_mm2, b.triangles[0]);
  });
  bool changed = false;
  for (const Patch& patch : patches) {
    if (patch.area_mm2 >= smallest_island_mm2 || patch.border_mm.empty()) continue;
    const auto longest = std::max_element(patch.border_mm.begin(), patch.border_mm.end(),
                                          [](const auto& a, const auto& b) { return a.second < b.second; });
    for (const int t : patch.triangles) region(t) = longest->first;
    changed = true;
  }
  return changed;
}

// A triangle with two neighbours of another region is a tooth of the border. @return whether there was one
bool file_teeth(const std::vector<MeshEdge>& edges, Eigen::VectorXi& region) {
  std::vector<std::array<int, 3>> beside(region.size(), {-1, -1, -1});
  for (const MeshEdge& edge : edges)
    if (edge.count == 2)
      for (int side = 0; side < 2; ++side) {
        auto& row = beside[edge.triangles[side]];
        *std::find(row.begin(), row.end(), -1) = edge.triangles[1 - side];
      }
  bool changed = false;
  for (Eigen::Index t = 0; t < region.size(); ++t) {
    std::array<int, region_count> votes{};
    for (const int n : beside[t])
      if (n >= 0) ++votes[region(n)];
    const auto most = std::max_element(votes.begin(), votes.end());
    if (*most < 2 || most - votes.begin() == region(t)) continue;
    region(t) = static_cast<int>(most - votes.begin());
    changed = true;
  }
  return changed;
}

}  // namespace

Eigen::VectorXi regions_of(const VoxelSurface& breast, const LabelImage& image, const CutRules& rules) {
  const std::vector<MeshEdge> edges = mesh_edges(breast.surface.triangles);
  Eigen::VectorXi region = averaged_regions(breast.surface, edges, point_regions(breast, image, rules));
  // Teeth cannot come back for ever: the border gets shorter with each; the bound only guards against ties in pairs.
  for (int round = 0; round < 20 && (file_teeth(edges, region) | absorb_islands(breast.surface, edges, region));
       ++round) {
  }
  return region;
}

}  // namespace supine::reconstruction
