// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/tetrahedra/curve.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "common/error.h"
#include "meshing/jacobian.h"
#include "meshing/quality.h"
#include "meshing/tetrahedra/fine_surface.h"
#include "meshing/topology.h"
#include "reconstruction/surface_check.h"
#include "reconstruction/surface_tree.h"

namespace supine::meshing {
namespace {

using reconstruction::Region;
using reconstruction::Surface;
using reconstruction::SurfaceTree;

constexpr double farthest_share = 0.35;  // of the mean edge: a surface further away than this belongs elsewhere
constexpr double kept_shape = 0.8;       // of a corner tetrahedron's shape angle
constexpr double good_shape_deg = 12;    // a shape angle above this need not be kept
constexpr double pull = 0.85;            // share of the way that is left when a node is pulled back once more
constexpr int most_pulls = 60;           // 0.85^28 < 0.01: then it is put straight
constexpr double straight_below = 0.01;

/// A boundary node and what it lies on.
struct Wanted {
  int node;
  std::set<int> patches;
  double edge_mm = 0;  // mean of the edges around it
};

class Bender {
 public:
  Bender(TetMesh& mesh, const Surface& fine, const MuscleDistance* muscle, const CurveOptions& options)
      : mesh_(mesh), fine_(fine), muscle_(muscle), options_(options), cells_of_(mesh.points.rows()) {
    for (int c = 0; c < mesh.cells.rows(); ++c)
      for (int k = 0; k < 10; ++k) cells_of_[mesh.cells(c, k)].push_back(c);
    collect();
  }

  void move_corners(CurveReport& report) {
    report.corners = static_cast<Eigen::Index>(corners_.size());
    std::vector<double> shape(mesh_.cells.rows());
    for (int c = 0; c < mesh_.cells.rows(); ++c) shape[c] = corner_shape(c);
    const auto bad = [&](int c) { return corner_shape(c) < std::min(good_shape_deg, kept_shape * shape[c]); };
    move(corners_, 4, bad);
    for (const Move& m : moves_) {
      report.corner_shift_max_mm = std::max(report.corner_shift_max_mm, m.share * (m.to - m.from).norm());
      note_pull(m, report.corners_pulled_back, report);
    }
    straighten();
  }

  void move_middles(CurveReport& report) {
    report.middles = static_cast<Eigen::Index>(middles_.size());
    const auto bad = [&](int c) {
      return !scaled_jacobian_exceeds(quadratic_nodes(mesh_, c), options_.least_jacobian);
    };
    move(middles_, 10, bad);
    for (const Move& m : moves_) {
      const double sagitta = m.share * (m.to - m.from).norm();
      report.sagitta_mean_mm += sagitta / static_cast<double>(moves_.size());
      report.sagitta_max_mm = std::max(report.sagitta_max_mm, sagitta);
      note_pull(m, report.middles_pulled_back, report);
    }
    const auto pulled = static_cast<double>(report.corners_pulled_back + report.middles_pulled_back);
    if (pulled > 0) report.pulled_back_mean_mm /= pulled;
  }

 private:
  struct Move {
    int node;
    Eigen::Vector3d from, to;
    double share = 1;
  };

  double corner_shape(int c) const {
    Eigen::Matrix<double, 4, 3> x;
    for (int k = 0; k < 4; ++k) x.row(k) = mesh_.points.row(mesh_.cells(c, k));
    return shape_angle_deg(x);
  }

  void collect() {
    std::map<int, Wanted> corners, middles;
    std::map<int, int> edges;
    for (Eigen::Index f = 0; f < mesh_.faces.rows(); ++f) {
      const int patch = patch_of(mesh_.region[f]);
      for (int k = 0; k < 3; ++k) {
        const int a = mesh_.faces(f, k), b = mesh_.faces(f, (k + 1) % 3), middle = mesh_.faces(f, 3 + k);
        const double length = (mesh_.points.row(a) - mesh_.points.row(b)).norm();
        for (const int corner : {a, b}) {
          Wanted& wanted = corners[corner];
          wanted.node = corner;
          wanted.patches.insert(patch);
          wanted.edge_mm += length;
          ++edges[corner];
        }
        Wanted& wanted = middles[middle];
        wanted.node = middle;
        wanted.patches.insert(patch);
        wanted.edge_mm = length;
      }
    }
    for (auto& [node, wanted] : corners) {
      wanted.edge_mm /= edges[node];
      corners_.push_back(wanted);
    }
    for (const auto& [node, wanted] : middles) middles_.push_back(wanted);
  }

  // Where the surface wants a node; where it is now when the surface says nothing.
  Eigen::Vector3d target(const Wanted& wanted) const {
    const Eigen::Vector3d home = mesh_.points.row(wanted.node);
    if (wanted.patches.size() > 2) return home;
    const double smooth = options_.smooth_share * wanted.edge_mm;
    const int patch = *wanted.patches.begin(), other = *wanted.patches.rbegin();
    const std::optional<Eigen::Vector3d> on_fine =
        patch == other ? fine_.on_region(home, patch, smooth) : fine_.on_border(home, patch, other, smooth);
    Eigen::Vector3d to = on_fine.value_or(home);
    if (muscle_ != nullptr && wanted.patches.contains(static_cast<int>(Region::inner))) to += to_muscle(to);
    return (to - home).norm() > farthest_share * wanted.edge_mm ? home : to;
  }

  Eigen::Vector3d to_muscle(const Eigen::Vector3d& from) const {
    Eigen::Vector3d p = from;
    for (int i = 0; i < 10; ++i) {
      const MuscleDistance::Sample s = muscle_->at(p);
      const double square = s.gradient.squaredNorm();
      if (!(square > 0.04)) return Eigen::Vector3d::Zero();  // far from where the fit means a distance
      p -= s.value_mm / square * s.gradient;
      if (std::abs(s.value_mm) < 1e-9) break;
    }
    const Eigen::Vector3d shift = p - from;
    const double length = shift.norm();
    return length > options_.muscle_reach_mm ? Eigen::Vector3d(options_.muscle_reach_mm / length * shift) : shift;
  }

  void place(const Move& m) { mesh_.points.row(m.node) = (m.from + m.share * (m.to - m.from)).transpose(); }

  // Moves the nodes, then pulls back those of bad cells until none is bad.
  template <class Bad>
  void move(const std::vector<Wanted>& nodes, int of_cell, const Bad& bad) {
    moves_.clear();
    std::vector<int> number(mesh_.points.rows(), -1);
    for (const Wanted& wanted : nodes) {
      number[wanted.node] = static_cast<int>(moves_.size());
      moves_.push_back({wanted.node, mesh_.points.row(wanted.node).transpose(), target(wanted)});
    }
    std::set<int> touched;
    for (const Move& m : moves_) {
      place(m);
      touched.insert(cells_of_[m.node].begin(), cells_of_[m.node].end());
    }
    for (int round = 0; round < most_pulls && !touched.empty(); ++round) {
      std::set<int> pulled;
      for (const int c : touched) {
        if (!bad(c)) continue;
        for (int k = 0; k < of_cell; ++k)
          if (number[mesh_.cells(c, k)] >= 0) pulled.insert(number[mesh_.cells(c, k)]);
      }
      touched.clear();
      for (const int n : pulled) {
        Move& m = moves_[n];
        if (m.share == 0) continue;
        m.share *= pull;
        if (m.share < straight_below) m.share = 0;
        place(m);
        touched.insert(cells_of_[m.node].begin(), cells_of_[m.node].end());
      }
    }
  }

  static void note_pull(const Move& m, Eigen::Index& count, CurveReport& report) {
    const double missing = (1 - m.share) * (m.to - m.from).norm();
    if (!(missing > 1e-6)) return;
    ++count;
    report.pulled_back_mean_mm += missing;
    report.pulled_back_max_mm = std::max(report.pulled_back_max_mm, missing);
  }

  // Middles to the middles of the moved corners.
  void straighten() {
    for (Eigen::Index c = 0; c < mesh_.cells.rows(); ++c)
      for (int e = 0; e < 6; ++e)
        mesh_.points.row(mesh_.cells(c, 4 + e)) =
            (mesh_.points.row(mesh_.cells(c, tet_edges[e][0])) + mesh_.points.row(mesh_.cells(c, tet_edges[e][1]))) / 2;
  }

  TetMesh& mesh_;
  const FineSurface fine_;
  const MuscleDistance* muscle_;
  const CurveOptions options_;
  std::vector<std::vector<int>> cells_of_;
  std::vector<Wanted> corners_, middles_;
  std::vector<Move> moves_;
};

// Points evenly spread over the faces, curved ones as they are.
Points face_samples(const TetMesh& mesh, bool skin_only) {
  constexpr int pieces = 8;
  std::vector<Eigen::RowVector3d> samples;
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    if (skin_only && mesh.region[f] != static_cast<int>(Region::skin)) continue;
    for (int i = 0; i < pieces; ++i) {
      for (int j = 0; i + j < pieces; ++j) {
        samples.push_back(face_point(mesh.points, mesh.faces, f, (i + 1.0 / 3) / pieces, (j + 1.0 / 3) / pieces));
      }
    }
  }
  Points points(samples.size(), 3);
  for (std::size_t i = 0; i < samples.size(); ++i) points.row(static_cast<Eigen::Index>(i)) = samples[i];
  return points;
}

SurfaceDistance distance_to(const SurfaceTree& tree, const Points& samples) {
  if (samples.rows() == 0) return {};
  const Eigen::VectorXd d = tree.distances_mm(samples);
  return {d.mean(), std::sqrt(d.squaredNorm() / static_cast<double>(d.size())), d.maxCoeff()};
}

double volume_ml(const TetMesh& mesh) {
  double sum = 0;
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c) sum += curved_volume_mm3(quadratic_nodes(mesh, c));
  return sum / 1000;
}

void check_place(const SurfaceDistance& before, double edge_mm) {
  if (before.mean_mm < edge_mm) return;
  throw InputError(
      fmt::format("the mesh's boundary is {:.2f} mm from the fine surface on the mean, more than an edge ({:.2f} mm): "
                  "it is not the surface the mesh was made from",
                  before.mean_mm, edge_mm));
}

double mean_edge(const TetMesh& mesh) {
  double sum = 0;
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f)
    for (int k = 0; k < 3; ++k)
      sum += (mesh.points.row(mesh.faces(f, k)) - mesh.points.row(mesh.faces(f, (k + 1) % 3))).norm();
  return sum / (3.0 * static_cast<double>(mesh.faces.rows()));
}

}  // namespace

void CurveOptions::check() const {
  if (!(least_jacobian > 0 && least_jacobian < 1))
    throw InputError(fmt::format("least_jacobian is {}; it must lie in (0, 1)", least_jacobian));
  if (!(smooth_share >= 0 && smooth_share <= 2))
    throw InputError(fmt::format("smooth_share is {}; it must lie in [0, 2]", smooth_share));
  if (!(muscle_reach_mm >= 0)) throw InputError(fmt::format("muscle_reach_mm is {}; it must be >= 0", muscle_reach_mm));
}

CurveReport curve_boundary(TetMesh& mesh, const Surface& fine, const MuscleDistance* muscle,
                           const CurveOptions& options) {
  options.check();
  if (mesh.order() != 2) throw InputError("only quadratic meshes can be curved; this one is linear");
  CurveReport report;
  Bender bender(mesh, fine, muscle, options);
  const SurfaceTree tree(fine);
  report.before = distance_to(tree, face_samples(mesh, false));
  check_place(report.before, mean_edge(mesh));
  report.skin_before = distance_to(tree, face_samples(mesh, true));
  report.volume_before_ml = volume_ml(mesh);
  report.fine_volume_ml = reconstruction::check_surface(fine).volume_mm3 / 1000;
  bender.move_corners(report);
  bender.move_middles(report);
  report.after = distance_to(tree, face_samples(mesh, false));
  report.skin_after = distance_to(tree, face_samples(mesh, true));
  report.volume_after_ml = volume_ml(mesh);
  return report;
}

}  // namespace supine::meshing
