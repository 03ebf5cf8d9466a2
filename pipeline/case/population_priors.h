// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "pipeline/case/case.h"
#include "pipeline/tool/tool.h"
#include "simulation/model.h"

namespace supine::pipeline {

/// The model with what a population says of its free numbers as their start and prior, where the case names one
/// ([priors] cohort, a cohort.json of supine-cohort); else the model as it is. A patient who is in the cohort, under
/// the name of the case's folder, gets what is known of the others alone.
/// @throws InputError  naming the file: no cohort.json, none of its numbers free in the model, a median out of range
simulation::Model with_population(Run& run, const Case& description, simulation::Model model);

}  // namespace supine::pipeline
