// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "pipeline/case/case.h"
#include "pipeline/report/collect.h"

namespace supine::pipeline {

/// One step of the way from image to report.
struct Stage {
  std::string name;     ///< target of make: segment, reconstruct …
  std::string shows;    ///< what the report has of it
  std::string file;     ///< sidecar that says it was done; empty when it was not
  std::string fill;     ///< command that fills the gap; empty when it was done
  std::string command;  ///< command of the tool that wrote `file`, with every option; empty when it was not done
  std::string stale;    ///< why what is there no longer belongs together; empty when it does
};

/// Where a case lies, for this program and in the commands that it prints.
struct Places {
  std::filesystem::path case_folder, out;
  std::string case_name, out_name;  ///< as the user named them

  /// "make CASE=… OUT=… TARGET"; OUT is left out where it is CASE/out.
  std::string make(const std::string& target) const;
};

/// Every stage in order, done or not. Compare, calibrate and what follows need a measured surface: without one their
/// `fill` says what to measure instead.
/// What is there is stale when a file it was made of is another one now.
std::vector<Stage> stages_of(const Case& measured, const Collected& collected, const Places& places);

nlohmann::ordered_json stages_json(const std::vector<Stage>& stages);

}  // namespace supine::pipeline
