// SPDX-License-Identifier: Apache-2.0
#include "apps/view_text.h"

#include <algorithm>

#include "forest/core/error.h"
#include "forest/core/file.h"

namespace forest {

scene::View read_view(const std::string& file_or_text, const Vec3& up, const scene::View* whole) {
  const std::size_t first = file_or_text.find_first_not_of(" \t\r\n");
  if (first != std::string::npos && file_or_text[first] == '{')
    return scene::parse_view(file_or_text, "--view", up, whole);
  const MappedFile file(file_or_text);
  return scene::parse_view(file.text(), file_or_text, up, whole);
}

std::vector<scene::View> read_views(const std::string& name, const Vec3& up, const scene::View* whole) {
  const MappedFile file(name);
  std::string_view text = file.text();
  std::vector<scene::View> views;
  for (std::size_t line = 1; !text.empty(); ++line) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view row = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (row.find_first_not_of(" \t\r") == row.npos) continue;
    try {
      views.push_back(scene::parse_view(row, name, up, whole));
    } catch (const InputError& error) {
      throw InputError(name, line, error.sentence());
    }
  }
  if (views.empty()) throw InputError(name, 0, "holds no view; write one on each line (docs/scene/view.md)");
  return views;
}

}  // namespace forest
