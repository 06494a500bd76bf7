// SPDX-License-Identifier: Apache-2.0
// Which files a command line means, and which it may not replace.
#pragma once

#include <filesystem>
#include <mutex>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace forest {
class Error;
}

namespace forest::io {
struct Format;
}

namespace forest::cli {

class Console;

/// Files as they were named, whether they are there or not; folders as the files of a known format anywhere below them,
/// sorted, by extension or by what is in them; each once. How many others lie there is told, and folders that cannot be read. Throws
/// InputError for a folder without any.
std::vector<std::filesystem::path> neuron_files(const std::vector<std::string>& names, Console& console);

/// What each file's folder is called: by its name, and where several folders have that, by as many of those above as tell them apart.
std::vector<std::string> folder_names(const std::vector<std::filesystem::path>& files);

/// Whether a file that was refused is told as skipped and is no failure: it holds no neuron, and nobody named it.
/// @param names  what the command line named, as neuron_files takes them
bool may_skip(const Error& error, const std::filesystem::path& path, const std::vector<std::string>& names);

/// Files that a verb would replace by something else, found before its first byte is written: show it all that will be
/// written, then refuse(). Files that hold just these bytes do not count, so a command may be repeated.
class Overwrites {
 public:
  void look(const std::filesystem::path& to, std::string_view bytes);  // by any thread
  /// Throws Error when there are any.
  void refuse() const;

 private:
  std::mutex mutex_;
  std::set<std::filesystem::path> found_;
};

/// One file, unless another holds something else there and `force` is not given.
void write_unless_there(const std::filesystem::path& to, std::string_view bytes, bool force);

/// Several files, all or none; those without a name are not wanted.
void write_unless_there(const std::vector<std::pair<std::filesystem::path, std::string>>& files, bool force);

/// ".gii" of "lh.GII".
std::string extension_of(const std::filesystem::path& path);

/// Throws Error when what is made over minutes could not be put there in the end: two of the places are one, a folder is missing
/// or cannot be written, a folder is there, or a file, unless `force` is given. Streams may be named as often as one likes, empty
/// paths are not wanted.
void must_take_files(const std::vector<std::filesystem::path>& files, bool force);
/// The same for a surface, which io::write_surface writes: names of other formats than its are refused.
void must_take_surfaces(const std::vector<std::filesystem::path>& files, bool force);
/// Throws Error when what an option says to write is one of the files that are read, by whatever name, or a folder that holds one.
void must_not_be_read(const char* option, const std::filesystem::path& written,
                      const std::vector<std::filesystem::path>& read);
/// Throws Error when the folder of something new is missing or cannot be written.
void must_have_folder(const std::filesystem::path& place);

/// Throws Error when one of them is there, whatever it holds: people write into tables.
void refuse_existing(const std::vector<std::filesystem::path>& files);

/// What a verb draws or packs anew each time: it replaces an older one of its kind, and nothing else.
struct Product {
  const char* what;
  const char* ending;     // that its name must have; empty: any
  std::size_t at;         // where in the file the mark is
  std::string_view mark;  // by which it is known
};
inline constexpr Product png_picture{"PNG picture", ".png", 0, "\x89PNG\r\n"},
    mp4_film{"MP4 film", ".mp4", 4, "ftyp"}, forest_file{"forest file", "", 0, "BFOREST\n"},
    synapses_file{"file of synapses", "", 0, "BFSYNAP\n"}, activity_file{"activity file", "", 0, "BFACTIV\n"},
    hdf5_file{"HDF5 file", "", 0, "\x89HDF\r\n\x1a\n"};

/// Throws Error when a product cannot go there: its folder is missing, its name ends otherwise, something else is there.
/// To be asked before the work begins. Where no file can lie (a pipe, /dev/stdout) anything goes.
void must_take(const std::filesystem::path& place, const Product& product);

/// Whether there may be something to overwrite: the folder is there and not empty.
bool holds_files(const std::filesystem::path& folder);

/// The format of a file that takes all neurons together: what this name ends in, if its files hold many and it is no
/// folder. Otherwise null.
const io::Format* container_of(const std::filesystem::path& out);

/// Whether this is a file of cells (io/cells.h) by its name, there or not; a folder of such a name is none.
bool is_cells_file(const std::filesystem::path& path);

}  // namespace forest::cli
