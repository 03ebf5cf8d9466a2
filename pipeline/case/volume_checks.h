// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

#include "pipeline/case/two_poses.h"

namespace supine::pipeline {

/// Whether the volume that lies where @p grid says can be of this body: another patient's or frame's hardly holds it.
/// @param trusted  a part of the body is enough
/// @throws InputError  it holds less than half of the body's points in poses.from; a warning under 98 %
void check_holds_body(Run& run, const TwoPoses& poses, const segmentation::Grid& grid, const std::string& name,
                      bool trusted);

/// That of another body or place is darker outside of this skin in hardly more than half of its places.
/// @param trusted  it need not show the skin
/// @return  share of places where it is
/// @throws InputError  less than 65 %; a warning under 80 %
double check_shows_skin(Run& run, const TwoPoses& poses, const segmentation::GreyImage& image, const std::string& name,
                        bool trusted);

/// A grid that misses the body, or voxels as large as it, show nothing of it.
/// @throws InputError  fewer than 10 voxels lie in the body
void check_body_is_there(const std::filesystem::path& target, const warp::WarpedVolume& carried);

}  // namespace supine::pipeline
