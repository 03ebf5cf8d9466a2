// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cohort/results.h"

namespace supine::cohort {

/// One HTML file that needs no network: table to sort and filter, errors by area on the body, histograms of moduli,
/// effects by patients, worst first; each patient linked to its report where that is there, those set aside with their
/// message.
/// @param figures  of pooled()   @param folder  where the page will lie: links are relative to it
std::string cohort_page(const std::vector<CaseResults>& cases, const nlohmann::ordered_json& figures,
                        const std::string& title, const std::filesystem::path& folder);

}  // namespace supine::cohort
