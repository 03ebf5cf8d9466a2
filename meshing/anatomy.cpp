// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/anatomy.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "common/error.h"
#include "meshing/anatomy/cleft.h"
#include "meshing/anatomy/foot.h"
#include "meshing/anatomy/object_frame.h"
#include "meshing/topology.h"
#include "segmentation/tissue.h"

namespace supine::meshing {
namespace {

using reconstruction::Region;

constexpr double sample_mm = 3;          // size of the pieces of skin the foot is read from
constexpr double smallest_mound_mm = 3;  // over the rim's thickness

bool is_inner(int region) {
  return region == static_cast<int>(Region::inner) || region == static_cast<int>(Region::ligament);
}

bool is_skin(int region) { return region == static_cast<int>(Region::skin); }

struct Piece {
  Eigen::Vector3d point;
  double area_mm2;
};

// Cuts face f into triangles of equal corners' area no longer than sample_mm.
void cut_face(const TetMesh& mesh, Eigen::Index f, std::vector<Piece>& pieces) {
  const Eigen::RowVector3d a = mesh.points.row(mesh.faces(f, 0));
  const Eigen::RowVector3d u = mesh.points.row(mesh.faces(f, 1)) - a, v = mesh.points.row(mesh.faces(f, 2)) - a;
  const int n = std::max(1, static_cast<int>(std::ceil(std::max({u.norm(), v.norm(), (u - v).norm()}) / sample_mm)));
  const double area = u.cross(v).norm() / 2 / (n * n);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; i + j < n; ++j) {
      const auto add = [&](double s, double t) {
        pieces.push_back({face_point(mesh.points, mesh.faces, f, s / n, t / n).transpose(), area});
      };
      add(i + 1.0 / 3, j + 1.0 / 3);
      if (i + j + 1 < n) add(i + 2.0 / 3, j + 2.0 / 3);
    }
  }
}

std::vector<Piece> pieces_of(const TetMesh& mesh, bool (*wanted)(int), const char* what) {
  std::vector<Piece> pieces;
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    if (wanted(mesh.region[f])) cut_face(mesh, f, pieces);
  }
  if (pieces.empty()) {
    throw InputError(fmt::format("the mesh has no boundary triangles of region {}; the anatomy needs them", what));
  }
  return pieces;
}

// Directions from the outward axis: head is +z as nearly as it can be; lateral follows from the side.
void set_directions(Anatomy& anatomy, const Eigen::Vector3d& outward) {
  anatomy.outward = outward.normalized();
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  if (std::abs(anatomy.outward.z()) > 0.95) up = Eigen::Vector3d::UnitY();  // not a patient; any choice will do
  anatomy.head = (up - up.dot(anatomy.outward) * anatomy.outward).normalized();
  anatomy.lateral = (anatomy.side == "left" ? 1 : -1) * anatomy.head.cross(anatomy.outward);
}

// The point of the muscle below (or above) p along the outward axis.
Eigen::Vector3d on_muscle(const Anatomy& anatomy, Eigen::Vector3d p) {
  for (int i = 0; i < 20; ++i) {
    const MuscleDistance::Sample s = anatomy.muscle->at(p);
    const double slope = std::max(0.2, s.gradient.dot(anatomy.outward));
    p -= s.value_mm / slope * anatomy.outward;
    if (std::abs(s.value_mm) < 1e-9) break;
  }
  return p;
}

Eigen::Vector2d in_plane(const Anatomy& anatomy, const Eigen::Vector3d& p) {
  const Eigen::Vector3d d = p - anatomy.foot_centre_mm;
  return {d.dot(anatomy.lateral), d.dot(anatomy.head)};
}

// Centre of what stands highest over the muscle: inside the mound whatever its shape.
Eigen::Vector3d mound_centre(const std::vector<Piece>& skin, const std::vector<double>& thickness) {
  const double height = *std::max_element(thickness.begin(), thickness.end());
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double weight = 0;
  for (std::size_t i = 0; i < skin.size(); ++i) {
    const double w = skin[i].area_mm2 * std::max(0.0, thickness[i] - height / 2);
    sum += w * skin[i].point;
    weight += w;
  }
  return sum / weight;
}

// Finds the foot, then turns the outward axis to the mean normal under it, until the two agree.
void set_foot(Anatomy& anatomy, const std::vector<Piece>& skin, const std::vector<Piece>& inner) {
  std::vector<double> thickness(skin.size());
  for (std::size_t i = 0; i < skin.size(); ++i) thickness[i] = anatomy.muscle->value(skin[i].point);
  Eigen::Vector3d outward = Eigen::Vector3d::Zero();
  for (const Piece& p : inner) outward += p.area_mm2 * anatomy.muscle->at(p.point).gradient;
  set_directions(anatomy, outward);
  anatomy.foot_centre_mm = on_muscle(anatomy, mound_centre(skin, thickness));
  for (int round = 0; round < 3; ++round) {
    std::vector<SkinSample> skin_samples;
    for (std::size_t i = 0; i < skin.size(); ++i) {
      skin_samples.push_back({in_plane(anatomy, skin[i].point), thickness[i], skin[i].area_mm2});
    }
    std::vector<Eigen::Vector2d> inner_places;
    for (const Piece& p : inner) inner_places.push_back(in_plane(anatomy, p.point));
    const Foot foot = find_foot(skin_samples, inner_places, Eigen::Vector2d::Zero());
    anatomy.foot_fourier = foot.fourier;
    anatomy.foot_radius_mm = foot.fourier[0];
    anatomy.rim_thickness_mm = foot.rim_thickness_mm;
    anatomy.foot_centre_mm = on_muscle(
        anatomy, anatomy.foot_centre_mm + foot.centre_mm.x() * anatomy.lateral + foot.centre_mm.y() * anatomy.head);
    outward.setZero();
    for (const Piece& p : inner) {
      if (anatomy.from_foot_mm(in_plane(anatomy, p.point) / anatomy.foot_radius_mm) < 0) {
        outward += p.area_mm2 * anatomy.muscle->at(p.point).gradient;
      }
    }
    if (round < 2) set_directions(anatomy, outward);
  }
}

void set_points(Anatomy& anatomy, const TetMesh& mesh) {
  const Eigen::Index count = mesh.points.rows();
  anatomy.q.resize(count, 2);
  anatomy.muscle_normal.resize(count, 3);
  anatomy.thickness_mm.resize(count);
#pragma omp parallel for schedule(static)
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Vector3d p = mesh.points.row(i).transpose();
    const MuscleDistance::Sample s = anatomy.muscle->at(p);
    anatomy.q.row(i) = in_plane(anatomy, p).transpose() / anatomy.foot_radius_mm;
    anatomy.muscle_normal.row(i) = s.gradient.normalized().transpose();
    anatomy.thickness_mm[i] = s.value_mm;
  }
}

// Skin point nearest to the centre of the nipple tissue, or else the one furthest from the muscle inside the foot.
// Only points of the breast itself, where `own` says which those are.
int find_nipple(const Anatomy& anatomy, const TetMesh& mesh, const std::vector<char>& own) {
  const auto nipple = mesh.fraction.col(static_cast<int>(segmentation::Tissue::nipple));
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double volume = 0;
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c) {
    if (nipple[c] <= 0 || !own[mesh.cells(c, 0)]) continue;
    const double share = nipple[c] * cell_volume_mm3(mesh.points, mesh.cells, c);
    for (int k = 0; k < 4; ++k) centre += share / 4 * mesh.points.row(mesh.cells(c, k)).transpose();
    volume += share;
  }
  int best = -1;
  double best_score = -1e300;
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    if (!is_skin(mesh.region[f])) continue;
    for (int k = 0; k < 3; ++k) {
      const int p = mesh.faces(f, k);
      if (!own[p]) continue;
      const Eigen::Vector3d at = mesh.points.row(p).transpose();
      if (volume == 0 && anatomy.from_foot_mm(anatomy.q.row(p).transpose()) > 0) continue;
      const double score = volume > 0 ? -(at - centre / volume).norm() : anatomy.thickness_mm[p];
      if (score > best_score || (score == best_score && p < best)) {
        best = p;
        best_score = score;
      }
    }
  }
  return best;
}

// One breast from the pieces of skin and inner surface on its side.
Anatomy one_breast(const TetMesh& mesh, const std::string& side, const std::shared_ptr<const MuscleDistance>& muscle,
                   const std::vector<Piece>& skin, const std::vector<Piece>& inner, const std::vector<char>& own) {
  Anatomy anatomy;
  anatomy.side = side;
  anatomy.muscle = muscle;
  set_foot(anatomy, skin, inner);
  for (const Piece& p : skin) anatomy.mound_height_mm = std::max(anatomy.mound_height_mm, muscle->value(p.point));
  if (!(anatomy.mound_height_mm > anatomy.rim_thickness_mm + smallest_mound_mm)) {
    throw InputError(
        fmt::format("no mound stands over the muscle: the tissue is {:.1f} mm thick at most and {:.1f} mm at its rim; "
                    "are skin and inner surface, or the side, mixed up?",
                    anatomy.mound_height_mm, anatomy.rim_thickness_mm));
  }
  set_points(anatomy, mesh);
  anatomy.nipple_point = find_nipple(anatomy, mesh, own);
  return anatomy;
}

std::vector<Piece> on_side(const std::vector<Piece>& pieces, double sternum_x_mm, bool left) {
  std::vector<Piece> own;
  for (const Piece& p : pieces)
    if ((p.point.x() >= sternum_x_mm) == left) own.push_back(p);
  return own;
}

// What stands for both: q and the breast of each point, and what the two have in common.
Anatomy joined(Anatomy left, Anatomy right, const TetMesh& mesh, double sternum_x_mm) {
  Anatomy both = left;
  both.side = "both";
  both.sternum_x_mm = sternum_x_mm;
  both.outward = (left.outward + right.outward).normalized();
  both.foot_radius_mm = std::max(left.foot_radius_mm, right.foot_radius_mm);
  both.rim_thickness_mm = std::max(left.rim_thickness_mm, right.rim_thickness_mm);
  both.mound_height_mm = std::max(left.mound_height_mm, right.mound_height_mm);
  both.nipple_point = -1;
  both.breast.resize(mesh.points.rows());
  for (Eigen::Index i = 0; i < mesh.points.rows(); ++i) {
    both.breast[i] = mesh.points(i, 0) >= sternum_x_mm ? 0 : 1;
    if (both.breast[i] == 1) both.q.row(i) = right.q.row(i);
  }
  both.breasts.push_back(std::move(left));
  both.breasts.push_back(std::move(right));
  return both;
}

Anatomy two_breasts(const TetMesh& mesh, const std::shared_ptr<const MuscleDistance>& muscle,
                    const std::vector<Piece>& skin, const std::vector<Piece>& inner) {
  std::vector<Eigen::Vector2d> heights;
  for (const Piece& p : skin) heights.emplace_back(p.point.x(), muscle->value(p.point));
  const double sternum_x_mm = find_cleft_x(heights);
  Anatomy sides[2];
  for (const bool left : {true, false}) {
    std::vector<char> own(mesh.points.rows());
    for (Eigen::Index i = 0; i < mesh.points.rows(); ++i) own[i] = (mesh.points(i, 0) >= sternum_x_mm) == left;
    const auto own_inner = on_side(inner, sternum_x_mm, left);
    const char* name = left ? "left" : "right";
    if (own_inner.empty())
      throw InputError(fmt::format("the {} breast (x {} {:.1f} mm) has no boundary triangles of region inner", name,
                                   left ? ">=" : "<", sternum_x_mm));
    sides[left ? 0 : 1] = one_breast(mesh, name, muscle, on_side(skin, sternum_x_mm, left), own_inner, own);
  }
  return joined(std::move(sides[0]), std::move(sides[1]), mesh, sternum_x_mm);
}

}  // namespace

Anatomy compute_anatomy(const TetMesh& mesh, const std::string& side, const std::string& imaged_pose) {
  if (side == "none") return object_frame(mesh, imaged_pose);
  if (side != "left" && side != "right" && side != "both") {
    throw InputError(fmt::format("side is \"{}\"; the anatomy needs left, right or both, or none for an object", side));
  }
  const std::vector<Piece> skin = pieces_of(mesh, is_skin, "skin"), inner = pieces_of(mesh, is_inner, "inner");
  Eigen::Matrix<double, 2, 3> box;
  box.row(0) = mesh.points.colwise().minCoeff();
  box.row(1) = mesh.points.colwise().maxCoeff();
  const auto muscle = std::make_shared<const MuscleDistance>(mesh.muscle, box);
  Anatomy anatomy = side == "both"
                        ? two_breasts(mesh, muscle, skin, inner)
                        : one_breast(mesh, side, muscle, skin, inner, std::vector<char>(mesh.points.rows(), 1));
  anatomy.imaged_pose = imaged_pose;
  return anatomy;
}

}  // namespace supine::meshing
