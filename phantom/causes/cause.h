// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "phantom/body_mesh.h"
#include "simulation/fields.h"

namespace supine::phantom {

/// One reason why a breast does not behave like the base model.
struct Cause {
  std::string name;                           ///< of the catalogue, or of outside_causes()
  bool outside = false;                       ///< not in the catalogue
  bool by_catalogue = false;                  ///< acts as the catalogue's effect does, not as its file here
  std::map<std::string, double> values = {};  ///< of the catalogue's parameters where it has such, else its own
  std::map<std::string, double> place = {};   ///< where it sits and how uneven it is: nothing the catalogue knows
};

/// How one number of a cause is drawn.
struct Draw {
  enum class How {
    uniform,
    log_uniform,
    either_sign,  ///< size uniform in [lower, upper], sign drawn
    direction,    ///< this row and the next are a vector: length uniform in [lower, upper], direction uniform
    spread        ///< normal, standard deviation upper, cut at twice that
  };
  std::string name;
  How how;
  double lower, upper;
  bool of_place = false;
};

/// Names of the causes there are, catalogue first: those of the catalogue, in its order, and those outside it.
std::vector<std::string> catalogue_causes();
std::vector<std::string> outside_causes();

/// The rows a cause is drawn by. @throws InputError  no such cause, listing those there are
const std::vector<Draw>& draws_of(const std::string& name);

/// Draws a cause's numbers; they depend on seed and name alone.
/// @param size  of its strength, 0 to 1 in the range that its first row has, in place of a drawn one; all else is drawn
/// @throws InputError  no such cause; a size for one whose strength has no range (normal)
Cause draw_cause(const std::string& name, std::uint64_t seed, std::optional<double> size = {});

/// What a cause needs to know of the body to change fields.
struct Stage {
  const Body& body;
  const meshing::TetMesh& mesh;
  const simulation::Layout& layout;
  std::string pose;
};

/// Changes the fields of one pose, as the cause's file in causes/ says; some act on the scan or on the labels instead.
/// @pre  not by_catalogue
void apply_cause(const Cause& cause, const Stage& stage, simulation::Fields<double>& fields);

}  // namespace supine::phantom
