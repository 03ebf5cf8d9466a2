// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <vector>

#include "simulation/laws/hinge.h"
#include "simulation/terms/term.h"

namespace supine::simulation {

/// The flat triangles of a surface with what lies around each; a quadratic face counts as four.
struct TrianglePatches {
  Indices nodes;                            ///< #T by 6: corners, then of the neighbour on the edge from corner i to
                                            ///< i + 1 the node off the edge; a corner again where there is none
  std::vector<std::array<bool, 3>> hinged;  ///< whether there is a neighbour on that edge
  std::vector<int> face;                    ///< rows of the surface's faces
};

/// Neighbours are the two triangles that alone share an edge and run along it in opposite directions.
/// @param faces  #F by 3 or 6, corners then mid-edges in VTK's order
TrianglePatches triangle_patches(const Indices& faces);

/// Resistance of the skin to bending, as a thin plate: energy Σ ½ D Δbᵀ K Δb over its triangles, Δb the change of the
/// bends about their edges from the undeformed shape (laws/triangle_bending.h), D = Fields::skin_modulus ×
/// skin_bending, ν that of the skin. Edges where the skin ends are free. Without it a membrane in compression, and the
/// tissue under it, crease on the scale of one element.
class SkinBendingTerm : public Term {
 public:
  /// @param patches         of the skin's faces, in the order of Fields   @param pattern  couples each patch's nodes
  /// @param incompressible  ν is ½; else that of Fields::skin_poisson
  SkinBendingTerm(TrianglePatches patches, const Pattern& pattern, bool incompressible);

  void set_fields(const Fields<double>& fields) override;
  void add(const State& state, const Demand& demand, Sums& sums) const override;
  void add_parameter_derivative(const State& state, const Fields<Dual>& fields, Sums& sums) const override;

 private:
  template <class T>
  struct Plate {
    T stiffness, poisson;  // D in mN mm
  };
  template <class T>
  Plate<T> plate(const Fields<T>& fields, int triangle) const;
  Hinge<double> hinge(int triangle, int edge, const Points& points) const;
  /// About the edges of a triangle, 0 where there is no neighbour. @param points  #N by 3, mm
  Eigen::Vector3d bends(int triangle, const Points& points) const;
  /// ∂bends/∂(nodes), 1/mm, one column per edge, zero where there is no neighbour.
  Eigen::Matrix<double, 18, 3> bend_gradients(int triangle, const Points& points) const;
  void add_triangle(int triangle, const State& state, const Demand& demand, Local<6>& local) const;

  TrianglePatches patches_;
  Elements elements_;
  bool incompressible_;
  std::vector<Plate<double>> plates_;
};

}  // namespace supine::simulation
