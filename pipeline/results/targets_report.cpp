// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/results/targets_report.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <fstream>
#include <stdexcept>

#include "common/error.h"
#include "simulation/catalogue.h"

namespace supine::pipeline {
namespace {

using diagnosis::Depth;
using diagnosis::TargetRegion;
using diagnosis::TargetRegions;
using Json = nlohmann::ordered_json;

constexpr double on_skin_mm = 0.5;  // what is marked on the skin may lie as much outside the model's as inside

Json vector_json(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Json matrix_json(const Eigen::MatrixXd& matrix) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    const Eigen::VectorXd row = matrix.row(i);
    rows.push_back(std::vector<double>(row.begin(), row.end()));
  }
  return rows;
}

Json depth_json(const std::optional<Depth>& depth) {
  if (!depth) return nullptr;
  return {{"place_mm", vector_json(depth->skin_mm)}, {"mm", depth->mm}, {"sd_mm", depth->sd_mm}};
}

Json point_json(const TargetRegion& region) {
  Json axes = Json::array(), shrinks = Json::array();
  for (int k = 0; k < 3; ++k) axes.push_back(vector_json(region.axes.col(k)));
  for (const auto& shrink : region.shrinks)
    shrinks.push_back({{"what", shrink.what}, {"in_words", shrink.in_words}, {"share", shrink.share}});
  return {{"name", region.name},
          {"place_mm", vector_json(region.place_mm)},
          {"model_mm", vector_json(region.model_mm)},
          {"finer_mm", vector_json(region.finer_mm)},
          {"sigma_mm", region.sd_mm()},
          {"covariance_mm2", matrix_json(region.covariance)},
          {"half_axes_mm", vector_json(region.half_axes_mm)},
          {"axes", axes},
          {"if_nothing_missing",
           {{"place_mm", vector_json(region.if_nothing_missing.place_mm)},
            {"covariance_mm2", matrix_json(region.if_nothing_missing.covariance)},
            {"half_axes_mm", vector_json(region.if_nothing_missing.half_axes_mm)}}},
          {"outside_mm", region.outside_mm},
          {"nearest_skin", depth_json(region.nearest)},
          {"vertical_skin", depth_json(region.straight)},
          {"shrinks", shrinks}};
}

Json landmarks_json(const diagnosis::ExpectedLandmarks& landmarks) {
  Json expected = Json::array();
  for (Eigen::Index i = 0; i < landmarks.expected.places.rows(); ++i)
    expected.push_back(vector_json(landmarks.expected.places.row(i).transpose()));
  return {{"names", landmarks.expected.names},
          {"expected_mm", expected},
          {"covariance_mm2", matrix_json(landmarks.expected.covariance)},
          {"chi_squared", landmarks.agreement.chi_squared},
          {"degrees", landmarks.agreement.degrees},
          {"p_value", landmarks.agreement.p_value}};
}

Json sets_json(const TargetRegions& regions) {
  if (regions.sets.empty()) return nullptr;
  Json sets = Json::array();
  for (const auto& set : regions.sets) sets.push_back({{"effects", set.effects}, {"probability", set.probability}});
  return sets;
}

/// "nothing (0.82), ligament (0.05), …"
std::string sets_in_words(const TargetRegions& regions) {
  std::vector<std::string> words;
  for (const auto& set : regions.sets)
    if (words.size() < 3)
      words.push_back(fmt::format("{} ({:.2f})",
                                  set.effects.empty() ? "nothing" : fmt::format("{}", fmt::join(set.effects, " and ")),
                                  set.probability));
  return fmt::format("{}", fmt::join(words, ", "));
}

std::string cells(const std::optional<Depth>& depth, bool with_place) {
  if (!depth) return with_place ? ",,,,," : ",,";
  std::string text = fmt::format(",{:.3f},{:.3f}", depth->mm, depth->sd_mm);
  if (with_place)
    text += fmt::format(",{:.3f},{:.3f},{:.3f}", depth->skin_mm.x(), depth->skin_mm.y(), depth->skin_mm.z());
  return text;
}

}  // namespace

void write_regions(const TargetRegions& regions, const std::filesystem::path& file) {
  std::ofstream stream(file, std::ios::binary);
  stream << "name,x,y,z,sigma_mm,half_axis_1_mm,half_axis_2_mm,half_axis_3_mm,"
            "axis_1_x,axis_1_y,axis_1_z,axis_2_x,axis_2_y,axis_2_z,axis_3_x,axis_3_y,axis_3_z,"
            "nearest_skin_mm,nearest_skin_sd_mm,skin_x,skin_y,skin_z,vertical_skin_mm,vertical_skin_sd_mm\n";
  for (const TargetRegion& r : regions.points) {
    stream << fmt::format("{},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f}", r.name, r.place_mm.x(), r.place_mm.y(),
                          r.place_mm.z(), r.sd_mm(), r.half_axes_mm[0], r.half_axes_mm[1], r.half_axes_mm[2]);
    for (int k = 0; k < 3; ++k)
      stream << fmt::format(",{:.5f},{:.5f},{:.5f}", r.axes(0, k), r.axes(1, k), r.axes(2, k));
    stream << cells(r.nearest, true) << cells(r.straight, false) << "\n";
  }
  if (!stream.flush()) throw InputError("writing " + file.string() + " failed; check the free space on the disk");
}

Json regions_figures(const diagnosis::TargetQuestion& question, const TargetRegions& regions) {
  Json f;
  f["pose"] = question.pose.name;
  f["gravity"] = vector_json(question.pose.gravity);
  f["scan_counts"] = regions.measured;
  f["may_be_missing"] = sets_json(regions);
  f["unexplained_mm"] = regions.unexplained_mm;
  f["mesh_mm"] = regions.mesh_mm;
  f["mesh_measured"] = regions.mesh_measured;
  f["points"] = Json::array();
  for (const TargetRegion& region : regions.points) f["points"].push_back(point_json(region));
  f["landmarks"] = regions.landmarks ? landmarks_json(*regions.landmarks) : Json(nullptr);
  return f;
}

calibration::ExpectedPlaces read_expected_landmarks(const std::filesystem::path& file, const std::string& pose) {
  const auto refuse = [&file](const std::string& what) -> InputError {
    return InputError(fmt::format("{}: {}; write it with supine-targets", file.string(), what));
  };
  const Json all = Json::parse(std::ifstream(file, std::ios::binary), nullptr, false);
  if (!all.is_object() || !all.contains("landmarks") || !all.contains("pose"))
    throw refuse("holds no expected landmarks");
  if (all["pose"] != pose) throw refuse(fmt::format("is of pose {}, not of '{}'", all["pose"].dump(), pose));
  if (all["landmarks"].is_null())
    throw refuse(fmt::format("no landmarks were measured in '{}' when it was made", pose));
  try {
    const Json& f = all["landmarks"];
    calibration::ExpectedPlaces expected;
    f.at("names").get_to(expected.names);
    const auto places = f.at("expected_mm").get<std::vector<std::array<double, 3>>>();
    const auto rows = f.at("covariance_mm2").get<std::vector<std::vector<double>>>();
    if (places.size() != expected.names.size() || rows.size() != 3 * places.size())
      throw refuse("names, places and covariance differ in number");
    expected.places.resize(static_cast<Eigen::Index>(places.size()), 3);
    expected.covariance.resize(static_cast<Eigen::Index>(rows.size()), static_cast<Eigen::Index>(rows.size()));
    for (std::size_t i = 0; i < places.size(); ++i)
      expected.places.row(static_cast<Eigen::Index>(i)) = Eigen::Map<const Eigen::RowVector3d>(places[i].data());
    for (std::size_t i = 0; i < rows.size(); ++i)
      for (std::size_t j = 0; j < rows.size(); ++j)
        expected.covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = rows[i].at(j);
    return expected;
  } catch (const Json::exception& why) {
    throw refuse(why.what());
  } catch (const std::out_of_range&) {
    throw refuse("the covariance is not square");
  }
}

std::vector<diagnosis::LikelySet> read_likely_sets(const std::filesystem::path& file) {
  const auto refuse = [&file](const std::string& what) -> InputError {
    return InputError(fmt::format("{}: {}; write it with supine-diagnose", file.string(), what));
  };
  const Json all = Json::parse(std::ifstream(file, std::ios::binary), nullptr, false);
  if (!all.is_object() || !all.contains("hypotheses")) throw refuse("holds no hypotheses");
  std::vector<diagnosis::LikelySet> sets;
  double sum = 0;
  try {
    for (const Json& one : all["hypotheses"]) {
      sets.push_back({one.at("effects").get<std::vector<std::string>>(), one.at("probability").get<double>()});
      const double p = sets.back().probability;
      if (!(p >= 0 && p <= 1)) throw refuse(fmt::format("a probability of {} (bounds 0 and 1)", p));
      sum += p;
      for (const std::string& name : sets.back().effects)
        if (simulation::find_effect(name) == nullptr)
          throw refuse(fmt::format("\"{}\" is no effect of the catalogue", name));
    }
  } catch (const Json::exception& why) {
    throw refuse(why.what());
  }
  constexpr double rounding = 1e-6;
  if (!(sum <= 1 + rounding)) throw refuse(fmt::format("probabilities add up to {:.4g} (bound 1)", sum));
  return sets;
}

Json draws_figures(const diagnosis::TargetQuestion& question, const diagnosis::DrawnPlaces& drawn) {
  Json f{{"draws", drawn.draws}, {"failed", drawn.failed}, {"points", Json::array()}};
  for (std::size_t p = 0; p < question.names.size(); ++p) {
    const auto i = static_cast<Eigen::Index>(p);
    f["points"].push_back({{"name", question.names[p]},
                           {"linear_sd_mm", drawn.linear_sd_mm[i]},
                           {"drawn_sd_mm", drawn.drawn_sd_mm[i]},
                           {"mean_off_mm", drawn.mean_off_mm[i]},
                           {"inside95", drawn.inside[i]}});
  }
  return f;
}

void say_regions(const Run& run, const diagnosis::TargetQuestion& question, const TargetRegions& regions) {
  run.say(
      fmt::format("{}: places with 95 % regions, {}", question.pose.name,
                  regions.measured ? "all that was measured taken into account" : "nothing was measured: by priors"));
  run.say(regions.sets.empty()
              ? std::string("  taken that the model lacks nothing")
              : "  over what the model may lack, likeliest first: " + sets_in_words(regions) + ", ...");
  run.say(fmt::format("  {:<18}{:>9}{:>9}{:>9}{:>22}{:>16}{:>16}", "point", "x", "y", "z", "half axes, mm",
                      "to skin, mm", "straight up, mm"));
  for (const TargetRegion& r : regions.points) {
    const auto depth = [](const std::optional<Depth>& d) -> std::string {
      if (!d) return std::string("-");
      return d->mm < on_skin_mm ? "on the skin" : fmt::format("{:.1f} +- {:.1f}", d->mm, d->sd_mm);
    };
    run.say(fmt::format("  {:<18}{:>9.1f}{:>9.1f}{:>9.1f}{:>22}{:>16}{:>16}", r.name, r.place_mm.x(), r.place_mm.y(),
                        r.place_mm.z(),
                        fmt::format("{:.1f} {:.1f} {:.1f}", r.half_axes_mm[0], r.half_axes_mm[1], r.half_axes_mm[2]),
                        depth(r.nearest), depth(r.straight)));
  }
  for (const TargetRegion& r : regions.points)
    if (!r.shrinks.empty())
      run.say(fmt::format("  {} would be surer most by {} ({:.0f} % of the variance)", r.name, r.shrinks[0].in_words,
                          100 * r.shrinks[0].share));
  if (regions.landmarks)
    run.say(
        fmt::format("  landmarks against where all else expects them: p = {:.3g} (chi squared {:.1f} with {} "
                    "degrees)",
                    regions.landmarks->agreement.p_value, regions.landmarks->agreement.chi_squared,
                    regions.landmarks->agreement.degrees));
}

void say_draws(const Run& run, const diagnosis::TargetQuestion& question, const diagnosis::DrawnPlaces& drawn) {
  run.say(fmt::format("  {} draws of parameters and nuisances through the chain, {} without equilibrium", drawn.draws,
                      drawn.failed));
  run.say(fmt::format("  {:<18}{:>12}{:>12}{:>12}{:>12}", "point", "sd, linear", "sd, drawn", "mean off", "inside 95"));
  for (std::size_t p = 0; p < question.names.size(); ++p) {
    const auto i = static_cast<Eigen::Index>(p);
    run.say(fmt::format("  {:<18}{:>12.3f}{:>12.3f}{:>12.3f}{:>10.1f} %", question.names[p], drawn.linear_sd_mm[i],
                        drawn.drawn_sd_mm[i], drawn.mean_off_mm[i], 100 * drawn.inside[i]));
  }
}

}  // namespace supine::pipeline
