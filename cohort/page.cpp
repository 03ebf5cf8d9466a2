// SPDX-License-Identifier: AGPL-3.0-or-later
#include "cohort/page.h"

#include "common/error.h"

namespace supine::cohort {

/// web/page.html, built in.
std::string_view page_frame();

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using Ordered = nlohmann::ordered_json;

Ordered patient_json(const CaseResults& one, const fs::path& folder) {
  Ordered row = {{"name", one.name}, {"failed", one.failed}};
  if (const fs::path report = one.out / "report.html"; fs::exists(report))
    row["report"] = fs::relative(report, folder.empty() ? "." : folder).generic_string();
  const auto copy = [&row](const Json& from, const char* key, const char* as) {
    if (from.is_object() && from.contains(key)) row[as] = from.at(key);
  };
  copy(one.diagnosis, "verdict", "verdict");
  copy(one.diagnosis, "missing", "missing");
  copy(one.diagnosis, "unexplained_mm", "unexplained_mm");
  copy(one.diagnosis, "included", "included");
  copy(one.comparison, "rms_mm", "rms_mm");
  copy(one.comparison, "areas", "areas");
  copy(one.calibration, "rms_mm", "calibrated_rms_mm");
  copy(one.calibration, "parameters", "parameters");
  return row;
}

/// As the text of a script element: nothing in it can end that.
std::string for_script(const Ordered& data) {
  std::string text = data.dump();
  for (std::size_t at = 0; (at = text.find('<', at)) != std::string::npos; ++at) text.replace(at, 1, "\\u003c");
  return text;
}

}  // namespace

std::string cohort_page(const std::vector<CaseResults>& cases, const Ordered& figures, const std::string& title,
                        const fs::path& folder) {
  Ordered data = {{"title", title}, {"pooled", figures}, {"patients", Ordered::array()}};
  for (const CaseResults& one : cases) data["patients"].push_back(patient_json(one, folder));
  constexpr std::string_view mark = "@DATA@";
  const std::string_view frame = page_frame();
  const std::size_t at = frame.find(mark);
  if (at == std::string_view::npos)
    throw InputError("the frame of the page has no place for its data; build supine-cohort again");
  return std::string(frame.substr(0, at)) + for_script(data) + std::string(frame.substr(at + mark.size()));
}

}  // namespace supine::cohort
