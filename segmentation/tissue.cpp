// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/tissue.h"

#include <algorithm>

namespace supine::segmentation {

std::optional<Tissue> tissue_from_name(std::string_view name) {
  const auto found = std::find(tissue_names.begin(), tissue_names.end(), name);
  if (found == tissue_names.end()) return std::nullopt;
  return static_cast<Tissue>(found - tissue_names.begin());
}

}  // namespace supine::segmentation
