// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <cstdint>
#include <vector>

#include "common/arrays.h"

namespace supine::simulation {

/// Square over the dofs of a mesh; dof 3 node + axis.
using SparseMatrix = Eigen::SparseMatrix<double, Eigen::ColMajor, int>;

/// Sparsity of 3-by-3 node blocks: of a mesh, where nodes are coupled that share a cell, made once; or of any
/// couplings.
class Pattern {
 public:
  /// @param cells  #C by nodes per cell, in [0, nodes)   @param nodes  of the mesh
  Pattern(const Indices& cells, Eigen::Index nodes);
  /// The same, with the nodes of each row of @p more coupled as well.
  Pattern(const Indices& cells, const Indices& more, Eigen::Index nodes);
  /// @param adjacent  for each node those it is coupled with, in any order and as often as they like; symmetric
  explicit Pattern(std::vector<std::vector<int>> adjacent);

  Eigen::Index dofs() const { return 3 * nodes_; }
  /// A matrix with this pattern and zero values, stored in the order that block() says.
  SparseMatrix zero_matrix() const;
  /// Offset of block (a, b)'s first entry in the value array; its column k, row i is at offset + k * stride(b) + i.
  /// @pre  nodes a and b are coupled
  int block(int a, int b) const;
  /// Entries per column of node b.
  int stride(int b) const { return 3 * (first_[b + 1] - first_[b]); }

 private:
  Eigen::Index nodes_;
  std::vector<int> first_;      // nodes + 1
  std::vector<int> neighbour_;  // sorted within each node
};

/// Elements of one kind: nodes, value positions, and clusters of neighbouring elements in colours. No two clusters of a
/// colour share a node, so that they may add to the sums at the same time, each in its own order: every sum has one
/// order whatever the number of threads, and there are few colours to wait for.
class Elements {
 public:
  /// Rows of nodes().
  using Cluster = std::vector<int>;

  /// @param nodes    #E by nodes per element; those of one element share a cell of the pattern
  /// @param pattern  of the mesh; not kept
  Elements(Indices nodes, const Pattern& pattern);

  const Indices& nodes() const { return nodes_; }
  Eigen::Index count() const { return nodes_.rows(); }
  /// By colour; every element is in one cluster.
  const std::vector<std::vector<Cluster>>& colours() const { return colours_; }
  /// Positions of the n × n node blocks of element @p e, row-major over (a, b).
  const int* blocks(int e) const {
    return blocks_.data() + static_cast<std::size_t>(e) * nodes_.cols() * nodes_.cols();
  }
  /// Strides of the n column nodes of element @p e.
  const int* strides(int e) const { return strides_.data() + static_cast<std::size_t>(e) * nodes_.cols(); }

 private:
  void colour_clusters(std::vector<Cluster> clusters, Eigen::Index mesh_nodes);

  Indices nodes_;
  std::vector<int> blocks_, strides_;
  std::vector<std::vector<Cluster>> colours_;
};

/// What a pass over the elements is to compute.
struct Demand {
  bool energy = false;
  bool residual = false;
  bool tangent = false;            ///< ∂r/∂x
  bool reference_tangent = false;  ///< ∂r/∂X
  bool convex = false;  ///< tangent without the negative curvature of tissue and skin: of descent far from the answer
};

/// The sums over all terms. Matrices must have the pattern; sizes are set once and reused.
struct Sums {
  double energy = 0;                        ///< mN mm
  Eigen::VectorXd residual;                 ///< r = ∂(energy)/∂x, mN, dof 3 node + axis
  SparseMatrix tangent, reference_tangent;  ///< mN/mm
  SparseMatrix contact;  ///< what touches adds to ∂r/∂x outside of the pattern, in full node blocks; empty for nothing
  double min_det_f = 1;  ///< smallest det F over quadrature points; <= 0 where an element is inverted
  int min_cell = -1;     ///< where
  bool valid = true;     ///< no element is inverted, in x or in X
  std::vector<double> element_energy, element_det_f;  ///< buffers of add_elements

  /// Zero, of the pattern's size.
  explicit Sums(const Pattern& pattern);
  /// Zero for what is demanded; what is not keeps its values.
  void clear(const Demand& demand);
  /// ∂r/∂x: tangent + contact.
  SparseMatrix whole_tangent() const;
};

/// Larger than any det F: the smallest of no elements.
inline constexpr double no_det_f = 1e300;

/// Contribution of one element, dof 3 node + axis; units as of Sums.
template <int Nodes>
struct Local {
  static constexpr int dofs = 3 * Nodes;
  double energy = 0;
  double min_det_f = no_det_f;  ///< smallest det F of the element; <= 0 marks it inverted and its sums are void
  Eigen::Matrix<double, dofs, 1> residual;
  Eigen::Matrix<double, dofs, dofs> tangent, reference_tangent;
};

/// Adds kernel(element, local) of every element to the sums; the kernel fills what is demanded, from zero. Where the
/// reference tangent is demanded it may fill the tangent as well, which is dropped unless demanded.
/// @param sums    of the pattern of @p elements
/// @param kernel  void(int element, Local<Nodes>& local), called from several threads at once; must not throw
/// @post  the same bytes for any number of threads; sums.valid is false where an element is inverted
template <int Nodes, class Kernel>
void add_elements(const Elements& elements, const Demand& demand, Sums& sums, const Kernel& kernel) {
  constexpr int n = Nodes;
  sums.element_energy.resize(elements.count());
  sums.element_det_f.resize(elements.count());
  const auto scatter = [](const Eigen::Matrix<double, 3 * n, 3 * n>& local, const int* blocks, const int* strides,
                          double* values) {
    for (int b = 0; b < n; ++b)
      for (int a = 0; a < n; ++a)
        for (int k = 0; k < 3; ++k) {
          double* column = values + blocks[a * n + b] + k * strides[b];
          for (int i = 0; i < 3; ++i) column[i] += local(3 * a + i, 3 * b + k);
        }
  };
  const auto add_element = [&](int e) {
    Local<n> local;
    local.residual.setZero();
    if (demand.tangent || demand.reference_tangent) local.tangent.setZero();
    if (demand.reference_tangent) local.reference_tangent.setZero();
    kernel(e, local);
    sums.element_energy[e] = local.energy;
    sums.element_det_f[e] = local.min_det_f;
    if (demand.residual)
      for (int a = 0; a < n; ++a)
        sums.residual.template segment<3>(3 * elements.nodes()(e, a)) += local.residual.template segment<3>(3 * a);
    if (demand.tangent) scatter(local.tangent, elements.blocks(e), elements.strides(e), sums.tangent.valuePtr());
    if (demand.reference_tangent)
      scatter(local.reference_tangent, elements.blocks(e), elements.strides(e), sums.reference_tangent.valuePtr());
  };
  for (const auto& colour : elements.colours()) {
    const int clusters = static_cast<int>(colour.size());
#pragma omp parallel for schedule(static) if (clusters > 1)
    for (int c = 0; c < clusters; ++c)
      for (const int e : colour[c]) add_element(e);
  }
  for (int e = 0; e < elements.count(); ++e) {
    sums.energy += sums.element_energy[e];
    if (sums.element_det_f[e] < sums.min_det_f) {
      sums.min_det_f = sums.element_det_f[e];
      sums.min_cell = e;
    }
  }
  if (!(sums.min_det_f > 0)) sums.valid = false;
}

}  // namespace supine::simulation
