// SPDX-License-Identifier: Apache-2.0
// brainforest cortex contours and cortex compare: sections of surfaces, volumes and pictures as curves, and how successive
// ones differ.
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <compare>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/lower.h"
#include "forest/core/number_order.h"
#include "forest/cortex/compare.h"
#include "forest/cortex/volume.h"
#include "forest/io/contours.h"
#include "forest/io/grey_picture.h"
#include "forest/io/nifti.h"
#include "forest/io/surface.h"

#include "apps/cli/console.h"
#include "apps/cli/contour_files.h"
#include "apps/cli/cortex.h"
#include "apps/cli/files.h"
#include "apps/cli/options.h"

namespace forest::cli {
namespace {

namespace fs = std::filesystem;

std::vector<NumberedFile> in_order(const fs::path& folder, std::span<const fs::path> files) {
  try {
    return in_number_order(files);
  } catch (const Error& error) {
    throw Error(fmt::format("{}: {}", folder.string(), error.what()));
  }
}

// Between two sections half as far apart again as most, or farther, one is missing.
void tell_gaps(const fs::path& folder, std::span<const NumberedFile> files, Console& console) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < files.size(); ++i) {
    const auto one = files[i - 1].number, next = files[i].number;
    if (!one || !next || *next <= *one) return;  // no numbers of sections
    steps.push_back(*next - *one);
  }
  if (steps.size() < 2) return;
  auto sorted = steps;
  std::ranges::nth_element(sorted, sorted.begin() + std::ptrdiff_t(sorted.size() / 2));
  constexpr double half_again = 1.499;  // decimals are not exact
  const double usual = sorted[sorted.size() / 2];
  const auto gap = std::ranges::find_if(steps, [&](double step) { return step >= half_again * usual; });
  if (gap == steps.end()) return;
  const auto at = std::size_t(gap - steps.begin());
  console.warn(fmt::format(
      "{}: sections seem to be missing between {} and {}, and all are taken at equal distances; bring "
      "them in",
      folder.string(), files[at].file.filename().string(), files[at + 1].file.filename().string()));
}

// Reconstruct's µm are meant: cells in electron micrographs are no brains.
void tell_small(const cortex::ContourStack& stack, const fs::path& path, Console& console) {
  if (const std::string small = cortex::too_small_for_a_brain(stack);
      !small.empty() && extension_of(path) != ".jser")
    console.warn(path.string() + ": " + small);
}

constexpr double least_tolerance = 1e-4;  // mm

// Which options said something of an input.
struct Used {
  bool name = false, axis = false, spacing = false, threshold = false, pixel = false, unit = false,
       straight = false;
};

struct Options {
  CLI::App* command = nullptr;
  std::vector<fs::path> inputs;
  std::vector<std::string> names, objects;
  fs::path out;
  std::string axis = "y";
  double spacing = 1., offset = 0., threshold = NAN, pixel = 0., tolerance = .02, unit = 1.;
  bool straight = false, force = false;
};

// The pictures of sections: files of a folder, one a section, or the pages of a file.
class Pictures {
 public:
  Pictures(const fs::path& path, Console& console) : files_{path} {
    const bool folder = fs::is_directory(path);
    if (folder) {
      files_ = sections_in(path, io::is_picture_name);
      if (files_.empty())
        throw Error(path.string() +
                    ": has no picture (.png, .tif, .tiff) and no drawing (.svg); give a folder of sections");
      const std::vector<NumberedFile> numbered = in_order(path, files_);
      tell_gaps(path, numbered, console);
      std::ranges::transform(numbered, files_.begin(), &NumberedFile::file);
    }
    if (files_.size() == 1) open(0);
    if (!folder && size() == 1) throw Error(path.string() + ": is one section; give the folder of all");
  }

  std::size_t size() const { return files_.size() == 1 ? file_->pages() : files_.size(); }
  bool pages() const { return files_.size() == 1; }  // of one file
  const fs::path& name(std::size_t i) const { return pages() ? files_[0] : files_[i]; }
  io::GreyPicture read(std::size_t i) {  // in their order
    if (pages()) return file_->read(i);
    open(i);
    if (file_->pages() != 1)
      throw InputError(
          name(i).string(), 0,
          fmt::format("has {} pages, and other pictures lie beside it; give it alone", file_->pages()));
    return file_->read();
  }

 private:
  void open(std::size_t i) {
    file_.reset();
    bytes_.emplace(files_[i]);
    file_.emplace(bytes_->text(), files_[i].string());
  }

  std::vector<fs::path> files_;
  std::optional<MappedFile> bytes_;
  std::optional<io::GreyFile> file_;
};

cortex::Volume read_pictures(const fs::path& path, const Options& options, Console& console) {
  Pictures pictures(path, console);
  if (!(options.pixel > 0.))
    throw Error(path.string() + ": pictures do not say how large they are; give --pixel, in mm");
  const cortex::Axis axis = axis_of(options.axis);
  const int across = int(axis);
  const auto [right, up] = flat_axes(axis);
  cortex::Volume volume;
  std::array<std::size_t, 3> stride{};
  console.progress().begin("reading pictures", pictures.size());
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const io::GreyPicture picture = pictures.read(i);
    if (i == 0) {
      if (double(picture.width) * picture.height * double(pictures.size()) > 1e9)
        throw Error(path.string() + ": the pictures have more than 10⁹ pixels; make them smaller");
      volume.size[std::size_t(right)] = picture.width, volume.size[std::size_t(up)] = picture.height;
      volume.size[std::size_t(across)] = pictures.size();
      volume.step[right] = volume.step[up] = 1e3 * options.pixel, volume.step[across] = 1e3 * options.spacing;
      volume.origin[across] = 1e3 * options.offset;
      volume.values.resize(volume.size[0] * volume.size[1] * volume.size[2]);
      stride = {1, volume.size[0], volume.size[0] * volume.size[1]};
    }
    if (picture.width != volume.size[std::size_t(right)] || picture.height != volume.size[std::size_t(up)])
      throw InputError(
          pictures.name(i).string(), 0,
          fmt::format("has {} × {} pixels{} where the first picture has {} × {}; align them", picture.width,
                      picture.height, pictures.pages() ? fmt::format(" on page {}", i + 1) : "",
                      volume.size[std::size_t(right)], volume.size[std::size_t(up)]));
    for (std::size_t y = 0; y < picture.height; ++y)
      for (std::size_t x = 0; x < picture.width; ++x)
        volume.values[x * stride[std::size_t(right)] + y * stride[std::size_t(up)] +
                      i * stride[std::size_t(across)]] =
            picture.values[(picture.height - 1 - y) * picture.width + x];
    console.progress().advance();
  }
  console.progress().end();
  if (const auto odd = std::ranges::count_if(volume.values, [](float v) { return std::isnan(v); }))
    console.warn(fmt::format("{}: has {} no number; what is none counts as outside", path.string(),
                             odd == 1 ? "a pixel that is" : fmt::format("{} pixels that are", odd)));
  return volume;
}

// Distances are mm: so many sections are those of a file in µm.
std::vector<double> planes_of(double low, double high, const Options& options, const fs::path& path) {
  const double spacing = 1e3 * options.spacing;
  constexpr double most = 20'000.;
  if (high - low > cortex::largest_brain)
    throw Error(fmt::format("{}: reaches over {:.4g} m, as no brain does; give it in mm", path.string(),
                            (high - low) / 1e6));
  if ((high - low) / spacing > most)
    throw Error(
        fmt::format("{}: reaches over {:.4g} mm, which would be {:.0f} sections at --spacing {:g} mm; give "
                    "it in mm, or a larger --spacing",
                    path.string(), (high - low) / 1e3, (high - low) / spacing, options.spacing));
  return cortex::planes_between(low, high, spacing, 1e3 * options.offset);
}

// What contours would cross, before they are found.
void check_threshold(const cortex::Volume& volume, const fs::path& path, double threshold, Console& console) {
  float least = INFINITY, most = -INFINITY;
  for (const float v : volume.values)
    if (std::isfinite(v)) least = std::min(least, v), most = std::max(most, v);
  if (least > most) throw Error(path.string() + ": has no value that is a number");
  if (!(threshold >= least && threshold < most))
    throw Error(fmt::format("{}: no boundary lies at --threshold {:g}: its values are {:g} to {:g}",
                            path.string(), threshold, least, most));
  // A share of the range is easily given where a value is wanted.
  constexpr double rim = .01;
  if (threshold - double(least) < rim * double(most - least))
    console.warn(
        fmt::format("{}: --threshold {:g} lies within a hundredth of the least of its values, {:g} to {:g}; "
                    "half way is {:g}",
                    path.string(), threshold, least, most, .5 * (double(least) + double(most))));
}

// What is inside at the edge of a picture is closed along it, wherever the tissue goes on.
void tell_edges(const cortex::ContourStack& stack, const cortex::Volume& volume, const fs::path& path,
                Console& console) {
  const auto beyond = [&, axes = flat_axes(stack.axis)](const Eigen::Vector2d& p) {
    const auto outside = [&](double at, int axis) {
      const double voxels = (at - volume.origin[axis]) / volume.step[axis];
      return voxels < 0. || voxels > double(volume.size[std::size_t(axis)] - 1);
    };
    return outside(p.x(), axes[0]) || outside(p.y(), axes[1]);
  };
  const auto cut = [&](const cortex::Section& section) {
    return std::ranges::any_of(section.contours, [&](const cortex::Contour& contour) {
      return std::ranges::any_of(contour.curve.points, beyond);
    });
  };
  const auto first = std::ranges::find_if(stack.sections, cut);
  if (first == stack.sections.end()) return;
  console.warn(fmt::format(
      "{}: {} reach the edge of the picture and are closed along it, first that at {:.6g} mm; if tissue goes "
      "on there, give larger pictures",
      path.string(), counted(std::size_t(std::count_if(first, stack.sections.end(), cut)), "section"),
      first->at / 1e3));
}

cortex::ContourStack of_volume(const cortex::Volume& volume, const fs::path& path, const std::string& name,
                               const Options& options, bool pictures, Console& console) {
  if (!options.command->count("--threshold"))
    throw Error(path.string() + ": what is inside is a question of grey; give --threshold");
  check_threshold(volume, path, options.threshold, console);
  const cortex::Axis axis = axis_of(options.axis);
  const double low = volume.origin[int(axis)],
               high = low + volume.step[int(axis)] * double(volume.size[std::size_t(axis)] - 1);
  std::vector<double> planes = planes_of(low, high, options, path);
  if (pictures)  // each as it is
    for (std::size_t i = 0; i < planes.size(); ++i) planes[i] = low + volume.step[int(axis)] * double(i);
  cortex::ContourStack stack = cortex::contours_of(volume, name, axis, planes, options.threshold);
  tell_edges(stack, volume, path, console);
  return stack;
}

// Where contours cross: one sentence for each two boundaries, and how often as a list.
nlohmann::ordered_json tell_crossings(const cortex::ContourStack& stack, Console& console) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const cortex::Crossings& two : cortex::crossings(stack)) {
    const std::string &one = stack.objects[two.object], &other = stack.objects[two.other];
    const double at = stack.sections[two.section].at / 1e3, x = two.place.x() / 1e3, y = two.place.y() / 1e3;
    list.push_back({{"objects", {one, other}},
                    {"places", two.places},
                    {"sections", two.sections},
                    {"first", {{"at", at}, {"place", {x, y}}}}});
    console.warn(
        fmt::format("{} cross at {} in {}, first in section {} ({:.6g} mm) at ({:.6g}, {:.6g}) mm; {}",
                    one == other ? fmt::format("contours of '{}'", one)
                                 : fmt::format("contours of '{}' and '{}'", one, other),
                    counted(two.places, "place"), counted(two.sections, "section"), two.section + 1, at, x, y,
                    one == other ? "draw them apart" : "there is no tissue between them there"));
  }
  return list;
}

// What the i-th boundary is called, unless its file says so.
std::string name_of(const Options& options, std::size_t i) {
  return i < options.names.size()    ? options.names[i]
         : options.inputs.size() > 2 ? options.inputs[i].stem().string()
         : i == 0                    ? "outer"
                                     : "inner";
}

// An option that says nothing of any input was meant for another.
void refuse_unused(const Options& options, const Used& used) {
  must_be_used(*options.command,
               {{"--axis", "of surfaces, volumes and pictures, and none is given", used.axis},
                {"--spacing", "of surfaces, volumes and pictures, and none is given", used.spacing},
                {"--offset", "of surfaces, volumes and pictures, and none is given", used.spacing},
                {"--name", "of files with one boundary, and none is given", used.name || used.axis},
                {"--threshold", "of volumes and pictures, and none is given", used.threshold},
                {"--pixel", "of pictures, and none is given", used.pixel},
                {"--unit", "of an .slc file, and none is given", used.unit},
                {"--tolerance", "of curves fitted to straight contours, and none is to be fitted",
                 !options.straight && used.straight}});
}

// The sections of a surface; what is wrong with it is said with the name of its file.
cortex::ContourStack cut(const Mesh& surface, const std::string& name, const fs::path& file,
                         cortex::Axis axis, std::span<const double> planes) {
  if (volume(surface) < 0.)
    throw InputError(file.string(), 0,
                     "has triangles that face inwards, so that its inside is outside; turn them");
  try {
    return cortex::cut(surface, name, axis, planes);
  } catch (const Error& error) {
    throw InputError(file.string(), 0, error.what());
  }
}

void run(const Options& options, Console& console) {
  must_take_contours(options.out, options.force);
  must_not_be_read("--out", options.out, options.inputs);
  if (options.names.size() > options.inputs.size())
    throw Error(fmt::format("{} are named for {}, each of which has one; name each once",
                            counted(options.names.size(), "boundary", "boundaries"),
                            counted(options.inputs.size(), "file")));
  for (std::size_t i = 0; i < options.inputs.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (std::error_code none; fs::equivalent(options.inputs[i], options.inputs[j], none))
        throw Error(options.inputs[i].string() +
                    ": is given twice; give the outer boundary and the inner one");
  std::vector<cortex::ContourStack> stacks;
  std::vector<Mesh> surfaces;
  std::vector<std::string> surface_names;
  std::vector<fs::path> surface_files;
  double low = HUGE_VAL, high = -HUGE_VAL;
  const cortex::Axis axis = axis_of(options.axis);
  Used used;
  std::set<std::string> given;
  const auto must_be_new = [&](const std::string& name) {
    if (!given.insert(name).second)
      throw Error(
          fmt::format("two boundaries are to be called '{}'; give each a name of its own by --name", name));
    return name;
  };
  for (std::size_t i = 0; i < options.inputs.size(); ++i) {
    const fs::path& path = options.inputs[i];
    const std::string name = name_of(options, i);
    const bool folder = fs::is_directory(path), drawn = folder && !sections_in(path, is_drawing_name).empty();
    if (drawn && !sections_in(path, io::is_picture_name).empty())
      console.warn(path.string() + ": has drawings (.svg) and pictures; the drawings are taken");
    if ((folder && !drawn) || (!folder && io::is_picture_name(extension_of(path)))) {
      used.axis = used.spacing = used.threshold = used.pixel = true;
      stacks.push_back(
          of_volume(read_pictures(path, options, console), path, must_be_new(name), options, true, console));
      continue;
    }
    if (folder || extension_of(path) == ".contours" || extension_of(path) == ".svg" ||
        extension_of(path) == ".jser" || extension_of(path) == ".slc") {
      used.unit |= extension_of(path) == ".slc";
      cortex::ContourStack& read = stacks.emplace_back(read_contour_files(path, 1e3 * options.unit, console));
      if (i < options.names.size() && read.objects.size() == 1)
        read.objects[0] = options.names[i], used.name = true;
      continue;
    }
    const MappedFile file(path);
    const std::string ending = lower(path.filename().string());
    if (io::may_be_nifti(file.text()) && (ending.ends_with(".nii") || ending.ends_with(".nii.gz"))) {
      used.axis = used.spacing = used.threshold = true;
      const io::NiftiVolume read = io::read_nifti(file.text(), path.string());
      for (const std::string& oddity : read.oddities) console.warn(path.string() + ": " + oddity);
      stacks.push_back(of_volume(read.volume, path, must_be_new(name), options, false, console));
      continue;
    }
    used.axis = used.spacing = true;
    surfaces.push_back(io::read_surface(file.text(), path.string()));
    surface_files.push_back(path);
    surface_names.push_back(must_be_new(name));
    for (const Vec3& p : surfaces.back().positions)
      low = std::min(low, double(p[int(axis)])), high = std::max(high, double(p[int(axis)]));
  }
  used.straight = !surfaces.empty();
  for (const cortex::ContourStack& stack : stacks)
    for (const cortex::Section& section : stack.sections)
      for (const cortex::Contour& contour : section.contours) used.straight |= contour.curve.polygon();
  refuse_unused(options, used);
  // All surfaces by the same planes.
  const auto planes =
      surfaces.empty() ? std::vector<double>{} : planes_of(low, high, options, options.inputs.front());
  for (std::size_t i = 0; i < surfaces.size(); ++i)
    stacks.push_back(cut(surfaces[i], surface_names[i], surface_files[i], axis, planes));
  cortex::ContourStack stack = cortex::together(stacks);
  if (!options.objects.empty()) stack = cortex::only(stack, options.objects);
  const std::string fault = cortex::fault_of(stack);
  if (!fault.empty()) throw Error(options.inputs.front().string() + ": " + fault);
  if (surfaces.empty()) tell_small(stack, options.inputs.front(), console);
  cortex::FitSummary summary;
  if (!options.straight)
    stack = cortex::fitted(stack, {.tolerance = 1e3 * options.tolerance}, summary, console.progress());
  std::size_t loops = 0;
  double along = 0.;
  for (const cortex::Section& section : stack.sections)
    for (const cortex::Contour& contour : section.contours) ++loops, along += length(contour.curve);
  if (loops == 0)
    throw Error(fmt::format("no section of {} has a contour; {}", options.inputs.front().string(),
                            used.axis ? "check --axis, --spacing and --offset" : "draw some, as paths"));
  if (stack.sections.size() < 3 && !surfaces.empty())
    console.warn(
        fmt::format("{} reaches over {:.3g} mm, so there {}; a smaller --spacing gives more, if it is in mm",
                    options.inputs.front().string(), (high - low) / 1e3,
                    stack.sections.size() == 1 ? "is one section" : "are two sections"));
  write_contour_files(stack, options.out);
  // About a quarter of its length is how large a contour is.
  if (const double size = .25 * along / double(loops); summary.pieces && 1e3 * options.tolerance > .05 * size)
    console.warn(fmt::format(
        "curves may be {:g} mm off, which is much beside contours of about {:.2g} mm; {}", options.tolerance,
        size / 1e3,
        size / 1e5 >= least_tolerance ? fmt::format("give a smaller --tolerance, such as {:.1g}", size / 1e5)
                                      : "keep what was drawn by --straight"));
  console.print({{"file", options.out.string()},
                 {"sections", stack.sections.size()},
                 {"contours", loops},
                 {"length", along / 1e3},
                 {"cubics", summary.pieces},
                 {"corners", summary.corners},
                 {"rms", summary.rms / 1e3},
                 {"greatest", summary.greatest / 1e3},
                 {"length_per_cubic", summary.pieces ? summary.length / 1e3 / double(summary.pieces) : 0.},
                 {"crossings", tell_crossings(stack, console)}});
  console.table(
      {"file", "sections", "contours", "length mm", "cubics", "mm a cubic", "rms mm", "greatest mm"},
      {{options.out.string(), std::to_string(stack.sections.size()), std::to_string(loops),
        fmt::format("{:.4g}", along / 1e3), std::to_string(summary.pieces),
        summary.pieces ? fmt::format("{:.2f}", summary.length / 1e3 / double(summary.pieces)) : "",
        fmt::format("{:.3g}", summary.rms / 1e3), fmt::format("{:.3g}", summary.greatest / 1e3)}});
}

}  // namespace

std::function<void()> cortex_contours(CLI::App& command, Console& console) {
  const auto o = std::make_shared<Options>();
  o->command = &command;
  command
      .add_option("input", o->inputs,
                  "Surfaces (GIFTI, FreeSurfer, PLY, STL, OBJ), volumes (.nii, .nii.gz), folders of pictures "
                  "(.png, .tif), "
                  "one a section, or a TIFF of many pages, or contours of other programs (.jser, .slc, "
                  ".svg): of two the first is the outer boundary, the second the inner one")
      ->required()
      ->type_name("FILE");
  command.add_option("-o,--out", o->out, "FILE.contours, or a folder for one .svg a section")
      ->required()
      ->type_name("FILE");
  command.add_option("--name", o->names, "What the boundaries are called, in the order of the files")
      ->type_name("NAME");
  command.add_option("--object", o->objects, "Keep only these boundaries, of a file with many")
      ->type_name("NAME");
  command.add_option("--axis", o->axis, "Across the sections: x sagittal, y coronal, z horizontal")
      ->capture_default_str()
      ->check(CLI::IsMember({"x", "y", "z"}));
  must_be_within(*command.add_option("--spacing", o->spacing, "Of the sections, mm")->capture_default_str(),
                 1e-4, 1e3);
  must_be_within(
      *command.add_option("--offset", o->offset, "Where one of them is, mm")->capture_default_str(), -1e4,
      1e4);
  command.add_option("--threshold", o->threshold,
                     "Of a volume or pictures (0–1), which need it: what is brighter is inside");
  must_be_within(*command.add_option("--pixel", o->pixel, "Of pictures, mm"), 1e-6, 1e3);
  must_be_within(*command.add_option("--unit", o->unit, "Of an .slc file, mm")->capture_default_str(), 1e-6,
                 1e3);
  must_be_within(
      *command.add_option("--tolerance", o->tolerance, "Of the curves: root mean square of the distance, mm")
           ->capture_default_str(),
      least_tolerance, 10.);
  command.add_flag("--straight", o->straight, "Keep polygons as they are, and fit no curves");
  add_force(command, o->force);
  return [o, &console] { run(*o, console); };
}

std::function<void()> cortex_compare(CLI::App& command, Console& console) {
  struct Compare {
    fs::path file, svg;
    std::string object;
    double unit = 1.;
    bool force = false;
  };
  const auto o = std::make_shared<Compare>();
  command.add_option("file", o->file, "Contours: .contours, .jser, .slc, or a folder of .svg")
      ->required()
      ->type_name("FILE");
  command.add_option("--object", o->object, "Compare only this boundary")->type_name("NAME");
  command.add_option("--svg", o->svg, "A folder for drawings, each section over the one before it")
      ->type_name("FOLDER");
  must_be_within(*command.add_option("--unit", o->unit, "Of an .slc file, mm")->capture_default_str(), 1e-6,
                 1e3);
  add_force(command, o->force);
  return [o, &command, &console] {
    if (extension_of(o->svg) == ".contours")
      throw Error(o->svg.string() + ": is to be a folder of drawings; give one");
    if (!o->svg.empty()) must_take_contours(o->svg, o->force);
    must_not_be_read("--svg", o->svg, {o->file});
    must_be_used(command,
                 {{"--unit", "of an .slc file, and none is given", extension_of(o->file) == ".slc"}});
    cortex::ContourStack stack = read_contour_files(o->file, 1e3 * o->unit, console);
    if (stack.sections.size() < 2)
      throw Error(fmt::format("{}: has {}; two are compared", o->file.string(),
                              counted(stack.sections.size(), "section")));
    if (!o->object.empty()) stack = cortex::only(stack, std::array{o->object});
    if (const std::string fault = cortex::fault_of_numbers(stack); !fault.empty())
      throw Error(o->file.string() + ": " + fault);
    tell_small(stack, o->file, console);
    nlohmann::ordered_json rows = nlohmann::ordered_json::array();
    std::vector<std::vector<std::string>> table;
    const auto mm = [](double um) {
      return std::isnan(um) ? ""
             : um < 10.     ? fmt::format("{:.3g}", um / 1e3)
                            : fmt::format("{:.3f}", um / 1e3);
    };
    for (const cortex::SectionChange& change : cortex::changes(stack, console.progress())) {
      const std::string& name = stack.objects[change.object];
      const double from = stack.sections[change.section].at / 1e3,
                   to = stack.sections[change.section + 1].at / 1e3;
      rows.push_back({{"from", from},
                      {"to", to},
                      {"object", name},
                      {"mean", change.mean / 1e3},
                      {"p95", change.p95 / 1e3},
                      {"hausdorff", change.greatest / 1e3},
                      {"overlap", change.overlap}});
      table.push_back(
          {fmt::format("{:.6g}", from), fmt::format("{:.6g}", to), name, mm(change.mean), mm(change.p95),
           mm(change.greatest),
           std::isnan(change.mean) ? "in one section only" : fmt::format("{:.3f}", change.overlap)});
    }
    if (!o->svg.empty()) write_contour_files(stack, o->svg, true);
    console.print({{"pairs", rows}, {"crossings", tell_crossings(stack, console)}});
    console.table({"from mm", "to mm", "object", "mean mm", "p95 mm", "Hausdorff mm", "overlap"}, table);
  };
}

}  // namespace forest::cli
