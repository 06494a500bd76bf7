// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/layer_maps.h"

#include <algorithm>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/number_order.h"
#include "forest/io/surface.h"

namespace forest::cli {
namespace {

// Vertices of an icosahedron whose edges were halved some times: 10 · 4ⁿ + 2.
bool is_icosahedron(std::size_t vertices) {
  std::size_t v = 12;
  while (v < vertices) v = 4 * v - 6;
  return v == vertices;
}

}  // namespace

std::vector<std::vector<float>> read_layer_maps(const std::vector<std::filesystem::path>& files,
                                                std::size_t vertices) {
  std::vector<std::vector<float>> maps;
  for (const auto& file : files) {
    auto values = io::read_surface_values(MappedFile(file).text(), file.string()).values;
    const bool nested = values.size() > vertices && is_icosahedron(vertices) && is_icosahedron(values.size());
    if (values.size() != vertices && !nested)
      throw InputError(file.string(), 0,
                       fmt::format("has {} values and the surface {} vertices; give the surface that the "
                                   "layers were measured on",
                                   values.size(), vertices));
    values.resize(vertices);
    if (const auto below = std::ranges::find_if(values, [](float mm) { return mm < 0.f; });
        below != values.end())
      throw InputError(file.string(), 0,
                       fmt::format("has {:.3g} at vertex {}, which is no thickness; give a map of thickness",
                                   *below, below - values.begin()));
    maps.push_back(std::move(values));
  }
  return maps;
}

std::string doubt_of_order(const std::vector<std::filesystem::path>& files) {
  std::vector<NumberedFile> order;
  try {
    order = in_number_order(files);
  } catch (const Error&) {  // numbers that say nothing
    return {};
  }
  if (order.size() < 2 || !order.front().number ||
      !std::ranges::equal(order.rbegin(), order.rend(), files.begin(), files.end(), {}, &NumberedFile::file))
    return {};
  return fmt::format(
      "layers are taken from the pia inwards as they are given, {} first, though the numbers in their names "
      "run "
      "the other way; if that is wrong, give them the other way round",
      files.front().string());
}

}  // namespace forest::cli
