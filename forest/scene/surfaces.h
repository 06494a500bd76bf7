// SPDX-License-Identifier: Apache-2.0
// Surfaces beside the neurons of a picture: those of a cortex, plain or coloured by the values on them. What lies deep in a
// sulcus gets less light, so that gyri and sulci are told apart from any side and whatever the colour.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "forest/core/bounds.h"
#include "forest/frame/frame.h"
#include "forest/geometry/mesh.h"
#include "forest/scene/colour_map.h"
#include "forest/scene/colouring.h"

namespace forest::scene {

struct Colouring;

/// From where a brain is looked at. Its axes run to the right, to the front and upwards.
enum class Side : std::uint8_t { left, right, front, back, above, below };

/// An area of a parcellation.
struct AreaColour {
  std::int32_t key = 0;
  Vec3 colour = Vec3::Constant(.7f);  // linear light
  std::string name = {};
};

/// How deep below its smoothed surface every vertex lies, in units of the smoothing: negative on gyri, positive in sulci, 0
/// on what is flat. The smoothing is a diffusion over the mesh as wide as `width` (µm), as FreeSurfer's sulcal depth is a
/// movement during one (Fischl, Sereno & Dale 1999, NeuroImage 9:195).
std::vector<float> depth_below_smoothed(const Mesh& mesh, std::span<const Vec3> normals, float width);

/// Whether zeros among the values on a surface stand for "none": FreeSurfer writes 0 for the thickness, area or volume of what is
/// no cortex, such as the medial wall. So where nothing is negative, but for what rounding leaves, and at least every hundredth vertex is exactly 0.
bool zero_means_none(std::span<const float> values);

/// Of arrays that a frame::Surface is made of: a number that none had before.
std::uint64_t next_version();

class Surfaces {
 public:
  /// @param opacity  0–1
  void add(Mesh mesh, float opacity = 1.f);
  /// Colours the last one by a value a vertex, NaN for none. Throws Error when there are not as many.
  void colour(std::span<const float> values);
  /// The same by areas; values that are no key of one are none. Triangles between areas are cut (split_areas.h).
  void colour(std::span<const float> keys, std::span<const AreaColour> areas);

  bool empty() const { return list_.empty(); }
  const Bounds& bounds() const { return bounds_; }
  std::size_t triangles() const;
  bool has_values() const;  // that colour one of them by `map`
  /// The named areas that any vertex lies in, in their order.
  const std::vector<LegendEntry>& legend() const { return legend_; }
  /// The view from a side in which all of it is as large as fits.
  /// @param aspect  width of the picture over its height
  frame::Camera camera(Side side, float aspect) const;
  /// The side from which a hemisphere shows most: its own; above when both are there.
  Side outside() const;

  float visibility = 1.f;  // times the opacity of each, 0–1; 0: none is shown

  const ColourMap* map = &colour_maps().front();
  /// Values at the ends of the map; none: round numbers about all but the lowest and highest two hundredths of those that are values
  /// (zero_means_none) and what lies far from the others; of a diverging map, about zero where some are less and some more.
  std::optional<std::pair<float, float>> range;
  std::pair<float, float> shown_range() const;
  /// Whether there are values below and above that range.
  std::pair<bool, bool> beyond_range() const;
  std::string title;  // of the values, above their colour bar; may be empty

  /// Adds them to a frame, in palette entries that the neurons do not use. The frame must not outlive this object, or a
  /// change of it.
  /// @param playing  activity takes entries, too
  void show(frame::Frame& frame, const Colouring& colouring, bool playing);

 private:
  void learn_values();

  struct Shape {
    Mesh mesh;
    std::vector<Vec3> normals;
    std::vector<std::uint8_t> openness;
    std::vector<std::uint16_t> areas = {};  // 1 + index of the colour, 0 for none; empty: none
  };
  struct One {
    Shape given;
    std::optional<Shape> split = {};          // by areas, so that their colours do not run into one another
    std::vector<float> values = {};           // of the vertices that were given; empty: plain
    std::vector<std::uint8_t> entries = {};   // of the vertices that are shown
    std::vector<std::uint8_t> openness = {};  // less unlike, as shade shall not be taken for a value
    float opacity = 1.f;
    std::uint64_t version = next_version();

    const Shape& shown() const { return split ? *split : given; }
  };

  std::vector<One> list_;
  std::vector<Vec3> area_colours_;
  std::vector<LegendEntry> legend_;
  std::vector<frame::Surface> shown_;
  Bounds bounds_;
  struct Values {  // of all that are some
    float least, most;
    std::pair<float, float> usual;
  };
  std::optional<Values> values_;
};

}  // namespace forest::scene
