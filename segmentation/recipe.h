// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "segmentation/tissue.h"

namespace supine::segmentation {

// The segmentation recipe is filled in by the segmentation folder.
struct Recipe {};

}  // namespace supine::segmentation
