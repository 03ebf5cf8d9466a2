// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/quads/quad_remesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "meshing/quads/lattice_extract.h"
#include "meshing/quads/position_field.h"
#include "meshing/quads/quad_diagonals.h"
#include "meshing/quads/surface_fit.h"
#include "reconstruction/mesh_edges.h"
#include "reconstruction/surface_check.h"

namespace supine::meshing {
namespace {

using reconstruction::Surface;

constexpr double field_share = 0.3;   // edges of the field mesh, of those wanted
constexpr double size_growth = 0.25;  // of a size per distance: cells grow by a quarter from one to the next
constexpr int most_tries = 4;         // at hitting a number of faces
constexpr double least_share = 0.92;  // of the triangles asked for
constexpr double faces_tolerance = 0.02;
constexpr int samples_per_triangle = 40;

// Largest deviation from 90 degrees of what is paired before each fit: a fit straightens quads, so those before it may
// be worse than the ones that are left. It is the geometry, not the parity of triangles, that leaves triangles alone.
constexpr double deviations_deg[] = {80, 70, 65};

double misfit(int now, int wanted) { return static_cast<double>(now) / wanted; }

QuadPairs fit_quads(const FitTarget& target, FieldMesh& coarse) {
  std::vector<int> nearest;
  QuadPairs pairs = pair_triangles(coarse.surface, deviations_deg[0]);
  fit_surface(target, pairs, {.rounds = 4}, coarse, nearest);
  pairs = pair_triangles(coarse.surface, deviations_deg[1]);
  fit_surface(target, pairs, {.rounds = 2, .emphasis = 0.5}, coarse, nearest);
  choose_diagonals(*target.tree, pairs, coarse.surface);
  pairs = pair_triangles(coarse.surface, deviations_deg[2]);
  fit_surface(target, pairs, {.rounds = 3, .emphasis = 0.5}, coarse, nearest);
  return pair_triangles(coarse.surface);
}

}  // namespace

struct QuadRemesher::State {
  const Surface& in;
  FieldMesh fields;  // sizes: relative × the edge length guessed
  double edge_mm;
  std::shared_ptr<const TriangleTree> tree;  // of the input; none: the target makes it
  std::unique_ptr<FitTarget> target;
  std::vector<FieldGraph> levels;
  CrossField crosses;

  void prepare() {
    fields = adapt(fields, field_share);
    levels = field_hierarchy(fields);
    crosses = cross_field(levels);
  }

  // Another edge length: the fields follow, and get a new resolution when theirs no longer fits.
  void set_edge(double wanted_mm) {
    const double factor = wanted_mm / edge_mm;
    edge_mm = wanted_mm;
    fields.size_mm *= factor;
    scale_sizes(levels, factor);
    resolution *= factor;
    if (resolution > 0.8 && resolution < 1.6) return;
    resolution = 1;
    prepare();
  }

  FieldMesh extract() const { return extract_lattice(fields, crosses[0], position_field(levels, crosses)); }

  double resolution = 1;  // wanted edge length over that the field mesh was made for
};

QuadRemesher::QuadRemesher(const Surface& in, const Eigen::VectorXd& relative, double edge_mm,
                           std::shared_ptr<const TriangleTree> tree)
    : state_(new State{in, {}, edge_mm, std::move(tree), nullptr, {}, {}}) {
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(in.points.rows());
  state_->fields = field_mesh(in, edge_mm * (relative.size() > 0 ? relative : ones));
  state_->prepare();
}

QuadRemesher::~QuadRemesher() = default;

void QuadRemesher::refine(const Points& places, double factor, double radius_mm) {
  State& s = *state_;
  Eigen::VectorXd& size = s.fields.size_mm;
  const TriangleTree tree(s.fields.surface.points, s.fields.surface.triangles);
  std::vector<double> wanted(places.rows());
  for (Eigen::Index i = 0; i < places.rows(); ++i) {
    const TriangleTree::Hit hit = tree.closest(Eigen::Vector3d(places.row(i).transpose()));
    wanted[i] = factor * size(s.fields.surface.triangles(hit.triangle, 0));
  }
#pragma omp parallel for schedule(static)
  for (Eigen::Index p = 0; p < size.size(); ++p)
    for (Eigen::Index i = 0; i < places.rows(); ++i) {
      const double away = (s.fields.surface.points.row(p) - places.row(i)).norm();
      size(p) = std::min(size(p), wanted[i] + size_growth * std::max(0.0, away - radius_mm));
    }
  s.resolution = 1;
  s.fields = adapt(s.fields, field_share);
  // Points made by splitting chords go to the input.
  if (!s.target) s.target = std::make_unique<FitTarget>(s.in, samples_per_triangle * 1000, s.tree);
  project(*s.target, s.fields.surface);
  s.levels = field_hierarchy(s.fields);
  s.crosses = cross_field(s.levels);
}

QuadMesh QuadRemesher::make(const QuadTarget& target) {
  State& s = *state_;
  FieldMesh best;
  double best_miss = std::numeric_limits<double>::infinity();
  if (target.triangles == 0 && target.faces == 0) s.set_edge(target.edge_mm);
  for (int attempt = 0; attempt < most_tries; ++attempt) {
    FieldMesh coarse = s.extract();
    double miss = 0, factor = 1;
    if (target.triangles > 0) {
      const double share = misfit(static_cast<int>(coarse.surface.triangles.rows()), target.triangles);
      miss = share > 1 ? 1 + share : 1 - share;  // too many is worse than any too few
      factor = std::sqrt(share / (0.5 + 0.5 * least_share));
      if (share <= 1 && share >= least_share) miss = 0;
    } else if (target.faces > 0) {
      const double share = misfit(pair_triangles(coarse.surface, deviations_deg[1]).faces(), target.faces);
      factor = std::sqrt(share);
      miss = std::abs(share - 1) <= faces_tolerance ? 0 : std::abs(share - 1);
    }
    if (miss < best_miss) {
      best_miss = miss;
      best = std::move(coarse);
    }
    if (best_miss == 0) break;
    s.set_edge(s.edge_mm * factor);
  }
  if (!s.target)
    s.target = std::make_unique<FitTarget>(s.in, samples_per_triangle * static_cast<int>(best.surface.triangles.rows()),
                                           s.tree);
  QuadPairs pairs = fit_quads(*s.target, best);
  return {std::move(best.surface), std::move(pairs), std::move(best.size_mm)};
}

void QuadRemesher::even_out(const std::vector<Eigen::Vector3d>& places, QuadMesh& mesh) const {
  meshing::even_out(*state_->target, places, state_->edge_mm, mesh.surface);
  mesh.pairs = pair_triangles(mesh.surface);
}

double edge_for_triangles(const Surface& in, const Eigen::VectorXd& relative, int triangles) {
  double cells = 0;
  for (Eigen::Index t = 0; t < in.triangles.rows(); ++t) {
    const Eigen::RowVector3d a = in.points.row(in.triangles(t, 0));
    const Eigen::RowVector3d u = in.points.row(in.triangles(t, 1)) - a, v = in.points.row(in.triangles(t, 2)) - a;
    double size = 1;
    if (relative.size() > 0)
      size = (relative(in.triangles(t, 0)) + relative(in.triangles(t, 1)) + relative(in.triangles(t, 2))) / 3;
    cells += 0.5 * u.cross(v).norm() / (size * size);
  }
  return std::sqrt(2 * cells / triangles);
}

}  // namespace supine::meshing
