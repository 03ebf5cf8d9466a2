// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "diagnosis/examine.h"

namespace supine::pipeline {

/// The candidate of an effect that was examined.
const diagnosis::Candidate& candidate_of(const diagnosis::Findings& found, const std::string& effect);

// What the evidence says, as it stands in diagnosis.json (docs/supine-diagnose.md).

/// Every effect, most probable first: numbers of the refit where there is one, else of the linear step.
nlohmann::ordered_json candidates_json(const diagnosis::Findings& found);

nlohmann::ordered_json hypotheses_json(const diagnosis::Findings& found);

/// A local cause that no effect lists: how likely, of which kind, and where.
nlohmann::ordered_json unlisted_json(const diagnosis::Unlisted& found);

/// Every effect by itself, as the evidence of many patients is put together from (cohort/population.h): posterior and
/// prior of its numbers, as offsets from the null, and how far the usual size of one moves the fitted points.
nlohmann::ordered_json singles_json(const diagnosis::Findings& found);

/// Every effect over all sets that hold it.
nlohmann::ordered_json included_json(const diagnosis::Findings& found);

/// The verdict under each other prior, with the probability of every effect.
nlohmann::ordered_json other_priors_json(const diagnosis::Findings& found);

}  // namespace supine::pipeline
