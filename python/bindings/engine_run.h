// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>

#include <exception>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/tool/tool.h"
#include "python/bindings/errors.h"

namespace supine::python {

/// A run of the engine for Python: without files, its lines given to a function, the interpreter free meanwhile.
class EngineRun {
 public:
  /// @param progress  callable that takes a line of text, or None
  explicit EngineRun(const std::string& tool, pybind11::object progress);
  EngineRun(const EngineRun&) = delete;
  EngineRun& operator=(const EngineRun&) = delete;

  /// Calls work(run). Warnings of the run become warnings of Python at its end.
  /// @throws what it throws, or what the function raised; KeyboardInterrupt at the next line of progress
  template <class Work>
  auto call(Work work) {
    std::optional<decltype(work(run_))> result;
    {
      const pybind11::gil_scoped_release free;
      result.emplace(work(run_));
    }
    for (const std::string& line : warnings_) warn_in_python(line);
    return std::move(*result);
  }

  const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  void hear(pipeline::Said kind, const std::string& line);

  pybind11::object progress_;
  pipeline::Run run_;
  std::vector<std::string> warnings_;
};

}  // namespace supine::python
