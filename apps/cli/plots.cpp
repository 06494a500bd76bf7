// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/plots.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include <fmt/format.h>

#include "forest/core/round_numbers.h"
#include "forest/core/shortened.h"
#include "forest/statistics/summary.h"
#include "forest/statistics/two_samples.h"

#include "apps/cli/readable.h"
#include "apps/cli/report.h"

namespace forest::cli {
namespace {

constexpr std::array<std::string_view, 8> colours{"#0072B2", "#D55E00", "#009E73", "#CC79A7",
                                                  "#E69F00", "#56B4E9", "#8C6D31", "#666666"};
constexpr double width = 880.;

/// About as wide as these words are drawn: nobody knows which typeface a page is read in.
double width_of(std::string_view words, double size) { return .62 * size * double(characters(words)); }

/// A drawing that grows downwards.
class Svg {
 public:
  template <class... Args>
  void add(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(body_), format, std::forward<Args>(args)...);
    body_ += '\n';
  }
  void text(double x, double y, std::string_view words, std::string_view anchor = "start", double size = 12.,
            double opacity = 1.) {
    if (words.empty()) return;
    add(R"(<text x="{:.1f}" y="{:.1f}" text-anchor="{}" font-size="{:.3g}" fill="currentColor" fill-opacity="{:.2f}">{}</text>)",
        x, y, anchor, size, opacity, escaped_html(words));
  }
  /// Shortened to so much room; the pointer shows the whole.
  void fitted(double x, double y, double room, const std::string& words, std::string_view anchor = "start",
              double size = 12., double opacity = 1.) {
    const std::string cut = shortened(words, std::size_t(room / width_of("m", size)));
    if (cut == words) return text(x, y, words, anchor, size, opacity);
    add(R"(<text x="{:.1f}" y="{:.1f}" text-anchor="{}" font-size="{:.3g}" fill="currentColor" fill-opacity="{:.2f}">{}<title>{}</title></text>)",
        x, y, anchor, size, opacity, escaped_html(cut), escaped_html(words));
  }
  void line(double x1, double y1, double x2, double y2, double opacity = .2, std::string_view more = "") {
    add(R"(<line x1="{:.1f}" y1="{:.1f}" x2="{:.1f}" y2="{:.1f}" stroke="currentColor" stroke-opacity="{:.2f}" {}/>)",
        x1, y1, x2, y2, opacity, more);
  }
  std::string done(double height, std::string_view label) const {
    return fmt::format(
        R"(<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {0} {1:.0f}" role="img" aria-label="{2}" )"
        R"(font-family="'DejaVu Sans', Verdana, sans-serif">)"
        "\n{3}</svg>\n",
        width, height, escaped_html(label), body_);
  }

 private:
  std::string body_;
};

struct Scale {
  double low, high, from, to;
  double operator()(double x) const { return from + (x - low) / (high - low) * (to - from); }
};

/// Room on both sides; a single value gets some too.
Scale scale_of(double low, double high, double from, double to, double margin = .05) {
  if (!(low <= high)) low = 0., high = 1.;
  const double room = high > low ? margin * (high - low) : std::max(1., .1 * std::abs(low));
  return {low - room, high + room, from, to};
}

struct Mark {
  double at;
  std::string words;
};

/// The numbers of an axis: two at least, since one is no scale, and no more than have room beside one another.
/// @param size  of the type, where they stand side by side; 0 where they stand above one another
std::vector<Mark> marks(const Scale& scale, int most, double size) {
  const auto of = [&](int count) {
    const std::vector<double> at = ticks(scale.low, scale.high, count);
    std::vector<Mark> out;
    for (const double t : at) out.push_back({t, readable_mark(t, at.size() > 1 ? at[1] - at[0] : 1.)});
    return out;
  };
  const auto have_room = [&](const std::vector<Mark>& some) {
    double widest = 0.;
    for (const Mark& m : some) widest = std::max(widest, width_of(m.words, size));
    return std::abs(scale(some[1].at) - scale(some[0].at)) >= widest + size;
  };
  for (int count = most; count > 1; --count)
    if (const auto some = of(count); some.size() > 1 && have_room(some)) return some;
  int count = 2;
  while (count < 5 && of(count).size() < 2) ++count;  // a fifth, rounded up, is at most half of the axis
  return of(count);
}

struct Lines {
  double top, bottom;  // of the faint line at every number
};

/// Along the bottom of a plot, none beyond `left` and `right`, nor beyond the picture.
void bottom_marks(Svg& svg, const Scale& x, Lines lines, int most, double size, double left = 0.,
                  double right = width) {
  left = std::max(left, 0.), right = std::min(right, width);
  for (const Mark& m : marks(x, most, size)) {
    const double half = .5 * width_of(m.words, size);
    svg.line(x(m.at), lines.top, x(m.at), lines.bottom, .08);
    svg.text(std::clamp(x(m.at), left + half, right - half), lines.bottom + 16., m.words, "middle", size, .7);
  }
}

struct Key {
  std::string name;
  std::size_t colour;
  bool arrow = false;
};

/// Side by side, in as many lines as they need.
/// @return  how much that is more than one line
double legend(Svg& svg, std::span<const Key> keys, double left, double y) {
  double x = left, down = 0.;
  for (const Key& key : keys) {
    const std::string name = shortened(key.name, 100);
    const double wide = width_of(name, 12.);
    if (x > left && x + 10. + wide > width) x = left, down += 20.;
    if (key.arrow)
      svg.add(R"(<path d="M{:.1f} {:.1f}l-5 -9h10z" fill="{}"/>)", x, y + down + .5, colour_of(key.colour));
    else
      svg.add(R"(<circle cx="{:.1f}" cy="{:.1f}" r="5" fill="{}"/>)", x, y + down - 4.,
              colour_of(key.colour));
    svg.text(x + 10., y + down, name);
    x += 30. + wide;
  }
  return down;
}

std::vector<Key> keys_of(std::span<const std::string> names, std::span<const std::size_t> chosen = {}) {
  std::vector<Key> keys;
  for (std::size_t i = 0; i < names.size(); ++i) keys.push_back({names[i], chosen.empty() ? i : chosen[i]});
  return keys;
}

void axes(Svg& svg, const Scale& x, const Scale& y, const std::string& x_title, const std::string& y_title) {
  bottom_marks(svg, x, {y.to, y.from}, 8, 11.);
  for (const Mark& m : marks(y, 5, 0.)) {
    svg.line(x.from, y(m.at), x.to, y(m.at), .08);
    svg.text(x.from - 8., y(m.at) + 4., m.words, "end", 11., .7);
  }
  svg.line(x.from, y.from, x.to, y.from, .5);
  svg.text(.5 * (x.from + x.to), y.from + 36., x_title, "middle", 12., .85);
  const double middle = .5 * (y.from + y.to);
  svg.add(
      R"~(<text transform="translate(18 {:.1f}) rotate(-90)" text-anchor="middle" font-size="12" fill="currentColor" fill-opacity=".85">{}</text>)~",
      middle, escaped_html(y_title));
}

std::string polyline(std::span<const double> values, double step, const Scale& x, const Scale& y) {
  std::string points;
  for (std::size_t i = 0; i < values.size(); ++i)
    points += fmt::format("{:.1f},{:.1f} ", x(step * double(i + 1)), y(values[i]));
  return points;
}

}  // namespace

std::string_view colour_of(std::size_t i) { return colours[i % colours.size()]; }

std::string interval_plot(std::span<const IntervalRow> rows, const IntervalAxis& axis) {
  Svg svg;
  constexpr double row_height = 24., names_end = 318.;
  double notes = width - 794.;  // what is written behind the rows needs
  Scale x{axis.low, axis.high, names_end + 12., 0.};
  for (const IntervalRow& r : rows) {
    notes = std::max(notes, 4. + width_of(r.note, 11.));
    for (const double v : {r.value, r.lower, r.upper})
      if (std::isfinite(v)) x.low = std::min(x.low, v), x.high = std::max(x.high, v);
  }
  x.to = width - notes - 14.;
  if (const auto t = ticks(x.low, x.high, 6);
      t.size() > 1) {  // a longer axis begins and ends with a number, too
    const double step = t[1] - t[0];
    if (x.low < axis.low) x.low = step * std::floor(x.low / step + 1e-9);
    if (x.high > axis.high) x.high = step * std::ceil(x.high / step - 1e-9);
  }
  // What the ends mean, under one another where both have no room in one line.
  const std::string left = axis.left.empty() ? "" : "◂ " + axis.left,
                    right = axis.right.empty() ? "" : axis.right + " ▸";
  const double room = x.to - x.from,
               apart = width_of(left, 12.) + width_of(right, 12.) + 20. > room && !left.empty() ? 18. : 0.;
  const double top = left.empty() && right.empty() ? 14. : 34. + apart,
               bottom = top + row_height * double(rows.size());
  if (!left.empty()) svg.fitted(x.from, 18., room, left, "start", 12., .75);
  if (!right.empty()) svg.fitted(x.to, 18. + apart, room, right, "end", 12., .75);
  bottom_marks(svg, x, {top, bottom}, 6, 11.);
  for (const double m : axis.marks) svg.line(x(m), top - 4., x(m), bottom, .55, R"(stroke-dasharray="4 3")");
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const IntervalRow& r = rows[i];
    const double y = top + row_height * (double(i) + .5), opacity = r.faint ? .35 : 1.;
    if (i % 2 == 0)
      svg.add(R"(<rect x="0" y="{:.1f}" width="{}" height="{}" fill="currentColor" fill-opacity=".035"/>)",
              y - .5 * row_height, width, row_height);
    svg.fitted(names_end, y + 4., names_end - 4., r.label, "end", 12., r.faint ? .6 : 1.);
    if (std::isfinite(r.lower) && std::isfinite(r.upper))
      svg.add(
          R"(<line x1="{:.1f}" y1="{:.1f}" x2="{:.1f}" y2="{:.1f}" stroke="{}" stroke-width="3" stroke-linecap="round" stroke-opacity="{:.2f}"/>)",
          x(r.lower), y, x(r.upper), y, colour_of(r.colour), .55 * opacity);
    if (std::isfinite(r.value))
      svg.add(R"(<circle cx="{:.1f}" cy="{:.1f}" r="5" fill="{}" fill-opacity="{:.2f}"/>)", x(r.value), y,
              colour_of(r.colour), opacity);
    svg.text(width - notes, y + 4., r.note, "start", 11., .75);
  }
  svg.text(.5 * (x.from + x.to), bottom + 38., axis.title, "middle", 12., .85);
  return svg.done(bottom + 48., axis.title);
}

std::string strip_plots(std::span<const StripPanel> panels, std::span<const std::string> names,
                        const StripKeys& more) {
  Svg svg;
  constexpr std::size_t columns = 3;
  constexpr double panel_width = 280., gap = 20., title = 44., row = 46.;
  const std::size_t samples = names.size();
  const double height = title + row * double(samples) + 34.;
  std::vector<Key> keys = keys_of(names, more.colours);
  constexpr std::size_t marked = 1;  // the colour of a single cell
  if (!more.marked.empty()) keys.push_back({more.marked, marked, true});
  const double above = 30. + legend(svg, keys, 8., 18.);
  for (std::size_t p = 0; p < panels.size(); ++p) {
    const StripPanel& panel = panels[p];
    const double left = double(p % columns) * (panel_width + gap), top = above + double(p / columns) * height;
    double low = INFINITY, high = -INFINITY;
    for (const auto& sample : panel.samples)
      for (const double v : sample)
        if (std::isfinite(v)) low = std::min(low, v), high = std::max(high, v);
    if (panel.marked) low = std::min(low, *panel.marked), high = std::max(high, *panel.marked);
    const Scale x = scale_of(low, high, left + 8., left + panel_width - 8.);
    svg.fitted(left + 8., top + 17., panel_width, panel.title, "start",
               width_of(panel.title, 12.) > panel_width ? 10.5 : 12.);
    if (!panel.unit.empty()) svg.text(left + 8., top + 31., panel.unit, "start", 10.5, .65);
    const double bottom = top + title + row * double(samples);
    bottom_marks(svg, x, {top + title, bottom}, 5, 10.5, left - .4 * gap, left + panel_width + .4 * gap);
    svg.line(x.from, bottom, x.to, bottom, .4);
    for (std::size_t s = 0; s < panel.samples.size(); ++s) {
      std::vector<double> values;
      for (const double v : panel.samples[s])
        if (std::isfinite(v)) values.push_back(v);
      if (values.empty()) continue;
      std::ranges::sort(values);
      const std::string_view colour = colour_of(keys[s].colour);
      const double base = top + title + row * (double(s) + 1.) - 14.;
      // Density (Gaussian kernel, Silverman's width) above the line, dots below it.
      const statistics::Summary summary = statistics::summarize(values);
      const double quartiles = statistics::quantile(values, .75) - statistics::quantile(values, .25);
      double kernel = .9 * std::min(summary.sd, quartiles > 0. ? quartiles / 1.34 : summary.sd) *
                      std::pow(double(values.size()), -.2);
      kernel = std::max(kernel, .004 * (x.high - x.low));
      std::vector<double> density(141, 0.);
      const auto place = [&](std::size_t at) {  // from the smallest to the largest value
        return values.front() + (values.back() - values.front()) * double(at) / double(density.size() - 1);
      };
      for (std::size_t i = 0; i < density.size(); ++i)
        for (const double v : values) density[i] += std::exp(-.5 * std::pow((place(i) - v) / kernel, 2.));
      const double most = *std::ranges::max_element(density);
      std::string path = fmt::format("M{:.1f} {:.1f}", x(values.front()), base);
      for (std::size_t i = 0; i < density.size(); ++i)
        path += fmt::format("L{:.1f} {:.1f}", x(place(i)), base - 26. * density[i] / most);
      svg.add(R"(<path d="{}L{:.1f} {:.1f}Z" fill="{}" fill-opacity=".28"/>)", path, x(values.back()), base,
              colour);
      std::array<double, 3> free{-INFINITY, -INFINITY, -INFINITY};  // where the last dot of each line ends
      for (const double v : values) {
        std::size_t line = 0;
        while (line + 1 < free.size() && x(v) < free[line]) ++line;
        free[line] = x(v) + 4.2;
        svg.add(R"(<circle cx="{:.1f}" cy="{:.1f}" r="2" fill="{}" fill-opacity=".75"/>)", x(v),
                base + 3.5 + 3.6 * double(line), colour);
      }
      const double q1 = x(statistics::quantile(values, .25)), q3 = x(statistics::quantile(values, .75)),
                   median = x(summary.median);
      svg.add(R"(<line x1="{:.1f}" y1="{:.1f}" x2="{:.1f}" y2="{:.1f}" stroke="{}" stroke-width="2.5"/>)", q1,
              base, q3, base, colour);
      svg.add(
          R"(<line x1="{0:.1f}" y1="{1:.1f}" x2="{0:.1f}" y2="{2:.1f}" stroke="{3}" stroke-width="2.5"/>)",
          median, base - 6., base + 2., colour);
    }
    if (panel.marked)
      svg.add(
          R"(<path d="M{0:.1f} {1:.1f}l-5 -9h10z M{0:.1f} {1:.1f}V{2:.1f}" fill="{3}" stroke="{3}" stroke-width="1.6"/>)",
          x(*panel.marked), top + title + 4., bottom, colour_of(marked));
  }
  const std::size_t rows = (panels.size() + columns - 1) / columns;
  return svg.done(above + 4. + height * double(rows), "Values of single cells");
}

std::string curve_plot(std::span<const CurveLine> lines, double step, const std::string& x_title,
                       const std::string& y_title) {
  Svg svg;
  double high = 0.;
  std::size_t longest = 1;
  for (const CurveLine& l : lines)
    for (const auto* values : {&l.values, &l.lower, &l.upper}) {
      for (const double v : *values) high = std::max(high, v);
      // What is nothing to the eye does not make the axis long.
      for (std::size_t i = values->size(); i-- > longest;)
        if ((*values)[i] > .012 * high) longest = std::max(longest, i + 1);
    }
  std::vector<Key> keys;
  for (const CurveLine& l : lines) keys.push_back({l.name, l.colour});
  const double down = legend(svg, keys, 78., 20.);
  const Scale x{0., step * double(longest), 70., width - 20.},
      y{0., std::max(high * 1.05, 1e-9), 310. + down, 34. + down};
  axes(svg, x, y, x_title, y_title);
  for (const CurveLine& l : lines) {
    const auto visible = [&](const std::vector<double>& v) {
      return std::span(v).first(std::min(v.size(), longest));
    };
    if (!l.upper.empty()) {
      std::string back;
      const auto low = visible(l.lower);
      for (std::size_t i = low.size(); i-- > 0;)
        back += fmt::format("{:.1f},{:.1f} ", x(step * double(i + 1)), y(low[i]));
      svg.add(R"(<polygon points="{}{}" fill="{}" fill-opacity=".2"/>)",
              polyline(visible(l.upper), step, x, y), back, colour_of(l.colour));
    }
    svg.add(R"(<polyline points="{}" fill="none" stroke="{}" stroke-width="2.2" stroke-linejoin="round"/>)",
            polyline(visible(l.values), step, x, y), colour_of(l.colour));
  }
  return svg.done(356. + down, y_title);
}

std::string scatter_plot(std::span<const Dot> dots, std::span<const std::string> names,
                         const std::string& x_title, const std::string& y_title) {
  Svg svg;
  double x0 = INFINITY, x1 = -INFINITY, y0 = INFINITY, y1 = -INFINITY;
  for (const Dot& d : dots)
    x0 = std::min(x0, d.x), x1 = std::max(x1, d.x), y0 = std::min(y0, d.y), y1 = std::max(y1, d.y);
  const double down = legend(svg, keys_of(names), 78., 20.);
  const Scale x = scale_of(x0, x1, 70., width - 20.), y = scale_of(y0, y1, 430. + down, 34. + down);
  axes(svg, x, y, x_title, y_title);
  for (const Dot& d : dots)
    svg.add(
        R"(<circle cx="{:.1f}" cy="{:.1f}" r="{}" fill="{}" fill-opacity=".72" stroke="{}" stroke-width="{}"><title>{}</title></circle>)",
        x(d.x), y(d.y), d.ring ? 8. : 4.5, colour_of(d.colour), d.ring ? "currentColor" : colour_of(d.colour),
        d.ring ? 2. : .5, escaped_html(d.name));
  return svg.done(476. + down, "Cells in the plane of two components");
}

namespace {

// In the free corner above the diagonal: what shades mean, in percent of branches a pixel.
void heat_scale(Svg& svg, const HeatPanel& h, double left, double top, double most) {
  constexpr double length = 90., high = 8.;
  constexpr int steps = 30;
  const double least = h.difference ? -1. : 0.;
  for (int i = 0; i < steps; ++i) {
    const double at = least + (1. - least) * (i + .5) / steps;
    svg.add(R"(<rect x="{:.1f}" y="{:.1f}" width="{:.2f}" height="{}" fill="{}" fill-opacity="{:.2f}"/>)",
            left + 8. + length * i / steps, top, length / steps + .15, high,
            colour_of(h.difference ? at > 0. : h.colour), std::sqrt(std::abs(at)));
  }
  const auto percent = [&](double share) { return fmt::format("{:.2g} %", 100. * std::abs(share)); };
  svg.text(left + 8., top + 20., percent(least * most), "start", 10.5, .7);
  svg.text(left + 8. + length, top + 20., percent(most), "end", 10.5, .7);
}

}  // namespace

std::string heat_plots(std::span<const HeatPanel> panels, std::size_t side, double reach,
                       const std::string& x_title, const std::string& y_title) {
  Svg svg;
  constexpr double panel = 240., gap = 48., top = 34.;
  std::array<double, 2> mosts{1e-300,
                              1e-300};  // of shares, and of differences: panels of a kind have one scale
  for (const HeatPanel& h : panels)
    for (const double v : h.values) mosts[h.difference] = std::max(mosts[h.difference], std::abs(v));
  for (std::size_t p = 0; p < panels.size(); ++p) {
    const HeatPanel& h = panels[p];
    const double left = 56. + double(p) * (panel + gap), pixel = panel / double(side),
                 most = mosts[h.difference];
    svg.fitted(left, top - 14., panel + gap - 12., h.title, "start",
               width_of(h.title, 12.) > panel + gap - 12. ? 10.5 : 12.);
    for (std::size_t i = 0; i < h.values.size() && i < side * side; ++i) {
      const double share =
          std::sqrt(std::abs(h.values[i]) / most);       // so that rare branches show beside frequent ones
      if (share < .03 || i / side > i % side) continue;  // nothing begins beyond its tip
      svg.add(
          R"(<rect x="{:.1f}" y="{:.1f}" width="{:.2f}" height="{:.2f}" fill="{}" fill-opacity="{:.2f}"/>)",
          left + pixel * double(i % side), top + panel - pixel * double(i / side + 1), pixel + .15,
          pixel + .15, colour_of(h.difference ? h.values[i] > 0. : h.colour), share);
    }
    const Scale x{0., reach, left, left + panel}, y{0., reach, top + panel, top};
    svg.line(x(0.), y(0.), x(reach), y(reach), .3, R"(stroke-dasharray="3 3")");
    svg.line(left, top + panel, left + panel, top + panel, .5);
    svg.line(left, top, left, top + panel, .5);
    bottom_marks(svg, x, {top + panel, top + panel}, 6, 10.5, left - .4 * gap, left + panel + .4 * gap);
    if (p == 0)
      for (const Mark& m : marks(y, 6, 0.)) svg.text(left - 6., y(m.at) + 4., m.words, "end", 10.5, .7);
    svg.text(left + .5 * panel, top + panel + 36., x_title, "middle", 11.5, .85);
    heat_scale(svg, h, left, top + 6., most);
  }
  svg.add(
      R"~(<text transform="translate(14 {:.1f}) rotate(-90)" text-anchor="middle" font-size="11.5" fill="currentColor" fill-opacity=".85">{}</text>)~",
      top + .5 * panel, escaped_html(y_title));
  return svg.done(top + panel + 48., "Persistence images");
}

std::string density_plots(std::span<const DensityPanel> panels) {
  Svg svg;
  constexpr std::size_t columns = 2;
  constexpr double panel_width = 430., gap = 20., head = 46., plot = 150., height = head + plot + 44.;
  for (std::size_t p = 0; p < panels.size(); ++p) {
    const DensityPanel& panel = panels[p];
    const double left = double(p % columns) * (panel_width + gap), top = double(p / columns) * height;
    svg.fitted(left + 8., top + 18., panel_width - 8., panel.title);
    svg.text(left + 8., top + 34., panel.note, "start",
             std::min(10.5, (panel_width + gap - 16.) / width_of(panel.note, 1.)), .65);
    std::vector<double> values, smooth;
    for (const double v : panel.values)
      if (std::isfinite(v)) values.push_back(v);
    if (values.empty()) continue;
    std::ranges::sort(values);
    std::ranges::copy_if(values, std::back_inserter(smooth), [&](double v) {
      return std::ranges::none_of(panel.atoms, [&](const auto& atom) {
        return std::abs(v - atom.first) <= 1e-9 * std::max(1., std::abs(v));
      });
    });
    // The outermost five of a thousand may lie far out; they count, but make no axis long.
    double low = statistics::quantile(values, .005), high = statistics::quantile(values, .995);
    const Scale x = scale_of(low, high, left + 8., left + panel_width - 8., .04);
    const double quartiles = statistics::quantile(values, .75) - statistics::quantile(values, .25);
    double bin = 2. * quartiles * std::pow(double(values.size()), -1. / 3.);  // Freedman & Diaconis 1981
    bin = std::clamp(bin, (x.high - x.low) / 60., (x.high - x.low) / 8.);
    if (panel.step > 0.) bin = panel.step * std::max(1., std::round(bin / panel.step));
    const double begin = panel.step > 0. ? -.5 * panel.step : panel.origin;  // of a bar: none reaches beyond
    const double first = begin + std::floor((x.low - begin) / bin) * bin;
    std::vector<double> bars(std::size_t(std::clamp((x.high - first) / bin, 0., 1e4)) + 1, 0.);
    for (const double v : smooth)
      if (const double at = (v - first) / bin; at >= 0. && at < double(bars.size()))
        bars[std::size_t(at)] += 1. / (double(values.size()) * bin);
    std::vector<double> curve(181, 0.);
    const auto place = [&](std::size_t i) {
      return x.low + (x.high - x.low) * double(i) / double(curve.size() - 1);
    };
    for (std::size_t i = 0; i < curve.size(); ++i)
      if (const double d = panel.density(place(i)); std::isfinite(d)) curve[i] = d;
    double most = std::max(1e-300, *std::ranges::max_element(bars));
    // A density may rise without bound at the edge of its support.
    most = std::max(most, std::min(*std::ranges::max_element(curve), 2. * most));
    const double base = top + head + plot;
    const auto up = [&](double density) { return base - plot * std::min(1., density / most); };
    for (std::size_t i = 0; i < bars.size(); ++i) {
      if (bars[i] == 0.) continue;
      const double from = std::max(x.from, x(first + bin * double(i))),
                   to = std::min(x.to, x(first + bin * double(i + 1)));
      svg.add(R"(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" fill="{}" fill-opacity=".32"/>)",
              from + .4, up(bars[i]), std::max(.5, to - from - .8), base - up(bars[i]), colour_of(0));
    }
    std::string points;
    for (std::size_t i = 0; i < curve.size(); ++i)
      points += fmt::format("{:.1f},{:.1f} ", x(place(i)), up(curve[i]));
    svg.add(R"(<polyline points="{}" fill="none" stroke="{}" stroke-width="2.2" stroke-linejoin="round"/>)",
            points, colour_of(1));
    for (const auto& [value, share] : panel.atoms) {
      if (!(value >= x.low && value <= x.high)) continue;
      svg.add(R"(<line x1="{0:.1f}" y1="{1:.1f}" x2="{0:.1f}" y2="{2:.1f}" stroke="{3}" stroke-width="3"/>)",
              x(value), base, base - plot * std::min(1., share), colour_of(2));
      constexpr double told = .05;  // the table has them all
      if (share < told) continue;
      const bool right = x(value) > .5 * (x.from + x.to);
      svg.text(x(value) + (right ? -6. : 6.), base - plot * std::min(.95, share) - 2.,
               fmt::format("{:.0f} % are {}", 100. * share, readable(value)), right ? "end" : "start", 10.5,
               .8);
    }
    bottom_marks(svg, x, {base - 4., base}, 6, 10.5, left - .4 * gap, left + panel_width + .4 * gap);
    svg.line(x.from, base, x.to, base, .5);
    svg.text(.5 * (x.from + x.to), base + 31., panel.unit, "middle", 10.5, .7);
  }
  const std::size_t rows = (panels.size() + columns - 1) / columns;
  return svg.done(height * double(rows), "Values and the densities fitted to them");
}

std::string chance_plot(std::span<const double> null, double found, double lower, double upper,
                        const std::string& title) {
  Svg svg;
  double low = std::min(.3, lower), high = 1.;
  for (const double v : null) low = std::min(low, v);
  const Scale x{low, high + .01, 40., width - 20.};
  constexpr double base = 182., found_y = 34., bars = 68.;  // what was found is drawn above what chance makes
  constexpr double bin = .02;
  std::vector<double> counts(std::size_t((high - low) / bin) + 2, 0.);
  for (const double v : null) ++counts[std::size_t((v - low) / bin)];
  const double most = std::max(1., *std::ranges::max_element(counts));
  for (std::size_t i = 0; i < counts.size(); ++i)
    if (counts[i] > 0.)
      svg.add(
          R"(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" rx="1.5" fill="currentColor" fill-opacity=".28"/>)",
          x(low + bin * double(i)) + 1., base - (base - bars) * counts[i] / most, x(low + bin) - x(low) - 2.,
          (base - bars) * counts[i] / most);
  bottom_marks(svg, x, {base, base}, 8, 11.);
  svg.line(x.from, base, x.to, base, .5);
  svg.add(
      R"(<line x1="{0:.1f}" y1="{2}" x2="{1:.1f}" y2="{2}" stroke="#D55E00" stroke-width="4" stroke-linecap="round" stroke-opacity=".5"/>)",
      x(lower), x(upper), found_y);
  svg.add(R"(<line x1="{0:.1f}" y1="{1}" x2="{0:.1f}" y2="{2}" stroke="#D55E00" stroke-width="2"/>)",
          x(found), found_y, base);
  svg.add(R"(<circle cx="{:.1f}" cy="{}" r="6" fill="#D55E00"/>)", x(found), found_y);
  const std::string found_words = fmt::format("found: {:.3f}", found);
  const double found_half = .5 * width_of(found_words, 12.);
  svg.text(std::clamp(x(found), found_half, width - found_half), 20., found_words, "middle");
  if (!null.empty()) {
    const std::string words = fmt::format("by chance ({} dealings)", null.size());
    const double half = .5 * width_of(words, 11.), aside = half + 8.;  // of the line at what was found
    double middle = x(std::accumulate(null.begin(), null.end(), 0.) / double(null.size()));
    if (std::abs(middle - x(found)) < aside) middle = x(found) + (middle > x(found) ? aside : -aside);
    if (middle < half) middle = x(found) + aside;
    svg.text(middle, bars - 10., words, "middle", 11., .7);
  }
  svg.text(.5 * (x.from + x.to), base + 38., title, "middle", 12., .85);
  return svg.done(base + 48., title);
}

}  // namespace forest::cli
