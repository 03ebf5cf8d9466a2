// SPDX-License-Identifier: AGPL-3.0-or-later
#include "python/bindings/arrays.h"

#include <fmt/core.h>

namespace supine::python {

Points points_of(const DoubleArray& array, const std::string& name) {
  const bool one = array.ndim() == 1 && array.shape(0) == 3;
  if (!one && !(array.ndim() == 2 && array.shape(1) == 3)) {
    std::string shape;
    for (pybind11::ssize_t axis = 0; axis < array.ndim(); ++axis)
      shape += fmt::format("{}{}", axis > 0 ? " by " : "", array.shape(axis));
    throw InputError(fmt::format("{}: an array of {}; must be N by 3, a point per row, mm", name, shape));
  }
  Points points = Eigen::Map<const Points>(array.data(), one ? 1 : array.shape(0), 3);
  if (!points.allFinite()) throw InputError(fmt::format("{}: holds a number that is not finite", name));
  return points;
}

}  // namespace supine::python
