// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/arrays.h"

namespace supine::simulation {

/// Where the samples of the skin are in one shape, one row each.
struct SkinShape {
  Points place;   ///< mm
  Points normal;  ///< unit, outward
};

/// Six points on each face of the skin (degree 4; Dunavant 1985), on quadratic faces on the curved face: what is asked
/// whether it touches other skin, and what it is asked of.
class SkinSamples {
 public:
  static constexpr int per_face = 6;
  static constexpr int most_nodes = 6;  ///< of a face
  using Row = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, 3 * most_nodes>;
  using Block = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 3 * most_nodes, 3 * most_nodes>;

  /// @param faces   #F by 3 or 6, outward normals   @param imaged  nodes, #N by 3, mm
  SkinSamples(Indices faces, const Points& imaged);

  int count() const { return per_face * static_cast<int>(faces_.rows()); }
  int nodes_per_face() const { return static_cast<int>(faces_.cols()); }
  const Indices& faces() const { return faces_; }
  static int face_of(int sample) { return sample / per_face; }
  /// Imaged area that a sample stands for, mm².
  double area_mm2(int sample) const { return area_mm2_[sample]; }
  /// How far the samples of a face reach, mm: 0.6 edges of an equilateral triangle of its imaged area.
  double reach_mm(int face) const { return reach_mm_[face]; }
  /// Shape functions at a sample, of its face's nodes.
  double value(int sample, int node) const { return value_(sample % per_face, node); }

  SkinShape at(const Points& x) const;
  /// Area that a sample stands for in the shape @p x, mm².
  double area_mm2(int sample, const Points& x) const;

  /// Derivatives of a sample's unit normal with respect to the nodes of its face.
  struct Normal {
    Row by_nodes;    ///< ∂n/∂x, 3 by 3 n
    Row of_product;  ///< ∂(e1 × e2)/∂x, 3 by 3 n
    Eigen::Vector3d unit;
    double size = 0;  ///< |e1 × e2|
  };
  Normal normal(int sample, const Points& x) const;
  /// ∂²(along · n)/∂x², 3 n by 3 n; @p at is normal(sample, …).
  Block normal_curvature(int sample, const Normal& at, const Eigen::Vector3d& along) const;

 private:
  Eigen::Matrix<double, 3, 2> edges(int sample, const Points& x) const;

  Indices faces_;
  Eigen::MatrixXd value_, by_first_, by_second_;  // per_face by n: N_a and its derivatives
  Eigen::VectorXd weight_;                        // per_face: parent measure
  std::vector<double> area_mm2_, reach_mm_;       // per sample, per face
};

}  // namespace supine::simulation
