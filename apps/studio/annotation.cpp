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

QRectF paint_scale(QPainter& painter, const QRect& area, const frame::Camera& camera, const Ink& ink) {
  const scene::ScaleBar bar = scene::scale_bar(camera, float(area.height()), 160.f);
  const auto width = qreal(bar.length);
  const QPointF left(area.left() + margin + 10, area.bottom() - margin - 10),
      right = left + QPointF(width, 0);
  const QString label = QString::fromStdString(bar.label);
  const qreal text_width = painter.fontMetrics().horizontalAdvance(label);
  const QRectF taken(left - QPointF(10, 28), QSizeF(std::max(width, text_width) + 20, 38));
  plate(painter, taken, ink);
  painter.setPen(QPen(ink.text, 1.6));
  painter.drawLine(left, right);
  for (const QPointF& end : {left, right}) painter.drawLine(end - QPointF(0, 4), end + QPointF(0, 4));
  painter.drawText(left - QPointF(0, 9), label);
  return taken;
}

void paint_directions(QPainter& painter, const QRect& area, const frame::Camera& camera, const Ink& ink,
                      const std::optional<Vec3>& pia, const QRectF& taken) {
  constexpr qreal length = 30, half = 48, gap = 8;
  QPointF centre(area.right() - margin - 40, area.bottom() - margin - 40);
  if (centre.x() - half < taken.right() + gap) centre.setY(taken.top() - gap - half);
  plate(painter, QRectF(centre - QPointF(half, half), QSizeF(2 * half, 2 * half)), ink);
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

Explanations::Explanations(QPainter& painter, const QRect& area, const Ink& ink)
    : painter_(painter), ink_(ink), corner_(area.left() + margin, area.top() + margin) {}

QPointF Explanations::room_for(const QSizeF& size) {
  constexpr qreal gap = 8.;
  const QPointF corner = corner_;
  plate(painter_, QRectF(corner, size), ink_);
  corner_.ry() += size.height() + gap;
  return corner;
}

void Explanations::add(const std::vector<scene::LegendEntry>& legend) {
  if (legend.empty()) return;
  const qreal line = painter_.fontMetrics().height() + 5.;
  constexpr qreal dot = 10., step = 7.;  // one colour is a dot, several stand side by side
  qreal widest = 0, indent = dot;
  for (const auto& entry : legend) {
    widest =
        std::max(widest, qreal(painter_.fontMetrics().horizontalAdvance(QString::fromStdString(entry.name))));
    if (entry.colours.size() > 1) indent = std::max(indent, step * qreal(entry.colours.size()));
  }
  const QPointF corner = room_for({widest + 34 + indent, line * qreal(legend.size()) + 14});
  for (std::size_t i = 0; i < legend.size(); ++i) {
    const QPointF left = corner + QPointF(13, 7 + line * (qreal(i) + .5));
    const auto& colours = legend[i].colours;
    painter_.setPen(Qt::NoPen);
    for (std::size_t k = 0; k < colours.size(); ++k) {
      painter_.setBrush(to_screen(colours[k]));
      if (colours.size() == 1)
        painter_.drawEllipse(left + QPointF(dot / 2, 0), dot / 2, dot / 2);
      else
        painter_.drawRect(QRectF(left + QPointF(step * qreal(k), -dot / 2), QSizeF(step, dot)));
    }
    painter_.setPen(ink_.text);
    painter_.drawText(QRectF(left + QPointF(indent + 8, -line / 2), QSizeF(widest + 4, line)),
                      Qt::AlignVCenter, QString::fromStdString(legend[i].name));
  }
}

void Explanations::add(const scene::ColourBar& bar) {
  constexpr qreal width = 190, thick = 12, dot = 10;
  const qreal line = painter_.fontMetrics().height() + 3.;
  const QString note = QString::fromStdString(bar.note);
  const qreal dots = bar.marks.empty() ? 0. : dot * (qreal(bar.marks.size()) + .7);
  const qreal wide =
      std::max(bar.map ? width : 0., dots + painter_.fontMetrics().horizontalAdvance(note) + 4.);
  const bool headed = !bar.title.empty() || !bar.units.empty();
  const qreal lines = (headed ? 1. : 0.) + (bar.map ? 1. : 0.) + (bar.note.empty() ? 0. : 1.);
  const QPointF corner = room_for({wide + 28, lines * line + (bar.map ? thick + 6. : 0.) + 14});
  QPointF top = corner + QPointF(14, 6);
  painter_.setPen(ink_.text);
  painter_.drawText(QRectF(top, QSizeF(wide, line)), Qt::AlignLeft, QString::fromStdString(bar.title));
  painter_.drawText(QRectF(top, QSizeF(wide, line)), Qt::AlignRight, QString::fromStdString(bar.units));
  if (headed) top.ry() += line;
  if (bar.map) {
    for (int x = 0; x < int(width); ++x) {
      const Vec3 c = bar.at(float(x) / float(width - 1));
      painter_.fillRect(QRectF(top + QPointF(x, 2), QSizeF(1, thick)), QColor::fromRgbF(c.x(), c.y(), c.z()));
    }
    painter_.setPen(ink_.faint);
    const QRectF below(top + QPointF(0, thick + 4), QSizeF(width, line));
    painter_.drawText(below, Qt::AlignLeft, QString::fromStdString(bar.ends().first));
    painter_.drawText(below, Qt::AlignRight, QString::fromStdString(bar.ends().second));
    const auto wide_as = [&](const std::string& text) {
      return qreal(painter_.fontMetrics().horizontalAdvance(QString::fromStdString(text)));
    };
    constexpr qreal apart = 8.;
    const qreal end = width - wide_as(bar.ends().second) - apart;
    for (qreal begin = wide_as(bar.ends().first) + apart; const auto& tick : bar.between()) {
      const qreal at = qreal(tick.at) * width, half = .5 * wide_as(tick.label);
      if (at - half < begin || at + half > end) continue;
      painter_.drawText(below.adjusted(at - half, 0, 0, 0), Qt::AlignLeft,
                        QString::fromStdString(tick.label));
      begin = at + half + apart;
    }
    top.ry() += thick + 6 + line;
  }
  painter_.setPen(bar.map ? ink_.faint : ink_.text);
  painter_.drawText(QRectF(top + QPointF(dots, 0), QSizeF(wide, line)), Qt::AlignLeft, note);
  painter_.setPen(Qt::NoPen);
  for (std::size_t i = 0; i < bar.marks.size(); ++i) {
    const Vec3& c = bar.marks[i];
    painter_.setBrush(QColor::fromRgbF(c.x(), c.y(), c.z()));
    painter_.drawEllipse(top + QPointF(.5 * dot + dot * qreal(i), .5 * line), .5 * dot, .5 * dot);
  }
}

void paint_gaze(QPainter& painter, const QPointF& place, const Ink& ink) {
  painter.setBrush(Qt::NoBrush);
  painter.setPen(QPen(ink.faint, 1.4));
  painter.drawEllipse(place, 14, 14);
  painter.drawPoint(place);
}

void mark_selection(frame::Palette& palette, scene::Background background, bool dim, bool values) {
  const bool light = background != scene::Background::dark;
  if (dim) {
    const Vec3 back = light ? Vec3(.80f, .84f, .90f) : Vec3(.006f, .008f, .012f);
    const float kept =
        light ? .22f : .4f;  // of what the rest shows: on dark ground more, so that it is still seen
    for (std::size_t i = 0; i < palette.size(); ++i)
      if (i != scene::highlight_entry && i != scene::outline_entry && i != scene::spike_entry &&
          i != scene::fading_entry)
        palette[i] = kept * palette[i] + (1.f - kept) * back;
  }
  palette[scene::section_entry] = values  ? Vec3(Vec3::Constant(light ? 0.f : 1.f))
                                  : light ? Vec3(.75f, .04f, .12f)
                                          : Vec3(1.f, .22f, .42f);
  palette[scene::highlight_entry] = light ? Vec3(.05f, .05f, .35f) : Vec3(.80f, .90f, 1.f);
}

}  // namespace forest::studio
