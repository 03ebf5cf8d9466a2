// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/case/body_places.h"

#include "meshing/surface/sound_surface.h"
#include "reconstruction/surface_io.h"

namespace supine::pipeline {
namespace {

meshing::BodyPlace read_place(Run& run, const NamedPlace& named, const std::string& frame) {
  meshing::BodyPlace place{named.name, named.point, named.normal, {}, named.within_mm, named.beyond};
  if (named.file) place.surface = reconstruction::read_surface(run.input(*named.file), frame);
  return place;
}

}  // namespace

std::vector<meshing::BodyPlace> read_supports(Run& run, const Case& description) {
  std::vector<meshing::BodyPlace> supports;
  for (const NamedPlace& named : description.supports) supports.push_back(read_place(run, named, description.frame));
  return supports;
}

std::vector<meshing::BodyPlace> read_parts(Run& run, const Case& description) {
  std::vector<meshing::BodyPlace> parts;
  for (const NamedPlace& named : description.parts) {
    parts.push_back(read_place(run, named, description.frame));
    if (parts.back().surface)
      meshing::require_sound(*parts.back().surface, meshing::Borders::closed, named.file->string());
  }
  return parts;
}

}  // namespace supine::pipeline
