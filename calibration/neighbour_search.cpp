// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/neighbour_search.h"

#include <CGAL/Orthogonal_k_neighbor_search.h>
#include <CGAL/Search_traits_3.h>
#include <CGAL/Search_traits_adapter.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/property_map.h>

#include <algorithm>

namespace supine::calibration {
namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using Item = std::pair<Kernel::Point_3, int>;
using Traits = CGAL::Search_traits_adapter<Item, CGAL::First_of_pair_property_map<Item>, CGAL::Search_traits_3<Kernel>>;
using Search = CGAL::Orthogonal_k_neighbor_search<Traits>;

std::vector<Item> items_of(const Points& points) {
  std::vector<Item> items;
  for (int i = 0; i < points.rows(); ++i) {
    items.emplace_back(Kernel::Point_3(points(i, 0), points(i, 1), points(i, 2)), i);
  }
  return items;
}

}  // namespace

struct NeighbourSearch::Tree {
  explicit Tree(const Points& all) : points(all) {
    const auto items = items_of(all);
    tree.insert(items.begin(), items.end());
    tree.build();
  }

  const Points points;
  Search::Tree tree;
};

NeighbourSearch::NeighbourSearch(const Points& points) : tree_(std::make_unique<Tree>(points)) {}
NeighbourSearch::~NeighbourSearch() = default;
NeighbourSearch::NeighbourSearch(NeighbourSearch&&) noexcept = default;
NeighbourSearch& NeighbourSearch::operator=(NeighbourSearch&&) noexcept = default;

std::vector<std::pair<double, int>> NeighbourSearch::nearest(const Eigen::Vector3d& query, int count) const {
  Search search(tree_->tree, Kernel::Point_3(query.x(), query.y(), query.z()), static_cast<unsigned>(count));
  std::vector<std::pair<double, int>> found;
  for (const auto& [item, squared] : search) found.emplace_back(squared, item.second);
  std::sort(found.begin(), found.end());
  return found;
}

const Points& NeighbourSearch::points() const { return tree_->points; }

}  // namespace supine::calibration
