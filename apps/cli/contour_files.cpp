// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/contour_files.h"

#include <algorithm>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/io/contours.h"
#include "forest/io/new_folder.h"

#include "apps/cli/console.h"
#include "apps/cli/files.h"

namespace forest::cli {

namespace fs = std::filesystem;

cortex::Axis axis_of(const std::string& name) {
  return name == "x" ? cortex::Axis::x : name == "z" ? cortex::Axis::z : cortex::Axis::y;
}

std::vector<fs::path> sections_in(const fs::path& folder, bool (*wanted)(std::string_view extension)) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder))
    if (wanted(extension_of(entry.path())) && !entry.path().filename().string().starts_with('.'))
      files.push_back(entry.path());
  std::ranges::sort(files);
  return files;
}

bool is_drawing_name(std::string_view extension) { return extension == ".svg"; }

cortex::ContourStack read_contour_files(const fs::path& path, double unit, Console& console) {
  const auto read = [&](const fs::path& file) {
    io::ReadContours result = io::read_contours(MappedFile(file).text(), file.string(), unit);
    for (const std::string& oddity : result.oddities) console.warn(file.string() + ": " + oddity);
    return std::move(result.stack);
  };
  if (!fs::is_directory(path)) return read(path);
  const std::vector<fs::path> files = sections_in(path, is_drawing_name);
  if (files.empty()) throw InputError(path.string(), 0, "has no .svg file; give a folder of drawn sections");
  std::vector<cortex::ContourStack> drawings;
  for (const fs::path& file : files) drawings.push_back(read(file));
  return io::gathered(drawings, path.string());
}

namespace {

// What is there and may be replaced.
void must_be_drawings(const fs::path& path) {
  if (!fs::is_directory(path))
    throw Error(path.string() + ": is there and no folder for drawings; give another name");
  for (const auto& entry : fs::directory_iterator(path))
    if (const std::string name = entry.path().filename().string();
        !(name.starts_with("section_") && name.ends_with(".svg")))
      throw Error(fmt::format(
          "{}: holds more than drawings of sections ({}), and would be replaced; give another folder",
          path.string(), name));
}

}  // namespace

void must_take_contours(const fs::path& path, bool force) {
  if (extension_of(path) == ".contours") return must_take_files({path}, force);
  if (path.has_extension())
    throw Error(path.string() + ": is neither FILE.contours nor a folder for drawings; give one of them");
  must_have_folder(path);
  if (fs::exists(path)) must_be_drawings(path);
  if (!force) refuse_existing({path});
}

void write_contour_files(const cortex::ContourStack& stack, const fs::path& path, bool overlay) {
  if (extension_of(path) == ".contours") return write_file(path, io::write_contours(stack));
  // All drawings or none, and none of earlier sections between them.
  if (fs::exists(path)) must_be_drawings(path);
  io::NewFolder drawings(path);
  for (std::size_t i = 0; i < stack.sections.size(); ++i)
    drawings.write(fmt::format("section_{:04}.svg", i + 1),
                   io::write_svg(stack, stack.sections[i], overlay && i ? &stack.sections[i - 1] : nullptr));
  drawings.commit();
}

}  // namespace forest::cli
