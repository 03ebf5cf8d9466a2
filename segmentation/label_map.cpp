// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/label_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/error.h"
#include "segmentation/masks.h"

namespace supine::segmentation {
namespace {

std::string place(const Grid& grid, std::size_t n) {
  const auto row = static_cast<std::size_t>(grid.size.x()), slice = row * grid.size.y();
  const Eigen::Vector3d p = grid.point(Eigen::Vector3d(n % row, n % slice / row, n / slice));
  return fmt::format("({:.1f}, {:.1f}, {:.1f}) mm", p.x(), p.y(), p.z());
}

std::string describe(const std::map<int, Tissue>& table) {
  std::string text;
  for (const auto& [value, tissue] : table)
    text += fmt::format("{}{} = {}", text.empty() ? "" : ", ", value, tissue_names[static_cast<int>(tissue)]);
  return text;
}

[[noreturn]] void refuse_value(const GreyImage& values, const std::map<int, Tissue>& table, const std::string& name,
                               std::size_t first) {
  const float value = values.voxels[first];
  const auto count = std::count(values.voxels.begin(), values.voxels.end(), value);
  throw InputError(fmt::format(
      "{}: label value {} is in {} voxels (first at {}) but not in [image.labels] ({}); list it under its tissue, or "
      "under excluded or air if it is not part of the model",
      name, value, count, place(values.grid, first), describe(table)));
}

/// A tissue that is listed and has no voxel at all is more likely a wrong value than a wish.
void refuse_empty_tissue(const LabelImage& labels, const std::map<int, Tissue>& table, const std::string& name) {
  const TissueCounts counts = count_tissues(labels);
  for (const auto& [value, tissue] : table)
    if (tissue != Tissue::air && tissue != Tissue::excluded && counts[static_cast<int>(tissue)] == 0)
      throw InputError(fmt::format(
          "{}: empty label: {} = [{}] in [image.labels], but no voxel has it; correct the value, or take the line out",
          name, tissue_names[static_cast<int>(tissue)], value));
}

bool is_tissue(std::uint8_t value) { return is_meshed(static_cast<Tissue>(value)); }

}  // namespace

MappedLabels map_labels(const GreyImage& values, const std::map<int, Tissue>& table, const std::string& name) {
  if (table.empty())
    throw InputError(
        fmt::format("{}: the table [image.labels] is empty; list the file's label values under their tissues", name));
  const int lowest = table.begin()->first, highest = table.rbegin()->first;
  constexpr std::uint8_t unlisted = 255;
  constexpr int widest = 1 << 24;  // beyond it float does not hold every whole number
  if (lowest < -widest || highest > widest)
    throw InputError(fmt::format("{}: label value {} in [image.labels]; values lie between {} and {}", name,
                                 lowest < -widest ? lowest : highest, -widest, widest));
  std::vector<std::uint8_t> lookup(static_cast<std::size_t>(highest - lowest) + 1, unlisted);
  for (const auto& [value, tissue] : table)
    lookup[static_cast<std::size_t>(value - lowest)] = static_cast<std::uint8_t>(tissue);
  std::vector<std::uint8_t> seen(lookup.size(), 0);

  MappedLabels mapped{{values.grid, std::vector<std::uint8_t>(values.voxels.size())}, {}};
  for (std::size_t n = 0; n < values.voxels.size(); ++n) {
    const float value = values.voxels[n];
    if (!(value >= lowest && value <= highest) || value != std::floor(value)) refuse_value(values, table, name, n);
    const auto at = static_cast<std::size_t>(static_cast<int>(value) - lowest);
    if (lookup[at] == unlisted) refuse_value(values, table, name, n);
    seen[at] = 1;
    mapped.image.voxels[n] = lookup[at];
  }
  refuse_empty_tissue(mapped.image, table, name);
  for (const auto& [value, tissue] : table)
    if (!seen[static_cast<std::size_t>(value - lowest)])
      mapped.warnings.push_back(
          fmt::format("{}: label value {} ({}) does not occur", name, value, tissue_names[static_cast<int>(tissue)]));
  return mapped;
}

Mask meshed_mask(const LabelImage& labels) {
  Mask mask(labels.voxels.size());
  std::transform(labels.voxels.begin(), labels.voxels.end(), mask.begin(), is_tissue);
  return mask;
}

TissueCounts count_tissues(const LabelImage& labels) {
  std::array<std::size_t, 256> histogram{};
  for (const auto value : labels.voxels) ++histogram[value];
  TissueCounts counts;
  std::copy_n(histogram.begin(), tissue_count, counts.begin());
  return counts;
}

void check_tissues(const LabelImage& labels, const std::string& name) {
  const TissueCounts counts = count_tissues(labels);
  const auto of = [&counts](Tissue t) { return counts[static_cast<int>(t)]; };
  if (of(Tissue::adipose) + of(Tissue::gland) == 0)
    throw InputError(
        fmt::format("{}: empty label: no voxel is adipose or gland; check [image.labels] or the recipe", name));
  if (of(Tissue::muscle) == 0)
    throw InputError(fmt::format(
        "{}: empty label: no voxel is muscle, which the breast lies on; label the chest wall under it (a sheet two "
        "voxels thick is enough) and list its value under muscle",
        name));
}

void check_edge(const LabelImage& labels, const std::string& name) {
  const Grid& grid = labels.grid;
  std::string found;
  for (int axis = 0; axis < 3; ++axis) {
    for (const bool far : {false, true}) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      Eigen::Vector3i at;
      at[axis] = far ? grid.size[axis] - 1 : 0;
      std::size_t count = 0, first = 0;
      for (at[v] = 0; at[v] < grid.size[v]; ++at[v])
        for (at[u] = 0; at[u] < grid.size[u]; ++at[u]) {
          const std::size_t n = grid.index(at.x(), at.y(), at.z());
          if (is_tissue(labels.voxels[n]) && count++ == 0) first = n;
        }
      if (count > 0)
        found += fmt::format("{}{} on face {} = {} (first {} at {})", found.empty() ? "" : "; ", count, "ijk"[axis],
                             far ? grid.size[axis] - 1 : 0, tissue_names[labels.voxels[first]], place(grid, first));
    }
  }
  if (!found.empty())
    throw InputError(fmt::format(
        "{}: tissue touches the edge of the image, voxels: {}. If the body is meant to be cut there, add \"edge\" to "
        "image.cut in case.toml; otherwise label what goes on there as excluded, or take a larger volume",
        name, found));
}

void check_excluded(const LabelImage& labels, const std::string& name) {
  const Grid& grid = labels.grid;
  const auto excluded = [&](int i, int j, int k) {
    return grid.contains(i, j, k) && labels.at(i, j, k) == static_cast<std::uint8_t>(Tissue::excluded);
  };
  std::size_t count = 0, first = 0;
  for (int k = 0; k < grid.size.z(); ++k)
    for (int j = 0; j < grid.size.y(); ++j)
      for (int i = 0; i < grid.size.x(); ++i) {
        if (!is_tissue(labels.at(i, j, k))) continue;
        const bool borders = excluded(i - 1, j, k) || excluded(i + 1, j, k) || excluded(i, j - 1, k) ||
                             excluded(i, j + 1, k) || excluded(i, j, k - 1) || excluded(i, j, k + 1);
        if (borders && count++ == 0) first = grid.index(i, j, k);
      }
  if (count > 0)
    throw InputError(fmt::format(
        "{}: {} tissue voxels border on excluded (first {} at {}), so the model would end in a cut there. If that is "
        "meant, add \"excluded\" to image.cut in case.toml; otherwise give that label a tissue",
        name, count, tissue_names[labels.voxels[first]], place(grid, first)));
}

ComponentCounts count_components(const LabelImage& labels) {
  ComponentCounts result;
  const auto counts = component_counts(labels.voxels, labels.grid);
  std::copy_n(counts.begin(), tissue_count, result.tissue.begin());
  Mask meshed(labels.voxels.size());
  for (std::size_t n = 0; n < meshed.size(); ++n) meshed[n] = is_tissue(labels.voxels[n]);
  result.meshed = component_counts(meshed, labels.grid)[1];
  return result;
}

Dice dice(const LabelImage& labels, const LabelImage& truth) {
  const Eigen::Vector3d corner = (labels.grid.size - Eigen::Vector3i::Ones()).cast<double>();
  const auto apart = [&](const Eigen::Vector3d& index) {
    return (labels.grid.point(index) - truth.grid.point(index)).norm();
  };
  double distance_mm = apart(Eigen::Vector3d::Zero());
  for (int a = 0; a < 3; ++a)
    distance_mm = std::max(distance_mm, apart(Eigen::Vector3d(Eigen::Vector3d::Unit(a).cwiseProduct(corner))));
  if (labels.grid.size != truth.grid.size || distance_mm > 1e-3)
    throw InputError(
        fmt::format("the truth's grid differs: {} x {} x {} against {} x {} x {} voxels, corners up to {:.4g} mm "
                    "apart; it must be on "
                    "the grid of the image",
                    truth.grid.size.x(), truth.grid.size.y(), truth.grid.size.z(), labels.grid.size.x(),
                    labels.grid.size.y(), labels.grid.size.z(), distance_mm));
  std::array<std::array<double, tissue_count>, 3> sums{};  // in both, in labels, in truth
  std::array<double, 3> breast{};
  const auto in_breast = [](int t) {
    const auto tissue = static_cast<Tissue>(t);
    return tissue == Tissue::adipose || tissue == Tissue::gland || tissue == Tissue::skin;
  };
  for (std::size_t n = 0; n < labels.voxels.size(); ++n) {
    const int a = labels.voxels[n], b = truth.voxels[n];
    ++sums[1][a];
    ++sums[2][b];
    if (a == b) ++sums[0][a];
    breast[0] += in_breast(a) && in_breast(b);
    breast[1] += in_breast(a);
    breast[2] += in_breast(b);
  }
  Dice result;
  for (int t = 0; t < tissue_count; ++t) result.tissue[t] = 2 * sums[0][t] / (sums[1][t] + sums[2][t]);
  result.breast = 2 * breast[0] / (breast[1] + breast[2]);
  return result;
}

}  // namespace supine::segmentation
