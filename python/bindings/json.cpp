// SPDX-License-Identifier: AGPL-3.0-or-later
#include "python/bindings/json.h"

#include <cmath>

namespace supine::python {

namespace py = pybind11;

py::object python_of(const nlohmann::ordered_json& json) {
  if (json.is_object()) {
    py::dict dictionary;
    for (const auto& [key, value] : json.items()) dictionary[py::str(key)] = python_of(value);
    return dictionary;
  }
  if (json.is_array()) {
    py::list list;
    for (const auto& value : json) list.append(python_of(value));
    return list;
  }
  if (json.is_string()) return py::str(json.get<std::string>());
  if (json.is_boolean()) return py::bool_(json.get<bool>());
  if (json.is_number_unsigned()) return py::int_(json.get<std::uint64_t>());
  if (json.is_number_integer()) return py::int_(json.get<std::int64_t>());
  // A number that is not finite is null in a file.
  if (json.is_number() && std::isfinite(json.get<double>())) return py::float_(json.get<double>());
  return py::none();
}

}  // namespace supine::python
