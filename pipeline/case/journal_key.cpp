// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/case/journal_key.h"

#include "pipeline/tool/hash.h"
#include "pipeline/tool/provenance.h"

namespace supine::pipeline {

std::string journal_key(const MeasuredCase& measured, const std::filesystem::path& case_folder,
                        const std::filesystem::path& mesh_file) {
  std::string key = "supine " + std::string(supine_version()) + " " + std::string(supine_commit());
  for (const std::filesystem::path& file : {case_folder / "case.toml", measured.model_text.file, mesh_file})
    key += " " + sha256(file);
  for (const auto& fitted : measured.fitted) key += " " + sha256(*measured.description.pose(fitted.pose.name).surface);
  return key;
}

}  // namespace supine::pipeline
