// SPDX-License-Identifier: Apache-2.0
// What is drawn over the picture so that it can be read: scale bar, directions, legend, gaze.
#pragma once

#include <QColor>
#include <QPointF>
#include <QRect>
#include <optional>

#include "forest/scene/colour_bar.h"
#include "forest/scene/view.h"

class QPainter;

namespace forest::studio {

/// Colours that are seen on a background.
struct Ink {
  QColor text, faint, plate;  // plate: behind text, translucent
};
Ink ink_on(scene::Background background);
QColor to_screen(const Vec3& linear);

/// A bar of a round number of µm or mm, true at the target's depth; at the bottom left. Returns what it takes up.
QRectF paint_scale(QPainter& painter, const QRect& area, const frame::Camera& camera, const Ink& ink);
/// The axes; at the bottom right, above what is `taken` where there is no room beside it.
/// @param pia  which way it lies, if any: along y as in a column, or along an arrow of its own
void paint_directions(QPainter& painter, const QRect& area, const frame::Camera& camera, const Ink& ink,
                      const std::optional<Vec3>& pia, const QRectF& taken);
/// What colours mean, one explanation below the other at the top left.
class Explanations {
 public:
  Explanations(QPainter& painter, const QRect& area, const Ink& ink);
  void add(const std::vector<scene::LegendEntry>& legend);
  void add(const scene::ColourBar& bar);

 private:
  QPointF room_for(const QSizeF& size);  // where it begins, on ground of its own

  QPainter& painter_;
  const Ink& ink_;
  QPointF corner_;  // of the next
};
/// A ring around the point that is looked at.
void paint_gaze(QPainter& painter, const QPointF& place, const Ink& ink);

/// Sets the colour of the picked section, and dims the forest behind a selection.
/// @param values  branches have the colours of values: the mark has one that no map of colours holds between its ends
void mark_selection(frame::Palette& palette, scene::Background background, bool dim, bool values);

}  // namespace forest::studio
