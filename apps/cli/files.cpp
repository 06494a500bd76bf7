// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/files.h"

#include <algorithm>
#include <cctype>
#include <deque>
#include <fstream>
#include <functional>
#include <map>
#include <set>
#include <span>
#include <unistd.h>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/lower.h"
#include "forest/io/format.h"
#include "forest/repository/names.h"

#include "apps/cli/console.h"

namespace forest::cli {
namespace fs = std::filesystem;

std::string extension_of(const fs::path& path) { return lower(path.extension().string()); }

namespace {

// Whether it takes bytes and no file: a pipe, a terminal, what leads to an open file (/dev/stdout).
bool is_stream(const fs::path& place) {
  std::error_code none;
  const auto there = fs::symlink_status(followed(place), none);
  return fs::exists(there) && !fs::is_regular_file(there) && !fs::is_directory(there);
}

bool known(const fs::path& path) {
  return std::ranges::any_of(io::formats(), [&](const io::Format& f) {
    return f.read && std::ranges::find(f.extensions, extension_of(path)) != f.extensions.end();
  });
}

/// Whether a file of another extension (Eutectic's are pieces of the cell's name) is a neuron all the same. Columns of
/// numbers might be anything and do not count.
bool looks_like_neuron(const fs::path& path) {
  try {
    const MappedFile file(path);
    const std::string_view format = io::format_of(path, file.text()).name;
    return format != "swc" && format != "genesis";
  } catch (const InputError&) {
    return false;
  }
}

/// "7 .txt, 2 .jpg, 1 without extension": the most frequent first, at most eight.
std::string listed(const std::map<std::string, std::size_t>& extensions) {
  std::vector<std::pair<std::string, std::size_t>> rows(extensions.begin(), extensions.end());
  std::ranges::stable_sort(rows, std::greater(), &std::pair<std::string, std::size_t>::second);
  std::string text;
  for (std::size_t i = 0; i < std::min<std::size_t>(rows.size(), 8); ++i)
    text += fmt::format("{}{} {}", i ? ", " : "", rows[i].second,
                        rows[i].first.empty() ? "without extension" : repository::escaped(rows[i].first));
  return rows.size() > 8 ? text + ", …" : text;
}

}  // namespace

std::vector<fs::path> neuron_files(const std::vector<std::string>& names, Console& console) {
  std::vector<fs::path> files;
  std::map<std::string, std::size_t> skipped;  // by their extensions
  std::error_code none;
  for (const std::string& name : names) {
    if (!fs::is_directory(name, none)) {
      files.emplace_back(name);
      continue;
    }
    const auto first = std::ptrdiff_t(files.size());
    std::vector<fs::path> folders{name};
    std::vector<std::string> linked;
    while (!folders.empty()) {
      const fs::path folder = std::move(folders.back());
      folders.pop_back();
      std::error_code error;
      for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
        const fs::path& path = entry->path();
        if (entry->is_directory(none)) {
          if (entry->is_symlink(none))
            linked.push_back(repository::escaped(path.string()));  // it may lead in a circle
          else
            folders.push_back(path);
        } else if (known(path) || (entry->is_regular_file(none) && looks_like_neuron(path))) {
          files.push_back(path);
        } else {
          ++skipped[extension_of(path)];
        }
      }
      if (error) files.push_back(folder);  // whoever reads it says why it cannot be read
    }
    if (!linked.empty())
      console.warn(fmt::format("{} of {} {} skipped, first {}; name what is to be read",
                               counted(linked.size(), "linked folder"), repository::escaped(name),
                               linked.size() == 1 ? "is" : "are", linked.front()));
    if (first == std::ptrdiff_t(files.size()))
      throw InputError(name, 0, "holds no file of a known format; name the files themselves");
    std::sort(files.begin() + first, files.end());
  }
  std::set<fs::path> met;
  const auto again = [&](const fs::path& file) {
    return !met.insert(fs::absolute(file, none).lexically_normal()).second;
  };
  if (const std::size_t twice = std::erase_if(files, again))
    console.warn(fmt::format("{} {} named more than once and taken once", counted(twice, "file"),
                             twice == 1 ? "is" : "are"));
  std::size_t count = 0;
  for (const auto& [extension, number] : skipped) count += number;
  if (count)
    console.warn(fmt::format("{} of other formats {} skipped ({})", counted(count, "file"),
                             count == 1 ? "is" : "are", listed(skipped)));
  return files;
}

std::vector<std::string> folder_names(const std::vector<fs::path>& files) {
  std::vector<fs::path> folders;
  for (const fs::path& file : files) {
    std::error_code none;
    folders.push_back(fs::absolute(file, none).lexically_normal().parent_path());
  }
  std::map<fs::path, std::string> names;  // of each folder
  for (const fs::path& folder : folders) names[folder] = folder.filename().string();
  for (bool longer = true; longer;) {
    std::map<std::string, std::vector<fs::path>> called;
    for (const auto& [folder, name] : names) called[name].push_back(folder);
    longer = false;
    for (const auto& [name, same] : called)
      for (const fs::path& folder : same) {
        // One component more of those that are called alike, as long as there is one.
        const auto parts = std::ranges::count(name, '/') + 1;
        fs::path above = folder;
        for (std::ptrdiff_t i = 0; i < parts; ++i) above = above.parent_path();
        if (same.size() < 2 || above.filename().empty()) continue;
        names[folder] = above.filename().string() + '/' + name;
        longer = true;
      }
  }
  std::vector<std::string> result;
  for (const fs::path& folder : folders) result.push_back(names[folder]);
  return result;
}

bool may_skip(const Error& error, const fs::path& path, const std::vector<std::string>& names) {
  const bool named = std::ranges::find(names, path.string()) != names.end();
  return !named && (dynamic_cast<const io::NotANeuron*>(&error) || !known(path));
}

void Overwrites::look(const fs::path& to, std::string_view bytes) {
  std::error_code none;
  // What leads to an open file (/dev/stdout) is a stream, wherever the shell has sent it.
  if (!fs::is_regular_file(fs::symlink_status(followed(to), none))) return;
  bool same = false;
  try {
    same = MappedFile(to).text() == bytes;
  } catch (const InputError&) {  // what cannot be read is not known to be the same
  }
  if (same) return;
  const std::lock_guard lock(mutex_);
  found_.insert(to);
}

void Overwrites::refuse() const {
  if (found_.empty()) return;
  const std::size_t more = found_.size() - 1;
  throw Error(
      fmt::format("{} is there and holds something else{}, so nothing was written; choose another place, or "
                  "replace with --force",
                  repository::escaped(found_.begin()->string()),
                  more ? fmt::format(", as do {}", counted(more, "more file")) : ""));
}

void write_unless_there(const fs::path& to, std::string_view bytes, bool force) {
  Overwrites overwrites;
  if (!force) overwrites.look(to, bytes);
  overwrites.refuse();
  write_file(to, bytes);
}

void write_unless_there(const std::vector<std::pair<fs::path, std::string>>& files, bool force) {
  Overwrites overwrites;
  if (!force)
    for (const auto& [to, bytes] : files)
      if (!to.empty()) overwrites.look(to, bytes);
  overwrites.refuse();
  std::deque<NewFile> made;
  for (const auto& [to, bytes] : files)
    if (!to.empty()) made.emplace_back(to).write(std::as_bytes(std::span(bytes.data(), bytes.size())));
  for (NewFile& file : made) file.commit();
}

void must_have_folder(const fs::path& place) {
  if (is_stream(place)) return;
  std::error_code none;
  const fs::path named = place.has_filename() ? place : place.parent_path();  // a folder may end in a slash
  const fs::path folder = named.has_parent_path() ? named.parent_path() : fs::path(".");
  const std::string name = repository::escaped(place.string());
  if (!fs::is_directory(folder, none))
    throw Error(fmt::format("{}: its folder is not there; make it first", name));
  if (access(folder.c_str(), W_OK) != 0)
    throw Error(fmt::format("{}: its folder cannot be written; choose another", name));
}

void must_take_files(const std::vector<fs::path>& files, bool force) {
  std::error_code none;
  std::set<fs::path> places;
  for (const fs::path& file : files) {
    if (file.empty() || is_stream(file)) continue;
    const std::string name = repository::escaped(file.string());
    if (!places.insert(fs::weakly_canonical(file, none)).second)
      throw Error(fmt::format("{} is named twice; give each result a name of its own", name));
    if (fs::is_directory(file, none)) throw Error(fmt::format("{} is a folder; name a file in it", name));
    must_have_folder(file);
  }
  if (!force) refuse_existing(files);
}

void must_take_surfaces(const std::vector<fs::path>& files, bool force) {
  constexpr std::string_view others[] = {".obj",  ".ply", ".stl", ".off", ".vtk", ".vtp", ".glb",
                                         ".gltf", ".mz3", ".txt", ".csv", ".h5",  ".nii"};
  for (const fs::path& file : files)
    if (std::ranges::count(others, extension_of(file)))
      throw Error(fmt::format(
          "{}: surfaces are written as GIFTI (.gii) or in FreeSurfer's format (lh.pial), not as {}",
          repository::escaped(file.string()), extension_of(file)));
  must_take_files(files, force);
}

void must_not_be_read(const char* option, const fs::path& written, const std::vector<fs::path>& read) {
  std::error_code none;
  for (const fs::path& file : read) {
    if (fs::equivalent(written, file, none))
      throw Error(fmt::format("{} is what is read here, so it is not replaced; give {} another name",
                              repository::escaped(written.string()), option));
    // A link may lie in one folder and what it leads to in another.
    const fs::path folder = fs::canonical(fs::absolute(file, none).parent_path(), none);
    for (fs::path above : {folder, fs::canonical(file, none).parent_path()})
      for (; !above.empty(); above = above.has_relative_path() ? above.parent_path() : fs::path())
        if (fs::equivalent(written, above, none))
          throw Error(fmt::format("{} holds what is read here, so it is not replaced; give {} another name",
                                  repository::escaped(written.string()), option));
  }
}

void refuse_existing(const std::vector<fs::path>& files) {
  std::error_code none;
  for (const fs::path& file : files)
    if (!file.empty() && fs::exists(file, none))
      throw Error(fmt::format(
          "{} is there already, so nothing was written; choose another name, or replace it with --force",
          repository::escaped(file.string())));
}

void must_take(const fs::path& place, const Product& product) {
  std::error_code none;
  const std::string name = repository::escaped(place.string());
  const auto there = fs::symlink_status(followed(place), none);
  if (fs::is_directory(there)) throw Error(fmt::format("{} is a folder; name a file in it", name));
  if (is_stream(place)) return;
  if (*product.ending && extension_of(place) != product.ending)
    throw Error(
        fmt::format("{}: {}s have names that end in {}; choose one", name, product.what, product.ending));
  must_have_folder(place);
  if (!fs::exists(there) || fs::file_size(place, none) == 0) return;
  std::string mark(product.mark.size(), 0);
  std::ifstream file(place, std::ios::binary);
  file.seekg(std::streamoff(product.at)).read(mark.data(), std::streamsize(mark.size()));
  if (!file || mark != product.mark)
    throw Error(fmt::format("{} is there and is no {}, so nothing was written; choose another name", name,
                            product.what));
}

bool holds_files(const fs::path& folder) {
  std::error_code none;
  return fs::is_directory(folder, none) && !fs::is_empty(folder, none);
}

const io::Format* container_of(const fs::path& out) {
  std::error_code none;
  if (fs::is_directory(out, none)) return nullptr;
  const auto found = std::ranges::find_if(io::formats(), [&](const io::Format& f) {
    return f.write_all && std::ranges::find(f.extensions, extension_of(out)) != f.extensions.end();
  });
  return found == io::formats().end() ? nullptr : &*found;
}

bool is_cells_file(const fs::path& path) {
  std::error_code none;
  return extension_of(path) == io::find_format("cells")->extensions[0] && !fs::is_directory(path, none);
}

}  // namespace forest::cli
