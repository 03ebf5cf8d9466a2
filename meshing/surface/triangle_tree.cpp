// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/surface/triangle_tree.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>

namespace supine::meshing {
namespace {
constexpr int leaf_size = 4;
constexpr int deepest = 64;
constexpr Eigen::Index block_size = 512;  // of points that one thread takes one after the other

// Without branches: this is the hot loop.
double squared_distance(const Eigen::AlignedBox3d& box, const Eigen::Vector3d& at) {
  double sum = 0;
  for (int i = 0; i < 3; ++i) {
    const double away = std::max(0.0, std::max(box.min()[i] - at[i], at[i] - box.max()[i]));
    sum += away * away;
  }
  return sum;
}

bool overlap(const Eigen::AlignedBox3d& a, const Eigen::AlignedBox3d& b) {
  for (int i = 0; i < 3; ++i)
    if (a.min()[i] > b.max()[i] || b.min()[i] > a.max()[i]) return false;
  return true;
}
}  // namespace

Eigen::Vector3d closest_weights(const Eigen::Vector3d& p, const std::array<Eigen::Vector3d, 3>& abc) {
  const Eigen::Vector3d ab = abc[1] - abc[0], ac = abc[2] - abc[0], ap = p - abc[0];
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
  const Eigen::Vector3d bp = p - abc[1];
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    const double v = d1 - d3 > 0 ? d1 / (d1 - d3) : 0;
    return {1 - v, v, 0};
  }
  const Eigen::Vector3d cp = p - abc[2];
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    const double w = d2 - d6 > 0 ? d2 / (d2 - d6) : 0;
    return {1 - w, 0, w};
  }
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double sum = (d4 - d3) + (d5 - d6), w = sum > 0 ? (d4 - d3) / sum : 0;
    return {0, 1 - w, w};
  }
  const double sum = va + vb + vc;
  return {va / sum, vb / sum, vc / sum};
}

TriangleTree::TriangleTree(const Points& points, const Triangles& triangles) : order_(triangles.rows()) {
  const auto count = static_cast<int>(triangles.rows());
  std::vector<Eigen::AlignedBox3d> boxes(count);
  Points centres(count, 3);
  for (int t = 0; t < count; ++t) {
    for (int c = 0; c < 3; ++c) boxes[t].extend(points.row(triangles(t, c)).transpose());
    centres.row(t) = boxes[t].center().transpose();
  }
  std::iota(order_.begin(), order_.end(), 0);
  nodes_.reserve(count);
  nodes_.emplace_back();
  split(0, 0, count, centres, boxes);
  corners_.resize(count);
  for (int i = 0; i < count; ++i)
    for (int c = 0; c < 3; ++c) corners_[i][c] = points.row(triangles(order_[i], c)).transpose();
  place_.resize(count);
  for (int i = 0; i < count; ++i) place_[order_[i]] = i;
}

void TriangleTree::split(int node, int first, int last, const Points& centres,
                         const std::vector<Eigen::AlignedBox3d>& boxes) {
  Eigen::AlignedBox3d box, middle;
  for (int i = first; i < last; ++i) {
    box.extend(boxes[order_[i]]);
    middle.extend(centres.row(order_[i]).transpose());
  }
  nodes_[node] = {box, first, last - first};
  if (last - first <= leaf_size) return;
  int axis = 0;
  middle.sizes().maxCoeff(&axis);
  const int half = (first + last) / 2;
  std::nth_element(order_.begin() + first, order_.begin() + half, order_.begin() + last, [&](int a, int b) {
    return centres(a, axis) != centres(b, axis) ? centres(a, axis) < centres(b, axis) : a < b;
  });
  const auto child = static_cast<int>(nodes_.size());
  nodes_.resize(nodes_.size() + 2);
  nodes_[node].first = child;
  nodes_[node].count = 0;
  split(child, first, half, centres, boxes);
  split(child + 1, half, last, centres, boxes);
}

void TriangleTree::improve(int place, const Eigen::Vector3d& at, Hit& best) const {
  const auto& abc = corners_[place];
  const Eigen::Vector3d weights = closest_weights(at, abc);
  const Eigen::Vector3d point = weights[0] * abc[0] + weights[1] * abc[1] + weights[2] * abc[2];
  const double squared = (point - at).squaredNorm();
  // Ties go to the lower number, so that the answer does not depend on the order of the walk.
  if (squared < best.squared_mm2 || (squared == best.squared_mm2 && order_[place] < best.triangle))
    best = {order_[place], point, weights, squared};
}

// A computed closest point may be nearer than the box it lies in by a rounding error; without room for that, which of
// two equally near triangles is found would depend on where the search began.
double TriangleTree::rounded_up(const Hit& best) { return best.squared_mm2 * (1 + 1e-12); }

TriangleTree::Hit TriangleTree::search(const Eigen::Vector3d& at, Hit best) const {
  std::array<std::pair<int, double>, deepest> stack;
  int top = 0;
  stack[top++] = {0, squared_distance(nodes_[0].box, at)};
  while (top > 0) {
    const auto [index, distance] = stack[--top];
    if (distance > rounded_up(best)) continue;
    const Node& node = nodes_[index];
    if (node.count == 0) {
      double near = squared_distance(nodes_[node.first].box, at);
      double far = squared_distance(nodes_[node.first + 1].box, at);
      int first = node.first, second = node.first + 1;
      if (far < near) {
        std::swap(near, far);
        std::swap(first, second);
      }
      if (far <= rounded_up(best)) stack[top++] = {second, far};
      if (near <= rounded_up(best)) stack[top++] = {first, near};
      continue;
    }
    for (int i = node.first; i < node.first + node.count; ++i) improve(i, at, best);
  }
  return best;
}

TriangleTree::Hit TriangleTree::search_from(const Eigen::Vector3d& at, int triangle) const {
  Hit start;
  if (triangle >= 0) improve(place_[triangle], at, start);
  return search(at, start);
}

TriangleTree::Hit TriangleTree::closest(const Eigen::Vector3d& at, double within_mm) const {
  Hit start;
  start.squared_mm2 = within_mm * within_mm;
  return search(at, start);
}

std::vector<TriangleTree::Hit> TriangleTree::closest(const Points& at, const std::vector<int>& near) const {
  std::vector<Hit> hits(at.rows());
#pragma omp parallel for schedule(dynamic, 1)
  for (Eigen::Index block = 0; block < at.rows(); block += block_size)
    for (Eigen::Index p = block; p < std::min(at.rows(), block + block_size); ++p) {
      const int last = p > block ? hits[p - 1].triangle : -1;
      hits[p] = search_from(at.row(p).transpose(), near.empty() ? last : near[p]);
    }
  return hits;
}

Eigen::VectorXd TriangleTree::distances_mm(const Points& at) const {
  Eigen::VectorXd result(at.rows());
#pragma omp parallel for schedule(dynamic, 1)
  for (Eigen::Index block = 0; block < at.rows(); block += block_size)
    for (Eigen::Index p = block, last = -1; p < std::min(at.rows(), block + block_size); ++p) {
      const Hit hit = search_from(at.row(p).transpose(), static_cast<int>(last));
      result(p) = std::sqrt(hit.squared_mm2);
      last = hit.triangle;
    }
  return result;
}

Eigen::AlignedBox3d TriangleTree::box_of(int place) const {
  const auto& [a, b, c] = corners_[place];
  return {a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c)};
}

// Pairs of a leaf's triangles with each other and with those of later leaves.
void TriangleTree::pairs_of_leaf(const Node& leaf, const std::function<bool(int, int)>& keep,
                                 std::vector<std::pair<int, int>>& found) const {
  std::array<Eigen::AlignedBox3d, leaf_size> own;
  for (int i = 0; i < leaf.count; ++i) own[i] = box_of(leaf.first + i);
  std::array<int, deepest> stack;
  int top = 0;
  stack[top++] = 0;
  while (top > 0) {
    const Node& node = nodes_[stack[--top]];
    if (!overlap(node.box, leaf.box)) continue;
    if (node.count == 0) {
      stack[top++] = node.first;
      stack[top++] = node.first + 1;
      continue;
    }
    for (int j = std::max(node.first, leaf.first); j < node.first + node.count; ++j) {
      const Eigen::AlignedBox3d other = box_of(j);
      if (!overlap(leaf.box, other)) continue;
      for (int i = 0; i < leaf.count && leaf.first + i < j; ++i)
        if (overlap(own[i], other) && keep(order_[leaf.first + i], order_[j]))
          found.emplace_back(std::minmax(order_[leaf.first + i], order_[j]));
    }
  }
}

std::vector<std::pair<int, int>> TriangleTree::pairs(const std::function<bool(int, int)>& keep) const {
  std::vector<std::pair<int, int>> all;
#pragma omp parallel
  {
    std::vector<std::pair<int, int>> found;
#pragma omp for schedule(dynamic, block_size) nowait
    for (std::size_t n = 0; n < nodes_.size(); ++n)
      if (nodes_[n].count > 0) pairs_of_leaf(nodes_[n], keep, found);
#pragma omp critical
    all.insert(all.end(), found.begin(), found.end());
  }
  std::sort(all.begin(), all.end());
  return all;
}

std::vector<int> TriangleTree::overlapping(const Eigen::AlignedBox3d& box) const {
  std::vector<int> found, stack{0};
  while (!stack.empty()) {
    const Node& node = nodes_[stack.back()];
    stack.pop_back();
    if (!node.box.intersects(box)) continue;
    if (node.count == 0) {
      stack.push_back(node.first);
      stack.push_back(node.first + 1);
      continue;
    }
    for (int i = node.first; i < node.first + node.count; ++i)
      if (box_of(i).intersects(box)) found.push_back(order_[i]);
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace supine::meshing
