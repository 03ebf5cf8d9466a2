// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>

#include <nlohmann/json.hpp>

namespace supine::python {

/// Objects as dictionaries, lists as lists; numbers keep their digits.
pybind11::object python_of(const nlohmann::ordered_json& json);

}  // namespace supine::python
