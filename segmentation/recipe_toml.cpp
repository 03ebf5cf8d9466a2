// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/recipe_toml.h"

#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <map>
#include <utility>

#include "common/error.h"
#include "segmentation/formats/image_formats.h"

namespace supine::segmentation {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();

/// One table of the recipe: typed keys, each asked for once; what is left over at the end is unknown.
class Reader {
 public:
  Reader(const toml::table& table, std::string place, Eigen::Vector3d to_lps)
      : table_(table), place_(std::move(place)), to_lps_(std::move(to_lps)) {}

  [[noreturn]] void refuse(const std::string& key, const std::string& why) const {
    const toml::node* node = table_.get(key);
    const auto line = (node ? node->source() : table_.source()).begin.line;
    throw InputError(fmt::format("{}{}: {}: {}", place_, line > 0 ? fmt::format(", line {}", line) : "", key, why));
  }
  const toml::node* find(const std::string& key) {
    known_.push_back(key);
    return table_.get(key);
  }
  const toml::node& need(const std::string& key) {
    const toml::node* node = find(key);
    if (!node) refuse(key, "missing; this step needs it");
    return *node;
  }

  struct Bounds {
    double lower = -infinite, upper = infinite;
    bool open = false;  ///< lower itself is refused
  };
  double number(const std::string& key, Bounds bounds) { return number_of(need(key), key, bounds); }
  double number_or(const std::string& key, double absent, Bounds bounds) {
    const toml::node* node = find(key);
    return node ? number_of(*node, key, bounds) : absent;
  }
  int whole_or(const std::string& key, int absent, Bounds bounds) {
    const double value = number_or(key, absent, bounds);
    if (value != std::floor(value)) refuse(key, fmt::format("{} is not a whole number", value));
    return static_cast<int>(value);
  }
  std::string name(const std::string& key) {
    need(key);
    return name_or_empty(key);
  }
  std::string name_or_empty(const std::string& key) {
    const toml::node* node = find(key);
    if (!node) return "";
    const auto value = node->value_exact<std::string>();
    if (!value || value->empty()) refuse(key, "a name in quotes expected");
    return *value;
  }
  std::vector<std::string> names(const std::string& key) {
    std::vector<std::string> result;
    if (const toml::node* node = find(key))
      for (const toml::node& item : array_of(*node, key, 0)) {
        const auto value = item.value_exact<std::string>();
        if (!value) refuse(key, "a list of names in quotes expected");
        result.push_back(*value);
      }
    return result;
  }
  /// A vector in the frame of the file, returned in LPS.
  Eigen::Vector3d vector(const std::string& key) {
    return vector_of(need(key), key).cwiseProduct(to_lps_) + Eigen::Vector3d::Zero();
  }
  /// A place along patient axis 0, 1 or 2 in the frame of the file, returned in LPS; nothing when the key is absent.
  std::optional<double> coordinate(const std::string& key, int axis) {
    const toml::node* node = find(key);
    if (!node) return std::nullopt;
    return number_of(*node, key, {}) * to_lps_[axis];
  }
  Eigen::Vector3d lengths(const std::string& key) { return vector_of(need(key), key); }
  std::vector<Eigen::Vector3d> points(const std::string& key) {
    std::vector<Eigen::Vector3d> result;
    for (const toml::node& item : array_of(need(key), key, 0))
      result.push_back(vector_of(item, key).cwiseProduct(to_lps_));
    if (result.empty()) refuse(key, "at least one point [x, y, z] expected");
    return result;
  }
  GreyRange range(bool required) {
    GreyRange range;
    range.lower = static_cast<float>(number_or("lower", -infinite, {}));
    range.upper = static_cast<float>(number_or("upper", infinite, {}));
    if (required && std::isinf(range.lower) && std::isinf(range.upper))
      refuse("lower", "missing; give lower, upper or both (greys)");
    if (range.lower > range.upper) refuse("lower", fmt::format("{} is above upper = {}", range.lower, range.upper));
    return range;
  }
  Tissue tissue_of(const std::string& key, const std::string& text) const {
    const auto tissue = tissue_from_name(text);
    if (!tissue) refuse(key, fmt::format("\"{}\" is not a tissue; known are {}", text, fmt::join(tissue_names, ", ")));
    return *tissue;
  }
  template <class E>
  E choice(const std::string& key, const std::map<std::string, E>& choices) {
    const std::string text = name(key);
    if (const auto found = choices.find(text); found != choices.end()) return found->second;
    std::string known;
    for (const auto& [word, value] : choices) known += (known.empty() ? "" : ", ") + word;
    refuse(key, fmt::format("\"{}\" is not known; known are {}", text, known));
  }
  void finish() const {
    for (const auto& [key, node] : table_)
      if (std::find(known_.begin(), known_.end(), std::string(key.str())) == known_.end())
        refuse(std::string(key.str()), fmt::format("unknown key; known here are {}", fmt::join(known_, ", ")));
  }

 private:
  double number_of(const toml::node& node, const std::string& key, Bounds bounds) const {
    const auto value = node.is_number() ? node.value<double>() : std::nullopt;
    if (!value || std::isnan(*value)) refuse(key, "a number expected");
    if (*value < bounds.lower || *value > bounds.upper || (bounds.open && *value == bounds.lower))
      refuse(key, fmt::format("{} is out of range; it must be {} {}{}", *value, bounds.open ? ">" : ">=", bounds.lower,
                              std::isinf(bounds.upper) ? "" : fmt::format(" and <= {}", bounds.upper)));
    return *value;
  }
  const toml::array& array_of(const toml::node& node, const std::string& key, std::size_t size) const {
    const toml::array* array = node.as_array();
    if (!array || (size > 0 && array->size() != size))
      refuse(key, size > 0 ? fmt::format("{} numbers expected", size) : "a list expected");
    return *array;
  }
  Eigen::Vector3d vector_of(const toml::node& node, const std::string& key) const {
    const toml::array& array = array_of(node, key, 3);
    return {number_of(array[0], key, {}), number_of(array[1], key, {}), number_of(array[2], key, {})};
  }

  const toml::table& table_;
  std::string place_;
  Eigen::Vector3d to_lps_;
  std::vector<std::string> known_;
};

constexpr Reader::Bounds positive{0, infinite, true}, not_negative{0, infinite, false};

Step read_noise_floor(Reader& r) { return NoiseFloor{static_cast<float>(r.number_or("air_below", 0, positive))}; }

Step read_bias(Reader& r) {
  Bias step;
  step.tissue = r.range(false);
  step.within = r.name_or_empty("within");
  step.local_mm = r.number_or("local_mm", 0, positive);
  step.degree = r.whole_or("degree", step.degree, {0, 4, false});
  step.level = static_cast<float>(r.number_or("level", step.level, positive));
  return step;
}

Step read_smooth(Reader& r) {
  Smooth step;
  step.kind = r.choice<Smooth::Kind>("kind", {{"median", Smooth::Kind::median}, {"gaussian", Smooth::Kind::gaussian}});
  step.radius_mm = r.number("radius_mm", positive);
  return step;
}

Step read_threshold(Reader& r) { return Threshold{r.name("mask"), r.range(true), r.name_or_empty("within")}; }

Step read_grow(Reader& r) {
  Grow step;
  step.mask = r.name("mask");
  step.seeds_mm = r.points("seeds_mm");
  const bool confidence = r.find("multiplier") != nullptr;
  step.grey = r.range(!confidence);
  step.within = r.name_or_empty("within");
  Grow::Confidence options;
  options.multiplier = r.number_or("multiplier", options.multiplier, positive);
  options.iterations = r.whole_or("iterations", options.iterations, {0, 50, false});
  options.radius_mm = r.number_or("radius_mm", options.radius_mm, positive);
  if (confidence) step.confidence = options;
  return step;
}

Step read_otsu(Reader& r) {
  Otsu step;
  step.mask = r.name("mask");
  step.within = r.name_or_empty("within");
  step.classes = r.whole_or("classes", step.classes, {2, 8, false});
  step.first = r.whole_or("first", step.classes, {1, static_cast<double>(step.classes), false});
  step.last = r.whole_or("last", step.classes, {static_cast<double>(step.first), static_cast<double>(step.classes)});
  return step;
}

Step read_march(Reader& r) {
  March step;
  step.mask = r.name("mask");
  step.seeds_mm = r.points("seeds_mm");
  using Speed = March::Speed;
  step.speed = r.choice<Speed>("speed", {{"gradient", Speed::gradient}, {"greys", Speed::greys}});
  if (step.speed == Speed::gradient) {
    step.sigma_mm = r.number_or("sigma_mm", step.sigma_mm, not_negative);
    step.half_per_mm = r.number("half_per_mm", positive);
  } else {
    step.mean = r.number("mean", {});
    step.sd = r.number("sd", positive);
  }
  step.stop_mm = r.number("stop_mm", positive);
  step.order = r.whole_or("order", step.order, {1, 2, false});
  step.within = r.name_or_empty("within");
  return step;
}

Step read_islands(Reader& r) {
  Islands step;
  step.mask = r.name("mask");
  step.keep_largest = r.whole_or("keep_largest", 0, {0, 1e6, false});
  step.min_ml = r.number_or("min_ml", 0, not_negative);
  if (step.keep_largest == 0 && step.min_ml == 0)
    r.refuse("keep_largest", "missing; give keep_largest (number), min_ml or both");
  return step;
}

Step read_holes(Reader& r) { return Holes{r.name("mask"), r.number_or("max_ml", infinite, positive)}; }

Step read_combine(Reader& r) {
  Combine step{r.name("mask"), r.names("any"), r.names("without")};
  if (step.any.empty() && step.without.empty()) r.refuse("any", "missing; give masks in any, without or both");
  return step;
}

Step read_morph(Reader& r) {
  Morph step;
  step.mask = r.name("mask");
  using Kind = Morph::Kind;
  step.kind = r.choice<Kind>(
      "kind", {{"dilate", Kind::dilate}, {"erode", Kind::erode}, {"open", Kind::open}, {"close", Kind::close}});
  step.radius_mm = r.number("radius_mm", positive);
  return step;
}

Step read_layer(Reader& r) { return Layer{r.name("mask"), r.name("of"), r.number("thickness_mm", positive)}; }

Step read_region(Reader& r) {
  using Shape = Region::Shape;
  Region step;
  step.mask = r.name("mask");
  step.shape = r.choice<Shape>(
      "shape",
      {{"cylinder", Shape::cylinder}, {"sphere", Shape::sphere}, {"box", Shape::box}, {"halfspace", Shape::halfspace}});
  step.centre_mm = r.vector("centre_mm");
  if (step.shape == Shape::cylinder || step.shape == Shape::halfspace) {
    step.axis = r.vector("axis");
    if (step.axis.norm() < 1e-9) r.refuse("axis", "must not be zero");
  }
  if (step.shape == Shape::cylinder || step.shape == Shape::sphere) step.radius_mm = r.number("radius_mm", positive);
  if (step.shape == Shape::box) {
    step.half_mm = r.lengths("half_mm");
    if (!(step.half_mm.minCoeff() > 0)) r.refuse("half_mm", "each half side must be > 0");
  }
  return step;
}

Step read_paint(Reader& r) {
  Paint step;
  step.mask = r.name("mask");
  step.tissue = r.tissue_of("tissue", r.name("tissue"));
  for (const auto& text : r.names("over")) step.over.push_back(r.tissue_of("over", text));
  return step;
}

Step read_body(Reader& r) {
  Body step;
  step.mask = r.name("mask");
  step.lower = static_cast<float>(r.number_or("lower", 0, positive));
  step.air = static_cast<float>(r.number_or("air", 0, positive));
  if (step.lower > 0 && step.air > step.lower)
    r.refuse("air", fmt::format("{} is above lower = {}", step.air, step.lower));
  step.edge_share = static_cast<float>(r.number_or("edge_share", 0, {0, 0.9, false}));
  step.gap_mm = r.number_or("gap_mm", 0, not_negative);
  step.peel_mm = r.number_or("peel_mm", step.peel_mm, positive);
  step.open_mm = r.number_or("open_mm", 0, not_negative);
  return step;
}

Step read_chest(Reader& r) {
  Chest step;
  step.mask = r.name("mask");
  step.body = r.name("body");
  step.sternum_mm = r.coordinate("sternum_mm", 0);
  ChestWallOptions& o = step.options;
  if (!r.name_or_empty("border").empty())
    o.border = r.choice<ChestWallOptions::Border>(
        "border", {{"step", ChestWallOptions::Border::step}, {"line", ChestWallOptions::Border::line}});
  o.dark = static_cast<float>(r.number_or("dark", o.dark, {}));
  o.bright = static_cast<float>(r.number_or("bright", o.bright, {}));
  if (!(o.bright > o.dark)) r.refuse("bright", fmt::format("{} must be above dark = {}", o.bright, o.dark));
  o.band_mm = r.number_or("band_mm", o.band_mm, positive);
  o.centre_depth_mm = r.number_or("centre_depth_mm", o.centre_depth_mm, positive);
  o.stiffness_per_mm = r.number_or("stiffness_per_mm", o.stiffness_per_mm, positive);
  o.coupling_per_mm = r.number_or("coupling_per_mm", o.coupling_per_mm, not_negative);
  o.far_weight = r.number_or("far_weight", o.far_weight, not_negative);
  o.oval_pull_per_mm = r.number_or("oval_pull_per_mm", o.oval_pull_per_mm, not_negative);
  o.refine_mm = r.number_or("refine_mm", o.refine_mm, not_negative);
  return step;
}

Planes::Plane read_plane(Reader& r, const std::string& name, int axis) {
  Planes::Plane plane;
  plane.at_mm = r.coordinate(name + "_mm", axis);
  plane.offset_mm = r.coordinate(name + "_offset_mm", axis).value_or(0);
  if (plane.at_mm && plane.offset_mm != 0) r.refuse(name + "_offset_mm", "has no effect beside " + name + "_mm");
  return plane;
}

Step read_planes(Reader& r) {
  Planes step;
  step.mask = r.name("mask");
  step.body = r.name("body");
  step.chest = r.name("chest");
  step.left = r.name_or_empty("left");
  step.right = r.name_or_empty("right");
  step.sternum = read_plane(r, "sternum", 0);
  step.mid_axillary = read_plane(r, "mid_axillary", 1);
  step.inframammary = read_plane(r, "inframammary", 2);
  step.superior = read_plane(r, "superior", 2);
  using Side = Planes::Side;
  if (!r.name_or_empty("side").empty())
    step.side = r.choice<Side>("side", {{"both", Side::both}, {"left", Side::left}, {"right", Side::right}});
  return step;
}

using StepReader = std::function<Step(Reader&)>;

const std::map<std::string, StepReader>& step_readers() {
  static const std::map<std::string, StepReader> readers = {{"noise_floor", read_noise_floor},
                                                            {"bias", read_bias},
                                                            {"smooth", read_smooth},
                                                            {"threshold", read_threshold},
                                                            {"grow", read_grow},
                                                            {"islands", read_islands},
                                                            {"holes", read_holes},
                                                            {"combine", read_combine},
                                                            {"morph", read_morph},
                                                            {"layer", read_layer},
                                                            {"region", read_region},
                                                            {"paint", read_paint},
                                                            {"body", read_body},
                                                            {"chest", read_chest},
                                                            {"planes", read_planes},
                                                            {"otsu", read_otsu},
                                                            {"march", read_march}};
  return readers;
}

}  // namespace

Recipe read_recipe(const toml::table& table, const std::string& place, const std::string& frame) {
  const auto to_lps = formats::signs_to_lps(frame);
  if (!to_lps) throw InputError(fmt::format("{}: frame \"{}\" is not known; LPS or RAS expected", place, frame));
  Reader top(table, place, *to_lps);
  const toml::array* steps = top.need("step").as_array();
  top.finish();
  if (!steps || steps->empty() || !steps->is_homogeneous<toml::table>())
    top.refuse("step", "a list of [[segmentation.step]] tables expected");
  Recipe recipe;
  for (std::size_t n = 0; n < steps->size(); ++n) {
    const toml::table& step = *(*steps)[n].as_table();
    Reader reader(step, fmt::format("{}, step {}", place, n + 1), *to_lps);
    recipe.steps.push_back(reader.choice<StepReader>("do", step_readers())(reader));
    reader.finish();
  }
  return recipe;
}

Recipe read_recipe_file(const std::filesystem::path& file, const std::string& frame) {
  try {
    const toml::table table = toml::parse_file(file.string());
    for (const auto& [key, node] : table)
      if (key.str() != "segmentation")
        throw InputError(fmt::format("{}, line {}: unknown key {}; a recipe file has the table [segmentation] alone",
                                     file.string(), key.source().begin.line, key.str()));
    const toml::table* recipe = table["segmentation"].as_table();
    if (!recipe) throw InputError(fmt::format("{}: no table [segmentation]", file.string()));
    return read_recipe(*recipe, file.string() + " [segmentation]", frame);
  } catch (const toml::parse_error& error) {
    throw InputError(fmt::format("{}, line {}: {}", file.string(), error.source().begin.line, error.description()));
  }
}

}  // namespace supine::segmentation
