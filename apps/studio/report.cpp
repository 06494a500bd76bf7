// SPDX-License-Identifier: Apache-2.0
#include "apps/studio/report.h"

#include <QScrollArea>
#include <QWidget>
#include <cstdio>

#include <nlohmann/json.hpp>

#include "apps/studio/window.h"

namespace forest::studio {
namespace {

using Json = nlohmann::ordered_json;

Json place_of(const QWidget* widget) {  // on the screen
  const QPoint corner = widget->mapToGlobal(QPoint(0, 0));
  return {{"x", corner.x()}, {"y", corner.y()}, {"width", widget->width()}, {"height", widget->height()}};
}

// Fields that are cut off on the right, by name: of those that scroll, beyond the edge of their panel.
Json cut_off(const Window& window) {
  Json names = Json::array();
  for (const QScrollArea* panel : window.findChildren<QScrollArea*>())
    for (const QWidget* field :
         panel->widget() ? panel->widget()->findChildren<QWidget*>() : QList<QWidget*>())
      if (field->isVisible() && (field->inherits("QAbstractSpinBox") || field->inherits("QComboBox")) &&
          field->mapTo(panel, QPoint(field->width(), 0)).x() > panel->viewport()->width())
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
  QObject::connect(&window, &Window::clamped, &window, [&window](double milliseconds) {
    Json names = Json::array();
    for (const reports::Trace& trace : window.traces()) names.push_back(trace.name());
    print({{"event", "clamped"}, {"traces", names}, {"milliseconds", milliseconds}});
  });
  QObject::connect(viewport, &Viewport::settled, viewport, [viewport, &window] {
    Json picture = place_of(viewport), activity;
    picture["pixel_ratio"] = viewport->devicePixelRatioF();
    if (viewport->playback())
      activity = {{"time", viewport->time()},
                  {"playing", viewport->playing()},
                  {"raster", place_of(window.findChild<QWidget*>("raster"))}};
    const Viewport::Figures& f = viewport->figures();
    print({{"event", "settled"},
           {"view", Json::parse(scene::to_json(viewport->settings().view))},
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
