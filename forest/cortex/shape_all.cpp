// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/shape_all.h"

#include <algorithm>

#include "forest/cortex/fit_faces.h"
#include "forest/cortex/gauge.h"
#include "forest/cortex/report.h"
#include "forest/cortex/shape.h"

namespace forest::cortex {
namespace {

constexpr double least_jacobian = .2;  // scaled: what has less begins anew

// What is asked of shapes, from the first time to the last.
struct Asked {
  Shaping first;    // of all that is sheared
  Shaping last;     // of the few that are badly shaped still: they may take room, and leave the surface
  Shaping even;     // where nothing is tangled any more volumes can be evened …
  Shaping roomy;    // … and what is sheared still has room
  Shaping closely;  // faces come as near as they may, and shapes yield a little …
  Shaping patient;  // … which they get back, with patience, where it costs faces least

  explicit Asked(double volume)
      : first{.volume = volume},
        last{.enough = .36,
             .wanted = .5,
             .volume = volume,
             .least = .6,
             .most = 1.6,
             .even = 1.,
             .along = 1600.,
             .off = 100.,
             .worst_off = 400.,
             .rounds = 4,
             .iterations = 400,
             .gain = .01},
        even{.enough = .5, .wanted = .62, .volume = volume, .even = 16., .worst_off = 100., .gain = .01},
        roomy(even),
        closely(even),
        patient(even) {
    for (Shaping* s : {&roomy, &closely, &patient}) s->along = 1600.;
    for (Shaping* s : {&closely, &patient}) s->close = 40.;
    roomy.off = 50., roomy.worst_off = 400.;
    closely.off = 10., closely.even = 8.;
    patient.off = 30., patient.even = 12., patient.iterations = 150, patient.gain = .003;
  }
};

// Whether 95 of 100 have about the wanted volume, and 99 of 100 a scaled Jacobian of .5.
bool even_and_well_shaped(const Elements& elements, double volume) {
  const Looks looks = look(elements);
  const auto odd =
                 std::ranges::count_if(looks.volume, [&](float v) { return !as_wanted(double(v), volume); }),
             sheared = std::ranges::count_if(looks.least, [](float least) { return least < .5f; });
  return 20 * odd <= long(elements.size()) && 100 * sheared <= long(elements.size());
}

bool faces_are_close(const Elements& elements, const SurfaceTrees& surfaces) {
  constexpr double close = 50.;  // µm
  return face_distance(elements, 0., surfaces.outer).p99 <= close &&
         face_distance(elements, 1., surfaces.inner).p99 <= close;
}

}  // namespace

void shape_all(Cortex& cortex, const SurfaceTrees& surfaces, double volume, Progress& progress) {
  constexpr int evenings = 2;
  Elements& elements = cortex.elements;
  const Asked asked(volume);
  const auto improve = [&](const Shaping& shaping) { improve_shapes(elements, surfaces, shaping, progress); };
  const auto begin_again = [&](Rings rings) {
    begin_anew(elements, surfaces, asked.last, least_jacobian, progress, rings);
  };
  const auto is_good = [&] { return even_and_well_shaped(elements, volume); };

  fit_faces(elements, surfaces, Fit::mean);
  for (int time = 0; time < 2; ++time) improve(asked.first);
  improve(asked.last);
  begin_again(Rings::few);
  cortex.mending = mend(elements, surfaces, progress);
  if (cortex.mending.before > 0) {  // what is still tangled has another start now
    improve(asked.last);
    begin_again(Rings::few);
  }
  for (int time = 0; time < evenings && !is_good(); ++time) {
    improve(asked.even);
    improve(asked.roomy);
    begin_again(Rings::few);
  }
  cortex.left_out = leave_out(elements, least_jacobian);
  cortex.wall += cortex.left_out.volume;

  fit_faces(elements, surfaces, Fit::places);
  for (int time = 0; time < 2; ++time) fit_faces(elements, surfaces, Fit::volume);
  // What some faces cannot take all of them do. Then faces, shapes and volumes are asked for at once.
  const double whole = cortex.between - cortex.wall;
  keep_volume(elements, whole);
  for (int time = 0; time < evenings; ++time) {
    const bool close = faces_are_close(elements, surfaces);
    if (close && is_good()) break;
    if (!close) improve(asked.closely);
    improve(asked.patient);
    keep_volume(elements, whole);
  }
  begin_again(Rings::many);
  keep_volume(elements, whole);
  begin_again(Rings::many);  // a height for all costs some
}

}  // namespace forest::cortex
