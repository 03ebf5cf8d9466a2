// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "common/error.h"
#include "warp/point_formats.h"

// 3D Slicer's markups: {"markups": [{type, coordinateSystem, coordinateUnits, controlPoints: [{label, position,
// positionStatus, …}]}]}.
namespace supine::warp {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

const std::set<std::string> known_kinds = {"Fiducial", "Line", "Curve", "ClosedCurve", "Angle"};

class MarkupsFile : public PointFile::Content {
 public:
  explicit MarkupsFile(const fs::path& file) : file_(file) {
    extension = ".mrk.json";
    std::ifstream stream(file);
    if (!stream) fail("cannot be read");
    try {
      json_ = Json::parse(stream);
    } catch (const Json::exception& error) {
      fail(fmt::format("no JSON ({}); save it again with 3D Slicer", error.what()));
    }
    if (!json_.is_object() || !json_.contains("markups") || !json_["markups"].is_array())
      fail("has no list \"markups\"; it is not a markups file of 3D Slicer");
    for (Json& markup : json_["markups"]) read(markup);
  }

  void write(const Points& places, const fs::path& file) const override {
    Json json = json_;
    Eigen::Index row = 0;
    for (Json& markup : json["markups"]) {
      const double sign = sign_of_frame(file_, markup["coordinateSystem"]);
      for (Json& point : markup["controlPoints"]) {
        if (!is_defined(point)) continue;
        point["position"] = {sign * places(row, 0), sign * places(row, 1), places(row, 2)};
        ++row;
      }
      // Lengths and angles of the old place; Slicer measures again on loading.
      markup.erase("measurements");
    }
    std::ofstream stream(file, std::ios::binary);
    stream << json.dump(4) << "\n";
    if (!stream.flush()) throw InputError(fmt::format("{}: cannot be written", file.string()));
  }

 private:
  [[noreturn]] void fail(const std::string& why) const { throw InputError(fmt::format("{}: {}", file_.string(), why)); }

  static bool is_defined(const Json& point) {
    const auto status = point.find("positionStatus");
    return status == point.end() || *status == "defined";
  }

  void read(const Json& markup) {
    const std::string kind = text(markup, "type"), frame_of_markup = text(markup, "coordinateSystem");
    if (!known_kinds.contains(kind))
      fail(
          fmt::format("holds a markup of type {}; points, lines, curves, closed curves and angles can be carried. A "
                      "body that deforms leaves no plane or box one",
                      kind));
    const double sign = sign_of_frame(file_, frame_of_markup);
    if (frame.empty()) frame = frame_of_markup;
    check_unit(markup);
    const Eigen::Index first = points.rows();
    if (!markup.contains("controlPoints") || !markup["controlPoints"].is_array())
      fail("a markup has no list \"controlPoints\"");
    for (const Json& point : markup["controlPoints"])
      if (is_defined(point)) add_point(point, sign);
    groups.push_back({markup.value("name", file_.stem().stem().string()), kind, first, points.rows() - first});
  }

  std::string text(const Json& markup, const char* key) const {
    if (!markup.is_object() || !markup.contains(key) || !markup[key].is_string())
      fail(fmt::format("a markup has no \"{}\"; save it again with 3D Slicer", key));
    return markup[key];
  }

  void check_unit(const Json& markup) const {
    const auto unit = markup.find("coordinateUnits");
    if (unit == markup.end()) return;
    for (const Json& one : unit->is_array() ? *unit : Json::array({*unit}))
      if (one != "mm") fail(fmt::format("coordinateUnits is {}; mm expected", unit->dump()));
  }

  void add_point(const Json& point, double sign) {
    const auto position = point.find("position");
    bool good = position != point.end() && position->is_array() && position->size() == 3;
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
    for (std::size_t a = 0; good && a < 3; ++a) {
      good = (*position)[a].is_number();
      if (good) place[static_cast<Eigen::Index>(a)] = (*position)[a].get<double>();
    }
    const std::string label = point.contains("label") && point["label"].is_string()
                                  ? point["label"].get<std::string>()
                                  : fmt::format("{}", points.rows() + 1);
    if (!good || !place.allFinite())
      fail(fmt::format("control point '{}' has no position of three finite numbers", label));
    place.head<2>() *= sign;
    add(label, place);
  }

  fs::path file_;
  Json json_;
};

}  // namespace

std::unique_ptr<PointFile::Content> read_markups(const fs::path& file) { return std::make_unique<MarkupsFile>(file); }

}  // namespace supine::warp
