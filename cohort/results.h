// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace supine::cohort {

/// What is there of one case: the folder's name, and its results where it has them (null otherwise).
struct CaseResults {
  std::string name;
  std::filesystem::path out;
  std::string failed;  ///< message of failed.txt; empty when the case was not set aside
  nlohmann::json comparison, calibration, diagnosis;
};

/// The folders of @p cohort that hold a case.toml, by name, with their results in FOLDER/out, or in OUT/NAME where @p
/// out is given.
/// @throws InputError  no such folder; no case in it; no case with a result; a result that is no JSON;
/// two cases with the same calibration or diagnosis
std::vector<CaseResults> read_results(const std::filesystem::path& cohort, const std::filesystem::path& out);

/// Tables and pooled evidence of a cohort (docs/supine-cohort.md).
struct PoolOptions {
  double shared_mm = 0.1;          ///< rms of the model's own error that all patients share, 1 sigma, along an effect
  double prior_probability = 0.1;  ///< of each effect, that it is in the population
};
nlohmann::ordered_json pooled(const std::vector<CaseResults>& cases, const PoolOptions& options);

/// A row a patient, columns as in docs/supine-cohort.md; numbers with all their digits.
std::string table_csv(const std::vector<CaseResults>& cases);

}  // namespace supine::cohort
