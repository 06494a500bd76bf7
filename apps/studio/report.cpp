// SPDX-License-Identifier: Apache-2.0
#include "apps/studio/report.h"

#include <cstdio>

#include <nlohmann/json.hpp>

#include "apps/studio/window.h"

namespace forest::studio {
namespace {

using Json = nlohmann::ordered_json;

void print(const Json& line) {
  std::puts(line.dump().c_str());
  std::fflush(stdout);
}

}  // namespace

void report(Window& window) {
  const Viewport* viewport = &window.viewport();
  QObject::connect(viewport, &Viewport::selected, viewport, [viewport] {
    const auto& selection = viewport->selection();
    print({{"event", "selected"}, {"facts", selection ? to_json(viewport->forest(), *selection) : Json()}});
  });
  QObject::connect(&window, &Window::clamped, &window, [&window](double milliseconds) {
    Json names = Json::array();
    for (const reports::Trace& trace : window.traces()) names.push_back(trace.name());
    print({{"event", "clamped"}, {"traces", names}, {"milliseconds", milliseconds}});
  });
  QObject::connect(viewport, &Viewport::settled, viewport, [viewport] {
    const QPoint corner = viewport->mapToGlobal(QPoint(0, 0));
    const Viewport::Figures& f = viewport->figures();
    print({{"event", "settled"},
           {"view", Json::parse(scene::to_json(viewport->settings().view))},
           {"picture",
            {{"x", corner.x()},
             {"y", corner.y()},
             {"width", viewport->width()},
             {"height", viewport->height()},
             {"pixel_ratio", viewport->devicePixelRatioF()}}},
           {"segments", f.segments},
           {"neurons", f.neurons},
           {"samples", f.samples},
           {"playing", viewport->playing()}});
  });
}

}  // namespace forest::studio
