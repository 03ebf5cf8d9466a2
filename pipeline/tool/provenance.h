// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <string_view>

namespace supine::pipeline {

std::string_view supine_version();
/// Short commit the tools were built from, "-dirty" when files had changed; empty when git did not know.
std::string_view supine_commit();

/// What --version prints: version, commit, BLAS.
std::string version_text(std::string_view tool);

/// Every option and positional of @p app with the value that holds in this run, in the order of declaration.
/// Numbers and switches as such, several values as a list; options that were not given and have no default are left
/// out.
nlohmann::ordered_json resolved_options(const CLI::App& app);

/// The part of @p options that belongs into a sidecar: options that cannot change a result (-o, --threads, --json,
/// --force, --quiet) are dropped, and of a path only the file name stays, so that the same work in another
/// folder or on another machine gives the same bytes. Folders are dropped: their files are listed by hash.
nlohmann::ordered_json reproducible_options(const nlohmann::ordered_json& options);

}  // namespace supine::pipeline
