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

/// A bar of a round number of µm or mm, true at the target's depth; at the bottom left.
void paint_scale(QPainter& painter, const QRect& area, const frame::Camera& camera, const Ink& ink);
/// The axes; at the bottom right.
/// @param pia  which way it lies, if any: along y as in a column, or along an arrow of its own
void paint_directions(QPainter& painter, const QRect& area, const frame::Camera& camera, const Ink& ink,
                      const std::optional<Vec3>& pia);
/// At the top left.
void paint_legend(QPainter& painter, const QRect& area, const std::vector<scene::LegendEntry>& legend,
                  const Ink& ink);
/// At the top left: what the colours of a simulation mean, and the moment that is shown.
void paint_bar(QPainter& painter, const QRect& area, const scene::ColourBar& bar, const Ink& ink);
/// A ring around the point that is looked at.
void paint_gaze(QPainter& painter, const QPointF& place, const Ink& ink);

/// Sets the colour of the picked section, and dims the forest behind a selection.
void mark_selection(frame::Palette& palette, scene::Background background, bool dim);

}  // namespace forest::studio
