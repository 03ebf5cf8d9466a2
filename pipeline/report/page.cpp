// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/report/page.h"

#include <fmt/core.h>

#include <array>
#include <utility>

#include "common/error.h"
#include "pipeline/report/encode.h"

namespace supine::pipeline {
namespace {

/// A script that holds "</script" or "<!--" would end the element it stands in.
std::string inline_script(std::string_view script) {
  std::string text(script);
  for (const auto& [from, to] : {std::pair("</script", "<\\/script"), {"</SCRIPT", "<\\/SCRIPT"}, {"<!--", "<\\!--"}})
    for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + 1))
      text.replace(at, std::string_view(from).size(), to);
  return text;
}

}  // namespace

std::string render_page(const PageAssets& assets, const std::string& title, const nlohmann::ordered_json& data) {
  const std::array<std::pair<std::string_view, std::string>, 5> marks = {{{"@TITLE@", escape_html(title)},
                                                                          {"@STYLE@", std::string(assets.style)},
                                                                          {"@DATA@", json_for_script(data)},
                                                                          {"@SCRIPT@", inline_script(assets.script)},
                                                                          {"@VIEW3D@", inline_script(assets.view3d)}}};
  std::string page;
  std::size_t from = 0;
  for (const auto& [mark, content] : marks) {  // in the order of the frame: what was put in is not searched again
    const std::size_t at = assets.frame.find(mark, from);
    if (at == std::string_view::npos)
      throw InputError(
          fmt::format("the frame of the report has no {} where it belongs; build supine-report again", mark));
    page.append(assets.frame.substr(from, at - from)).append(content);
    from = at + mark.size();
  }
  return page.append(assets.frame.substr(from));
}

}  // namespace supine::pipeline
