// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/elements/assembly.h"

#include <algorithm>

namespace supine::simulation {

namespace {

using Adjacent = std::vector<std::vector<int>>;

void couple(const Indices& cells, Adjacent& adjacent) {
  for (Eigen::Index c = 0; c < cells.rows(); ++c)
    for (Eigen::Index a = 0; a < cells.cols(); ++a)
      for (Eigen::Index b = 0; b < cells.cols(); ++b) adjacent[cells(c, a)].push_back(cells(c, b));
}

Adjacent nodes_that_share(const Indices& cells, const Indices& more, Eigen::Index nodes) {
  Adjacent adjacent(nodes);
  couple(cells, adjacent);
  couple(more, adjacent);
  return adjacent;
}

}  // namespace

Pattern::Pattern(const Indices& cells, Eigen::Index nodes) : Pattern(cells, Indices(), nodes) {}

Pattern::Pattern(const Indices& cells, const Indices& more, Eigen::Index nodes)
    : Pattern(nodes_that_share(cells, more, nodes)) {}

Pattern::Pattern(std::vector<std::vector<int>> adjacent)
    : nodes_(static_cast<Eigen::Index>(adjacent.size())), first_(nodes_ + 1, 0) {
  for (Eigen::Index n = 0; n < nodes_; ++n) {
    auto& list = adjacent[n];
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
    neighbour_.insert(neighbour_.end(), list.begin(), list.end());
    first_[n + 1] = static_cast<int>(neighbour_.size());
  }
}

SparseMatrix Pattern::zero_matrix() const {
  SparseMatrix matrix(dofs(), dofs());
  matrix.resizeNonZeros(9 * static_cast<Eigen::Index>(neighbour_.size()));
  int* outer = matrix.outerIndexPtr();
  int* inner = matrix.innerIndexPtr();
  int position = 0;
  for (Eigen::Index b = 0; b < nodes_; ++b)
    for (int k = 0; k < 3; ++k) {
      *outer++ = position;
      for (int s = first_[b]; s < first_[b + 1]; ++s)
        for (int i = 0; i < 3; ++i) inner[position++] = 3 * neighbour_[s] + i;
    }
  *outer = position;
  std::fill_n(matrix.valuePtr(), position, 0.0);
  return matrix;
}

int Pattern::block(int a, int b) const {
  const auto begin = neighbour_.begin() + first_[b], end = neighbour_.begin() + first_[b + 1];
  const auto rank = static_cast<int>(std::lower_bound(begin, end, a) - begin);
  return 9 * first_[b] + 3 * rank;
}

namespace {

constexpr std::size_t cluster_size = 32;  // elements: enough work per task, few enough for many tasks per colour

/// Elements at each node, concatenated: those of node n are at first[n] to first[n + 1].
struct Incidence {
  std::vector<int> first, element;
  Incidence(const Indices& nodes, Eigen::Index mesh_nodes) : first(mesh_nodes + 1, 0), element(nodes.size()) {
    for (const int node : nodes.reshaped()) ++first[node + 1];
    for (Eigen::Index n = 0; n < mesh_nodes; ++n) first[n + 1] += first[n];
    std::vector<int> next(first.begin(), first.end() - 1);
    for (Eigen::Index e = 0; e < nodes.rows(); ++e)
      for (const int node : nodes.row(e)) element[next[node]++] = static_cast<int>(e);
  }
};

/// Compact clusters, each grown from the first element that is left over its neighbours.
std::vector<Elements::Cluster> clusters_of_neighbours(const Indices& nodes, Eigen::Index mesh_nodes) {
  const Incidence at(nodes, mesh_nodes);
  std::vector<char> seen(nodes.rows(), 0);
  std::vector<Elements::Cluster> clusters;
  for (int start = 0; start < nodes.rows(); ++start) {
    if (seen[start]) continue;
    Elements::Cluster cluster = {start};
    seen[start] = 1;
    for (std::size_t grown = 0; grown < cluster.size(); ++grown)
      for (const int node : nodes.row(cluster[grown]))
        for (int i = at.first[node]; i < at.first[node + 1] && cluster.size() < cluster_size; ++i)
          if (!seen[at.element[i]]) {
            seen[at.element[i]] = 1;
            cluster.push_back(at.element[i]);
          }
    clusters.push_back(std::move(cluster));
  }
  return clusters;
}

}  // namespace

Elements::Elements(Indices nodes, const Pattern& pattern) : nodes_(std::move(nodes)) {
  const Eigen::Index n = nodes_.cols();
  blocks_.reserve(count() * n * n);
  strides_.reserve(count() * n);
  for (Eigen::Index e = 0; e < count(); ++e)
    for (Eigen::Index a = 0; a < n; ++a) {
      strides_.push_back(pattern.stride(nodes_(e, a)));
      for (Eigen::Index b = 0; b < n; ++b) blocks_.push_back(pattern.block(nodes_(e, a), nodes_(e, b)));
    }

  colour_clusters(clusters_of_neighbours(nodes_, pattern.dofs() / 3), pattern.dofs() / 3);
}

void Elements::colour_clusters(std::vector<Cluster> clusters, Eigen::Index mesh_nodes) {
  constexpr int word_bits = 64;
  // Greedy: the lowest colour that no cluster at any of the nodes has taken; one bit per colour, word by word.
  std::vector<std::vector<std::uint64_t>> taken(mesh_nodes, std::vector<std::uint64_t>(1, 0));
  for (Cluster& cluster : clusters) {
    int colour = -1;
    for (std::size_t word = 0; colour < 0; ++word) {
      std::uint64_t used = 0;
      for (const int e : cluster)
        for (const int node : nodes_.row(e)) {
          auto& words = taken[node];
          if (words.size() <= word) words.resize(word + 1, 0);
          used |= words[word];
        }
      if (~used != 0) colour = static_cast<int>(word_bits * word) + __builtin_ctzll(~used);
    }
    for (const int e : cluster)
      for (const int node : nodes_.row(e)) taken[node][colour / word_bits] |= std::uint64_t{1} << (colour % word_bits);
    if (static_cast<int>(colours_.size()) <= colour) colours_.resize(colour + 1);
    colours_[colour].push_back(std::move(cluster));
  }
}

Sums::Sums(const Pattern& pattern)
    : residual(Eigen::VectorXd::Zero(pattern.dofs())),
      tangent(pattern.zero_matrix()),
      reference_tangent(pattern.zero_matrix()) {}

SparseMatrix Sums::whole_tangent() const {
  if (contact.nonZeros() == 0) return tangent;
  return tangent + contact;
}

void Sums::clear(const Demand& demand) {
  energy = 0;
  min_det_f = no_det_f;
  min_cell = -1;
  valid = true;
  if (demand.residual) residual.setZero();
  if (demand.tangent) {
    std::fill_n(tangent.valuePtr(), tangent.nonZeros(), 0.0);
    contact.resize(0, 0);
  }
  if (demand.reference_tangent) std::fill_n(reference_tangent.valuePtr(), reference_tangent.nonZeros(), 0.0);
}

}  // namespace supine::simulation
