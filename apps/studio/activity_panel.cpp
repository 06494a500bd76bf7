// SPDX-License-Identifier: Apache-2.0
#include "apps/studio/activity_panel.h"

#include <QCheckBox>
#include <QComboBox>
#include <QDoubleSpinBox>
#include <QElapsedTimer>
#include <QHBoxLayout>
#include <QLabel>
#include <QMouseEvent>
#include <QPainter>
#include <QPainterPath>
#include <QPushButton>
#include <QSignalBlocker>
#include <QSlider>
#include <algorithm>
#include <cmath>

#include "forest/core/error.h"
#include "forest/core/round_numbers.h"

#include "apps/studio/annotation.h"

namespace forest::studio {
namespace {

// Okabe & Ito (2008), those that are seen on dark ground.
const QColor trace_colours[] = {{230, 159, 0}, {86, 180, 233},  {0, 178, 130},   {240, 228, 66},
                                {213, 94, 0},  {204, 121, 167}, {150, 170, 255}, {230, 230, 230}};
const QColor ground(13, 16, 22), frame_colour(37, 45, 57), faint(108, 120, 138), ink(207, 215, 226),
    moment_colour(255, 255, 255, 190), spike_colour(255, 250, 220);

// Of a value as branches show it in the picture beside.
QColor colour_on_branches(const Viewport& viewport, const scene::ColourMap& map, float t) {
  return to_screen(scene::on_branches(map, t, viewport.settings().view.background));
}

// Around a plot, points: what its axes need.
constexpr int axis_left = 44, axis_right = 8, axis_below = 20, axis_top = 18;

// Where a time lies between the first step and the last, 0 to 1, and back.
double share_of(const scene::Playback& playback, double time) {
  const double length = playback.end() - playback.begin();
  return length > 0. ? std::clamp((time - playback.begin()) / length, 0., 1.) : 0.;
}
double time_at(const scene::Playback& playback, double share) {
  return playback.begin() + std::clamp(share, 0., 1.) * (playback.end() - playback.begin());
}

// Round times under a plot, and at its right end their unit.
void paint_times(QPainter& painter, const QRectF& area, const scene::Playback& playback) {
  constexpr double apart = 80., half = 30.;
  const double unit = area.right() - painter.fontMetrics().horizontalAdvance("ms") - 6.;
  painter.setPen(faint);
  painter.drawText(QRectF(area.left(), area.bottom() + 3, area.width(), 16), Qt::AlignRight, "ms");
  for (const double t : ticks(playback.begin(), playback.end(), std::max(1, int(area.width() / apart)))) {
    const double x = area.left() + share_of(playback, t) * area.width();
    painter.drawLine(QPointF(x, area.bottom() + 1), QPointF(x, area.bottom() + 4));
    const QString number = QString::number(t);
    if (x + .5 * painter.fontMetrics().horizontalAdvance(number) < unit)
      painter.drawText(QRectF(x - half, area.bottom() + 3, 2. * half, 16), Qt::AlignHCenter, number);
  }
}

}  // namespace

RasterView::RasterView(Viewport& viewport, QWidget* parent) : QWidget(parent), viewport_(viewport) {
  setObjectName("raster");
  setMinimumSize(160, 120);
  setAccessibleName(tr("Raster"));
  setAccessibleDescription(
      tr("Soma voltages: time to the right, neurons downwards; click a row to select its neuron"));
  setToolTip(accessibleDescription());
}

void RasterView::forget() {
  drawn_ = {};
  update();
}

QRect RasterView::plot() const { return rect().adjusted(axis_left, axis_top, -axis_right, -axis_below); }

void RasterView::draw() {
  const scene::Playback& playback = *viewport_.playback();
  const reports::Activity& activity = playback.activity();
  const int width = plot().width(), height = plot().height();
  drawn_ = QImage(plot().size(), QImage::Format_RGB32);
  const auto codes =
      activity.raster_picture(0, activity.facts().steps, std::uint32_t(width), std::uint32_t(height));
  const scene::ActivityView look = viewport_.activity();
  QRgb colours[256];
  for (std::size_t code = 0; code < 256; ++code) {
    const float value = activity.facts().range.value(reports::Code(code));
    const bool none = std::isnan(value) || (look.threshold && value < *look.threshold);
    colours[code] =
        none ? frame_colour.rgb()
             : colour_on_branches(viewport_, *look.map, (value - look.low) / (look.high - look.low)).rgb();
  }
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      drawn_.setPixel(x, y, colours[codes[std::size_t(y) * std::size_t(width) + std::size_t(x)]]);
  if (playback.has_values()) return;
  QPainter dots(&drawn_);  // spikes alone: a dot each
  const double row_height = double(height) / double(std::max<std::size_t>(1, activity.rows().size()));
  for (const reports::Spike& spike : activity.spikes())
    if (const auto row = activity.row_of_instance(spike.instance))
      dots.fillRect(QRectF(share_of(playback, spike.time) * width - 1., *row * row_height, 2.,
                           std::max(2., row_height)),
                    spike_colour);
}

// Neurons by the numbers that the selection gives them, at round rows; round times below.
void RasterView::paint_axes(QPainter& painter) const {
  const scene::Playback& playback = *viewport_.playback();
  const auto rows = playback.activity().rows();
  const QRectF area = plot();
  const double line = painter.fontMetrics().height(), row_height = area.height() / double(rows.size());
  painter.setPen(faint);
  painter.drawText(QRectF(0, 0, area.left() + 60, area.top() - 1), Qt::AlignLeft | Qt::AlignBottom,
                   tr("neuron"));
  const double apart = std::max(1., round_above(1.5 * line / row_height));  // rows
  for (double row = 0.; row < double(rows.size()); row += apart) {
    const double y = area.top() + (row + .5) * row_height;
    painter.drawLine(QPointF(area.left() - 4, y), QPointF(area.left() - 1, y));
    painter.drawText(QRectF(0, y - .5 * line, area.left() - 6, line), Qt::AlignRight | Qt::AlignVCenter,
                     QString::number(rows[std::size_t(row)].instance));
  }
  paint_times(painter, area, playback);
}

void RasterView::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  painter.fillRect(rect(), ground);
  const scene::Playback* playback = viewport_.playback();
  if (!playback || plot().isEmpty()) return;
  const reports::Activity& activity = playback->activity();
  const QRectF area = plot();
  try {
    if (drawn_.size() != plot().size()) draw();
  } catch (const InputError& error) {
    return viewport_.put_away_playback(QString::fromUtf8(error.what()));
  }
  painter.drawImage(plot().topLeft(), drawn_);
  paint_axes(painter);
  const double x = area.left() + share_of(*playback, viewport_.time()) * area.width();
  painter.setPen(QPen(moment_colour, 1.));
  painter.drawLine(QPointF(x, area.top()), QPointF(x, area.bottom()));
  if (const auto& selection = viewport_.selection())
    if (const auto row = activity.row_of_instance(selection->pick.instance)) {
      const double rows = double(activity.rows().size()), line = area.height() / rows;
      const QRectF mark(area.left(), area.top() + *row * line - 1., area.width() - 1.,
                        std::max(line, 2.) + 1.);
      painter.setPen(QPen(Qt::white, 1.4));  // as the rim in the picture
      painter.drawRect(mark);
    }
}

void RasterView::mousePressEvent(QMouseEvent* event) {
  const scene::Playback* playback = viewport_.playback();
  if (!playback || plot().isEmpty()) return;
  const auto rows = playback->activity().rows();
  const double down = (event->position().y() - plot().top()) / plot().height();
  const auto row = std::size_t(std::clamp(down, 0., .999999) * double(rows.size()));
  const std::uint32_t instance = rows[row].instance;
  const scene::Forest& forest = viewport_.forest();
  const scene::Neuron& neuron = forest.neurons()[forest.instances()[instance].morphology];
  if (!neuron.original_count) return;
  scene::Pick pick{.instance = instance, .segment = neuron.first_segment, .section = scene::soma_section};
  // A neuron without a soma is picked by its first section.
  if (!(neuron.soma_radius > 0.f)) pick.section = forest.section_of_segment()[neuron.first_original];
  viewport_.select(pick);
}

TraceView::TraceView(Viewport& viewport, const std::vector<reports::Trace>& traces, QWidget* parent)
    : QWidget(parent), viewport_(viewport), traces_(traces) {
  setObjectName("traces");
  setMinimumSize(160, 120);
  setAccessibleName(tr("Traces"));
  setAccessibleDescription(tr("Histories of clicked compartments; click to go to a time"));
  setToolTip(accessibleDescription());
}

void TraceView::forget() {
  drawn_ = {};
  update();
}

std::vector<QRectF> TraceView::names() const {
  constexpr qreal line = 14., apart = 12.;
  const QFontMetricsF metrics(font());
  const QRectF area = QRectF(rect()).adjusted(axis_left + 60., 1., -axis_right, 0.);  // beside the unit
  std::vector<QRectF> places;
  qreal x = area.left(), y = area.top();
  for (const reports::Trace& trace : traces_) {
    const qreal width = std::ceil(metrics.horizontalAdvance(QString::fromStdString(trace.name()))) + 2.;
    if (x > area.left() && x + width > area.right()) x = area.left(), y += line;
    places.emplace_back(x, y, width, line);
    x += width + apart;
  }
  return places;
}

QRectF TraceView::plot() const {
  const auto places = names();
  const qreal above = places.empty() ? 0. : places.back().bottom() + 3.;
  return QRectF(rect()).adjusted(axis_left, std::clamp<qreal>(above, axis_top, .5 * height()), -axis_right,
                                 -axis_below);
}

void TraceView::draw() {
  drawn_ = QImage(size() * devicePixelRatioF(), QImage::Format_RGB32);
  drawn_.setDevicePixelRatio(devicePixelRatioF());
  drawn_.fill(ground);
  QPainter painter(&drawn_);
  painter.setFont(font());
  painter.setRenderHint(QPainter::Antialiasing);
  const scene::Playback& playback = *viewport_.playback();
  const reports::Facts& facts = playback.activity().facts();
  const QRectF area = plot();
  if (traces_.empty()) {
    painter.setPen(faint);
    painter.drawText(rect(), Qt::AlignCenter,
                     playback.has_values() ? tr("Click a branch: its whole history is shown here.")
                                           : tr("There are spikes alone, and no values to show."));
    return;
  }
  float low = INFINITY, high = -INFINITY;
  for (const reports::Trace& t : traces_)
    for (const float v : t.values)
      if (!std::isnan(v)) low = std::min(low, v), high = std::max(high, v);
  if (!(low <= high)) low = 0.f, high = 1.f;
  const float room = std::max(.05f * (high - low), facts.range.step());
  low -= room, high += room;
  const auto y_of = [&](float v) { return area.bottom() - qreal((v - low) / (high - low)) * area.height(); };
  for (const double v : ticks(double(low), double(high), 6)) {
    const qreal y = y_of(float(v));
    painter.setPen(frame_colour);
    painter.drawLine(QPointF(area.left(), y), QPointF(area.right(), y));
    painter.setPen(faint);
    painter.drawText(QRectF(0, y - 8, area.left() - 5, 16), Qt::AlignRight | Qt::AlignVCenter,
                     QString::number(v));
  }
  painter.setPen(faint);
  painter.drawText(QRectF(0, 0, area.right(), area.top() - 1), Qt::AlignLeft | Qt::AlignBottom,
                   QString::fromStdString(facts.units));
  paint_times(painter, area, playback);
  // Of the steps under one column of pixels the least and the greatest: no spike is lost.
  const auto columns = std::max<std::size_t>(2, std::size_t(area.width()));
  for (std::size_t t = 0; t < traces_.size(); ++t) {
    const auto& values = traces_[t].values;
    const auto x_of = [&](std::size_t i) {
      return area.left() + area.width() * double(i) / double(std::max<std::size_t>(1, values.size() - 1));
    };
    QPainterPath path;
    bool down = false;  // the pen
    const std::size_t bundle = std::max<std::size_t>(1, values.size() / columns);
    for (std::size_t i = 0; i < values.size(); i += bundle) {
      std::size_t least = i, most = i;
      for (std::size_t k = i; k < std::min(i + bundle, values.size()); ++k) {
        if (!(values[k] >= values[least])) least = k;
        if (!(values[k] <= values[most])) most = k;
      }
      for (const std::size_t k : {std::min(least, most), std::max(least, most)}) {
        if (std::isnan(values[k])) {
          down = false;
          continue;
        }
        const QPointF point(x_of(k), y_of(values[k]));
        down ? path.lineTo(point) : path.moveTo(point);
        down = true;
      }
    }
    painter.setPen(QPen(trace_colours[t % std::size(trace_colours)], 1.3));
    painter.drawPath(path);
  }
  const auto places = names();
  for (std::size_t t = 0; t < places.size() && places[t].bottom() <= area.top(); ++t) {
    painter.setPen(trace_colours[t % std::size(trace_colours)]);
    painter.drawText(places[t], Qt::AlignLeft | Qt::AlignVCenter, QString::fromStdString(traces_[t].name()));
  }
}

void TraceView::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  if (!viewport_.playback()) return painter.fillRect(rect(), ground);
  if (drawn_.size() != size() * devicePixelRatioF()) draw();
  painter.drawImage(0, 0, drawn_);
  if (traces_.empty()) return;  // a word stands there, and no curve
  const double x = plot().left() + share_of(*viewport_.playback(), viewport_.time()) * plot().width();
  painter.setPen(QPen(moment_colour, 1.));
  painter.drawLine(QPointF(x, plot().top()), QPointF(x, plot().bottom()));
}

void TraceView::mousePressEvent(QMouseEvent* event) {
  if (const scene::Playback* playback = viewport_.playback())
    viewport_.set_time(time_at(*playback, (event->position().x() - plot().left()) / plot().width()));
}

ActivityPanel::ActivityPanel(Viewport& viewport, std::function<void(double)> clamped, QWidget* parent)
    : QWidget(parent), viewport_(viewport), clamped_(std::move(clamped)) {
  setAccessibleName(tr("Activity"));
  auto* column = new QVBoxLayout(this);
  column->setContentsMargins(10, 4, 10, 8);
  column->setSpacing(5);

  auto* transport = new QHBoxLayout;
  play_ = new QPushButton(tr("Play"), this);
  play_->setAccessibleDescription(tr("Let the simulation go on, or stand still"));
  play_->setToolTip(tr("Let the simulation go on, or stand still (Space)"));
  play_->setFocusPolicy(Qt::TabFocus);
  play_->setFixedWidth(70);
  connect(play_, &QPushButton::clicked, this, [this] { viewport_.set_playing(!viewport_.playing()); });
  slider_ = new QSlider(Qt::Horizontal, this);
  slider_->setAccessibleName(tr("Time"));
  slider_->setToolTip(tr("The moment that is shown (. and , go step by step)"));
  slider_->setFocusPolicy(Qt::TabFocus);
  connect(slider_, &QSlider::valueChanged, this, [this](int step) {
    if (const auto* playback = viewport_.playback())
      viewport_.set_time(playback->activity().facts().time(std::uint64_t(step)));
  });
  moment_ = new QLabel(this);
  moment_->setMinimumWidth(130);
  moment_->setAlignment(Qt::AlignRight | Qt::AlignVCenter);
  rate_ = field("Speed", "ms/s", "Milliseconds of the simulation that are played in a second", .001, 1e6);
  connect(rate_, &QDoubleSpinBox::valueChanged, this,
          [this](double rate) { viewport_.set_rate(float(rate)); });
  transport->addWidget(play_);
  transport->addWidget(slider_, 1);
  transport->addWidget(moment_);
  transport->addWidget(rate_);
  column->addLayout(transport);

  auto* look = new QHBoxLayout;
  map_ = new QComboBox(this);
  map_->setAccessibleName(tr("Colour map"));
  map_->setToolTip(tr("Colours of the values; but for cool-warm more is always lighter"));
  map_->setFocusPolicy(Qt::TabFocus);
  map_->setIconSize({72, 12});
  for (const scene::ColourMap& map : scene::colour_maps()) map_->addItem(map.name);
  paint_maps();
  connect(map_, &QComboBox::activated, this, [this] { edit(); });
  low_ = field("From", "", "The value at the lower end of the colours", -1e6, 1e6);
  high_ = field("to", "", "The value at the upper end of the colours", -1e6, 1e6);
  has_threshold_ = new QCheckBox(tr("Threshold"), this);
  has_threshold_->setToolTip(tr("What is less is dim and grey"));
  has_threshold_->setFocusPolicy(Qt::TabFocus);
  connect(has_threshold_, &QCheckBox::clicked, this, [this] { edit(); });
  threshold_ = field("", "", "What is less is dim and grey", -1e6, 1e6);
  speed_ = field("Spikes", "µm/ms", "Speed of spikes along axons; 0 for no flashes", 0., 1e6);
  for (QDoubleSpinBox* box : {low_, high_, threshold_, speed_})
    connect(box, &QDoubleSpinBox::valueChanged, this, [this] { edit(); });
  look->addWidget(map_);
  look->addWidget(low_);
  look->addWidget(high_);
  look->addWidget(has_threshold_);
  look->addWidget(threshold_);
  look->addWidget(speed_);
  look->addStretch();
  column->addLayout(look);

  auto* views = new QHBoxLayout;
  raster_ = new RasterView(viewport_, this);
  plot_ = new TraceView(viewport_, traces_, this);
  views->addWidget(raster_, 1);
  views->addWidget(plot_, 1);
  column->addLayout(views, 1);
  follow();
}

QDoubleSpinBox* ActivityPanel::field(const char* name, const char* unit, const char* hint, double low,
                                     double high) {
  auto* box = new QDoubleSpinBox(this);
  box->setAccessibleName(tr(*name ? name : hint));
  box->setAccessibleDescription(tr(hint));
  box->setToolTip(tr(hint));
  if (*name) box->setPrefix(QString("%1 ").arg(name));
  if (*unit) box->setSuffix(QString(" %1").arg(unit));
  box->setRange(low, high);
  box->setDecimals(low > 0. ? 3 : 1);
  box->setButtonSymbols(QAbstractSpinBox::NoButtons);
  box->setKeyboardTracking(false);
  box->setFocusPolicy(Qt::ClickFocus);
  box->setFixedWidth(*unit ? 140 : 90);
  return box;
}

void ActivityPanel::paint_maps() {
  constexpr int width = 72, height = 12;
  background_ = viewport_.settings().view.background;
  for (int i = 0; i < map_->count(); ++i) {
    QPixmap icon(width, height);
    QPainter painter(&icon);
    for (int x = 0; x < width; ++x)
      painter.fillRect(
          x, 0, 1, height,
          colour_on_branches(viewport_, scene::colour_maps()[std::size_t(i)], float(x) / float(width - 1)));
    painter.end();
    map_->setItemIcon(i, QIcon(icon));
  }
}

void ActivityPanel::edit() {
  scene::ActivityView look = viewport_.activity();
  look.map = &scene::colour_maps()[std::size_t(std::max(0, map_->currentIndex()))];
  if (low_->value() < high_->value()) look.low = float(low_->value()), look.high = float(high_->value());
  look.threshold = has_threshold_->isChecked() ? std::optional(float(threshold_->value())) : std::nullopt;
  look.speed = float(speed_->value());
  raster_->forget();
  viewport_.change(look);
  follow();
}

void ActivityPanel::follow() {
  const scene::Playback* playback = viewport_.playback();
  setEnabled(playback != nullptr);
  if (!playback) return;
  if (background_ != viewport_.settings().view.background) {
    paint_maps();
    raster_->forget();
  }
  const auto step = playback->step_at(viewport_.time());
  const QSignalBlocker quiet[] = {QSignalBlocker(slider_),    QSignalBlocker(rate_),
                                  QSignalBlocker(low_),       QSignalBlocker(high_),
                                  QSignalBlocker(threshold_), QSignalBlocker(speed_)};
  slider_->setValue(int(step));
  moment_->setText(tr("%1 of %2 ms").arg(viewport_.time(), 0, 'f', 1).arg(playback->end(), 0, 'f', 1));
  play_->setText(viewport_.playing() ? tr("Pause") : tr("Play"));
  const scene::ActivityView look = viewport_.activity();
  map_->setCurrentIndex(int(look.map - scene::colour_maps().data()));
  if (!rate_->hasFocus()) rate_->setValue(double(viewport_.rate()));
  if (!low_->hasFocus()) low_->setValue(double(look.low));
  if (!high_->hasFocus()) high_->setValue(double(look.high));
  if (!speed_->hasFocus()) speed_->setValue(double(look.speed));
  has_threshold_->setChecked(look.threshold.has_value());
  if (look.threshold && !threshold_->hasFocus()) threshold_->setValue(double(*look.threshold));
  raster_->update();
  plot_->update();
}

void ActivityPanel::show_activity() {
  traces_.clear();
  const scene::Playback& playback = *viewport_.playback();
  const int decimals = std::max(1, playback.activity().facts().range.decimals() - 2);
  for (QDoubleSpinBox* box : {low_, high_, threshold_}) {
    const QSignalBlocker quiet(box);
    box->setDecimals(decimals);
    box->setFixedWidth(decimals > 3 ? 130 : 90);
  }
  {
    const QSignalBlocker quiet[] = {QSignalBlocker(slider_), QSignalBlocker(threshold_)};
    const std::uint64_t last = playback.activity().facts().steps - 1;
    slider_->setRange(0, int(std::min<std::uint64_t>(last, std::numeric_limits<int>::max())));
    threshold_->setValue(double(.5f * (viewport_.activity().low + viewport_.activity().high)));
  }
  for (QWidget* of_values : std::initializer_list<QWidget*>{map_, low_, high_, has_threshold_, threshold_})
    of_values->setVisible(playback.has_values());
  // All of it in some ten seconds.
  viewport_.set_rate(float(std::max(.001, (playback.end() - playback.begin()) / 10.)));
  raster_->forget();
  plot_->forget();
  follow();
}

void ActivityPanel::show_selection() {
  raster_->update();
  const auto& selection = viewport_.selection();
  const scene::Playback* playback = viewport_.playback();
  if (!selection || !playback || !playback->has_values()) return;
  const auto compartment = playback->compartment(selection->pick.instance, selection->pick.segment);
  if (!compartment) return;
  QElapsedTimer clock;
  clock.start();
  // Clicked again it becomes the newest.
  std::erase_if(traces_, [&](const reports::Trace& t) {
    return t.row == compartment->row && t.compartment == compartment->index;
  });
  if (traces_.size() == most) traces_.erase(traces_.begin());
  try {
    traces_.push_back(reports::trace(playback->activity(), compartment->row, compartment->index));
  } catch (const InputError& error) {
    return viewport_.put_away_playback(QString::fromUtf8(error.what()));
  }
  plot_->forget();
  clamped_(double(clock.nsecsElapsed()) * 1e-6);
}

QRect ActivityPanel::raster() const {
  const QRect inside = raster_->plot();
  return {raster_->mapToGlobal(inside.topLeft()), inside.size()};
}

void ActivityPanel::step(int steps) {
  if (const scene::Playback* playback = viewport_.playback()) {
    viewport_.set_playing(false);
    viewport_.set_time(viewport_.time() + steps * playback->activity().facts().step);
  }
}

void ActivityPanel::clear_traces() {
  traces_.clear();
  plot_->forget();
  clamped_(0.);
}

}  // namespace forest::studio
