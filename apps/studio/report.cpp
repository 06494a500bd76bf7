// SPDX-License-Identifier: Apache-2.0
#include "apps/studio/report.h"

#include <QAbstractSpinBox>
#include <QComboBox>
#include <QLineEdit>
#include <QScrollArea>
#include <QStyleOptionComboBox>
#include <cstdio>

#include <nlohmann/json.hpp>

#include "apps/studio/window.h"

namespace forest::studio {
namespace {

using Json = nlohmann::ordered_json;

Json place_of(const QRect& r) {  // on the screen
  return {{"x", r.x()}, {"y", r.y()}, {"width", r.width()}, {"height", r.height()}};
}

// Whether a field shows less than the whole of its text.
bool lacks_room(const QWidget* field) {
  constexpr int margins = 4;  // of a line of text, on both sides
  const QFontMetrics letters = field->fontMetrics();
  if (qobject_cast<const QAbstractSpinBox*>(field)) {
    const auto* line = field->findChild<const QLineEdit*>();
    return line && letters.horizontalAdvance(line->text()) > line->width() - margins;
  }
  if (const auto* box = qobject_cast<const QComboBox*>(field)) {
    QStyleOptionComboBox option;
    option.initFrom(box);
    const QRect inside =
        box->style()->subControlRect(QStyle::CC_ComboBox, &option, QStyle::SC_ComboBoxEditField, box);
    const int icon = box->itemIcon(box->currentIndex()).isNull() ? 0 : box->iconSize().width() + margins;
    return letters.horizontalAdvance(box->currentText()) > inside.width() - icon;
  }
  return false;
}

// Whether the edge of a panel that scrolls hides the right end of a field.
bool leaves_its_panel(const QWidget* field) {
  for (const QWidget* w = field->parentWidget(); w; w = w->parentWidget())
    if (const auto* panel = qobject_cast<const QScrollArea*>(w))
      return field->mapTo(panel, QPoint(field->width(), 0)).x() > panel->viewport()->width();
  return false;
}

// Fields that are cut off, by name.
Json cut_off(const Window& window) {
  Json names = Json::array();
  for (const QWidget* field : window.findChildren<QWidget*>())
    if (field->isVisible() && (field->inherits("QAbstractSpinBox") || field->inherits("QComboBox")) &&
        (leaves_its_panel(field) || lacks_room(field)))
      names.push_back(field->accessibleName().toStdString());
  return names;
}

void print(const Json& line) {
  std::puts(line.dump().c_str());
  std::fflush(stdout);
}

}  // namespace

void report(Window& window) {
  const Viewport* viewport = &window.viewport();
  QObject::connect(viewport, &Viewport::selected, viewport, [viewport] {
    const auto& selection = viewport->selection();
    Json known = selection ? to_json(viewport->forest(), *selection) : Json();
    if (const auto& synapse = viewport->selected_synapse())
      known["synapse"] = to_json(*viewport->synapses(), *synapse);
    print({{"event", "selected"}, {"facts", known}});
  });
  QObject::connect(viewport, &Viewport::recovered, viewport, [viewport](const QString& sentence) {
    print({{"event", "recovered"},
           {"renderer", viewport->renderer_name().toStdString()},
           {"why", sentence.toStdString()}});
  });
  QObject::connect(viewport, &Viewport::put_away, viewport, [](const QString& why) {
    print({{"event", "put_away"}, {"why", why.toStdString()}});
  });
  QObject::connect(&window, &Window::clamped, &window, [&window](double milliseconds) {
    Json names = Json::array();
    for (const reports::Trace& trace : window.traces()) names.push_back(trace.name());
    print({{"event", "clamped"}, {"traces", names}, {"milliseconds", milliseconds}});
  });
  QObject::connect(&window, &Window::explained, &window, [&window] {
    Json keys = Json::array();
    for (const Window::Key& k : window.keys())
      keys.push_back(
          {{"key", k.key.toStdString()}, {"name", k.name.toStdString()}, {"what", k.what.toStdString()}});
    print({{"event", "explained"}, {"keys", keys}});
  });
  QObject::connect(viewport, &Viewport::settled, viewport, [viewport, &window] {
    Json picture = place_of({viewport->mapToGlobal(QPoint(0, 0)), viewport->size()}), activity;
    picture["pixel_ratio"] = viewport->devicePixelRatioF();
    if (viewport->playback())
      activity = {{"time", viewport->time()},
                  {"playing", viewport->playing()},
                  {"raster", place_of(window.raster())}};
    const Viewport::Figures& f = viewport->figures();
    print({{"event", "settled"},
           {"view", Json::parse(viewport->text())},
           {"picture", picture},
           {"activity", activity},
           {"segments", f.segments},
           {"synapses", f.synapses},
           {"skin_triangles", f.triangles},
           {"neurons", f.neurons},
           {"samples", f.samples},
           {"cut_off", cut_off(window)}});
  });
}

}  // namespace forest::studio
