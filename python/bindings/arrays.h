// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <pybind11/numpy.h>

#include <Eigen/Core>
#include <stdexcept>
#include <string>

#include "common/arrays.h"
#include "common/error.h"

namespace supine::python {

/// A view of @p matrix, read-only, that keeps @p owner alive; the rows of a row-major matrix, a vector as one row of
/// numbers.
template <class Matrix>
pybind11::array view_of(const Matrix& matrix, pybind11::handle owner) {
  using Number = typename Matrix::Scalar;
  std::vector<pybind11::ssize_t> shape = {matrix.rows()}, strides = {sizeof(Number)};
  if constexpr (Matrix::ColsAtCompileTime != 1) {
    shape.push_back(matrix.cols());
    strides = {static_cast<pybind11::ssize_t>(sizeof(Number)) * matrix.rowStride(),
               static_cast<pybind11::ssize_t>(sizeof(Number)) * matrix.colStride()};
  }
  pybind11::array_t<Number> array(shape, strides, matrix.data(), owner);
  pybind11::detail::array_proxy(array.ptr())->flags &= ~pybind11::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return array;
}

/// An array of its own, for what would not live as long.
template <class Matrix>
pybind11::array copy_of(const Matrix& matrix) {
  auto* kept = new Matrix(matrix);
  const pybind11::capsule owner(kept, [](void* pointer) { delete static_cast<Matrix*>(pointer); });
  pybind11::array array = view_of(*kept, owner);
  pybind11::detail::array_proxy(array.ptr())->flags |= pybind11::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return array;
}

using DoubleArray = pybind11::array_t<double, pybind11::array::c_style | pybind11::array::forcecast>;

/// Points of a P by 3 array, or of one point of three numbers.
/// @throws InputError  another shape, a number that is not finite
Points points_of(const DoubleArray& array, const std::string& name);

}  // namespace supine::python
