// SPDX-License-Identifier: Apache-2.0
#include "apps/studio/annotation.h"

#include <QPainter>
#include <algorithm>
#include <cmath>

#include "forest/scene/colour_bar.h"
#include "forest/scene/scale_bar.h"

#include "apps/studio/selection.h"

namespace forest::studio {
namespace {

constexpr int margin = 18;  // points, from the edges of the picture

void plate(QPainter& painter, const QRectF& area, const Ink& ink) {
  painter.setPen(Qt::NoPen);
  painter.setBrush(ink.plate);
  painter.drawRoundedRect(area, 6, 6);
}

}  // namespace

Ink ink_on(scene::Background background) {
  return background == scene::Background::dark
             ? Ink{QColor(226, 232, 240), QColor(150, 163, 182), QColor(8, 12, 19, 150)}
             : Ink{QColor(32, 40, 52), QColor(96, 108, 126), QColor(255, 255, 255, 170)};
}

QColor to_screen(const Vec3& linear) {
  const Vec3 c = scene::screen_of(linear);
  return QColor::fromRgbF(c.x(), c.y(), c.z());
}

void paint_scale(QPainter& painter, const QRect& area, const frame::Camera& camera, const Ink& ink) {
  const scene::ScaleBar bar = scene::scale_bar(camera, float(area.height()), 160.f);
  const auto width = qreal(bar.length);
  const QPointF left(area.left() + margin + 10, area.bottom() - margin - 10),
      right = left + QPointF(width, 0);
  const QString label = QString::fromStdString(bar.label);
  const qreal text_width = painter.fontMetrics().horizontalAdvance(label);
  plate(painter, QRectF(left - QPointF(10, 28), QSizeF(std::max(width, text_width) + 20, 38)), ink);
  painter.setPen(QPen(ink.text, 1.6));
  painter.drawLine(left, right);
  for (const QPointF& end : {left, right}) painter.drawLine(end - QPointF(0, 4), end + QPointF(0, 4));
  painter.drawText(left - QPointF(0, 9), label);
}

void paint_directions(QPainter& painter, const QRect& area, const frame::Camera& camera, const Ink& ink,
                      const std::optional<Vec3>& pia) {
  constexpr qreal length = 30;
  const QPointF centre(area.right() - margin - 40, area.bottom() - margin - 40);
  plate(painter, QRectF(centre - QPointF(48, 48), QSizeF(96, 96)), ink);
  struct Axis {
    const char* name;
    Vec3 way;
    QColor colour;
    qreal beyond = 10.;  // the tip, where the name is
  };
  // Okabe & Ito's vermilion, green and blue.
  const bool along_y = pia == Vec3(Vec3::UnitY());
  std::vector<Axis> axes{{"x", Vec3::UnitX(), {213, 94, 0}},
                         {along_y ? "y pia" : "y", Vec3::UnitY(), {0, 178, 130}},
                         {"z", Vec3::UnitZ(), {70, 150, 220}}};
  if (pia && !along_y) axes.push_back({"pia", *pia, ink.text, 22.});  // beside that of the nearest axis
  const Mat3 seen = camera.axes().transpose();
  std::ranges::sort(axes, {}, [&](const Axis& a) { return (seen * a.way).z(); });  // far ones first
  for (const Axis& a : axes) {
    const Vec3 way = seen * a.way;
    const QPointF tip = centre + length * QPointF(way.x(), -way.y());
    painter.setPen(QPen(a.colour, 2, Qt::SolidLine, Qt::RoundCap));
    painter.drawLine(centre, tip);
    painter.setPen(ink.text);
    const QRectF box(centre + (length + a.beyond) * QPointF(way.x(), -way.y()) - QPointF(24, 8),
                     QSizeF(48, 16));
    painter.drawText(box, Qt::AlignCenter, a.name);
  }
}

void paint_legend(QPainter& painter, const QRect& area, const std::vector<scene::LegendEntry>& legend,
                  const Ink& ink) {
  if (legend.empty()) return;
  const qreal line = painter.fontMetrics().height() + 5.;
  constexpr qreal dot = 10., step = 7.;  // one colour is a dot, several stand side by side
  qreal widest = 0, indent = dot;
  for (const auto& entry : legend) {
    widest =
        std::max(widest, qreal(painter.fontMetrics().horizontalAdvance(QString::fromStdString(entry.name))));
    if (entry.colours.size() > 1) indent = std::max(indent, step * qreal(entry.colours.size()));
  }
  const QPointF corner(area.left() + margin, area.top() + margin);
  plate(painter, QRectF(corner, QSizeF(widest + 34 + indent, line * qreal(legend.size()) + 14)), ink);
  for (std::size_t i = 0; i < legend.size(); ++i) {
    const QPointF left = corner + QPointF(13, 7 + line * (qreal(i) + .5));
    const auto& colours = legend[i].colours;
    painter.setPen(Qt::NoPen);
    for (std::size_t k = 0; k < colours.size(); ++k) {
      painter.setBrush(to_screen(colours[k]));
      if (colours.size() == 1)
        painter.drawEllipse(left + QPointF(dot / 2, 0), dot / 2, dot / 2);
      else
        painter.drawRect(QRectF(left + QPointF(step * qreal(k), -dot / 2), QSizeF(step, dot)));
    }
    painter.setPen(ink.text);
    painter.drawText(QRectF(left + QPointF(indent + 8, -line / 2), QSizeF(widest + 4, line)),
                     Qt::AlignVCenter, QString::fromStdString(legend[i].name));
  }
}

void paint_bar(QPainter& painter, const QRect& area, const scene::ColourBar& bar, const Ink& ink) {
  constexpr qreal width = 190, thick = 12, dot = 10;
  const qreal line = painter.fontMetrics().height() + 3.;
  const QString note = QString::fromStdString(bar.note);
  const qreal dots = bar.marks.empty() ? 0. : dot * (qreal(bar.marks.size()) + .7);
  const qreal wide =
      std::max(bar.map ? width : 0., dots + painter.fontMetrics().horizontalAdvance(note) + 4.);
  const qreal lines = 1. + (bar.map ? 1. : 0.) + (bar.note.empty() ? 0. : 1.);
  const QPointF corner(area.left() + margin, area.top() + margin);
  plate(painter, QRectF(corner, QSizeF(wide + 28, lines * line + (bar.map ? thick + 6. : 0.) + 14)), ink);
  QPointF top = corner + QPointF(14, 6);
  painter.setPen(ink.text);
  painter.drawText(QRectF(top, QSizeF(wide, line)), Qt::AlignLeft, QString::fromStdString(bar.title));
  painter.drawText(QRectF(top, QSizeF(wide, line)), Qt::AlignRight, QString::fromStdString(bar.units));
  top.ry() += line;
  if (bar.map) {
    for (int x = 0; x < int(width); ++x) {
      const Vec3 c = bar.at(float(x) / float(width - 1));
      painter.fillRect(QRectF(top + QPointF(x, 2), QSizeF(1, thick)), QColor::fromRgbF(c.x(), c.y(), c.z()));
    }
    painter.setPen(ink.faint);
    const QRectF below(top + QPointF(0, thick + 4), QSizeF(width, line));
    painter.drawText(below, Qt::AlignLeft, QString::number(bar.low));
    painter.drawText(below, Qt::AlignRight, QString::number(bar.high));
    top.ry() += thick + 6 + line;
  }
  painter.setPen(bar.map ? ink.faint : ink.text);
  painter.drawText(QRectF(top + QPointF(dots, 0), QSizeF(wide, line)), Qt::AlignLeft, note);
  painter.setPen(Qt::NoPen);
  for (std::size_t i = 0; i < bar.marks.size(); ++i) {
    const Vec3& c = bar.marks[i];
    painter.setBrush(QColor::fromRgbF(c.x(), c.y(), c.z()));
    painter.drawEllipse(top + QPointF(.5 * dot + dot * qreal(i), .5 * line), .5 * dot, .5 * dot);
  }
}

void paint_gaze(QPainter& painter, const QPointF& place, const Ink& ink) {
  painter.setBrush(Qt::NoBrush);
  painter.setPen(QPen(ink.faint, 1.4));
  painter.drawEllipse(place, 14, 14);
  painter.drawPoint(place);
}

void mark_selection(frame::Palette& palette, scene::Background background, bool dim) {
  const bool light = background == scene::Background::light;
  if (dim) {
    const Vec3 back = light ? Vec3(.80f, .84f, .90f) : Vec3(.006f, .008f, .012f);
    const float kept =
        light ? .22f : .4f;  // of what the rest shows: on dark ground more, so that it is still seen
    for (std::size_t i = 0; i < palette.size(); ++i)
      if (i != scene::highlight_entry && i != scene::outline_entry && i != scene::spike_entry &&
          i != scene::fading_entry)
        palette[i] = kept * palette[i] + (1.f - kept) * back;
  }
  palette[scene::section_entry] = light ? Vec3(.75f, .04f, .12f) : Vec3(1.f, .22f, .42f);
  palette[scene::highlight_entry] = light ? Vec3(.05f, .05f, .35f) : Vec3(.80f, .90f, 1.f);
}

}  // namespace forest::studio
