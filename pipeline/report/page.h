// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace supine::pipeline {

/// Style sheet, scripts and frame of the page, part of this program.
struct PageAssets {
  std::string_view frame;   ///< page.html with the marks @TITLE@ @STYLE@ @DATA@ @SCRIPT@ @VIEW3D@
  std::string_view style;   ///< page.css
  std::string_view script;  ///< our own scripts, one after the other
  std::string_view view3d;  ///< 3-D view with vtk.js; empty when it could not be built
};

/// What was built in.
PageAssets page_assets();

/// The whole page: needs no other file and no network. Same input, same bytes.
/// @throws InputError  a mark is missing in the frame
std::string render_page(const PageAssets& assets, const std::string& title, const nlohmann::ordered_json& data);

}  // namespace supine::pipeline
