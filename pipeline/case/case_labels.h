// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "common/toml_reader.h"
#include "pipeline/case/case.h"

namespace supine::pipeline {

/// Reads [image.labels] into labels and label_supports.
/// @throws InputError  a value listed twice, a list without a value, two supports of one name, names of supports of
///   another kind than labels, no muscle or support, no soft tissue
void read_case_labels(const TomlReader& labels, Case& result);

}  // namespace supine::pipeline
