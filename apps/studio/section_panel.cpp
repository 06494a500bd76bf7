// SPDX-License-Identifier: Apache-2.0
#include "apps/studio/section_panel.h"

#include <QMouseEvent>
#include <QPainter>
#include <QSignalBlocker>
#include <QSlider>
#include <QVBoxLayout>
#include <algorithm>
#include <cmath>

namespace forest::studio {
namespace {

constexpr int soon_milliseconds = 15;                   // changes that come together are drawn once
constexpr double slider_step = .5;                      // µm
constexpr double least_height = 2., most_height = 1e5;  // µm

}  // namespace

SectionView::SectionView(scene::Forest forest, QWidget* parent)
    : QWidget(parent), forest_(std::move(forest)) {
  setMinimumSize(160, 120);
  setAccessibleName(tr("The section"));
  setAccessibleDescription(tr("What the plane of intersection cuts; wheel for size, drag to move across"));
  soon_.setSingleShot(true);
  soon_.setInterval(soon_milliseconds);
  connect(&soon_, &QTimer::timeout, this, [this] { draw(); });
}

scene::SlicePicture SectionView::picture() const {
  const qreal ratio = devicePixelRatioF();
  return {.centre = centre_.value_or(Place(0., 0.)),
          .height = height_,
          .width_pixels = std::uint32_t(std::max(1l, std::lround(width() * ratio))),
          .height_pixels = std::uint32_t(std::max(1l, std::lround(height() * ratio))),
          .background = settings_.view.background,
          .words = true};
}

void SectionView::show_settings(const Settings& settings) {
  const bool moved = settings.plane != settings_.plane || settings.across != settings_.across ||
                     settings.plane_at != settings_.plane_at ||
                     settings.normal_azimuth != settings_.normal_azimuth ||
                     settings.normal_elevation != settings_.normal_elevation;
  settings_ = settings;
  if (moved) soon_.start();
  if (image_.isNull()) update();  // what is written instead
}

void SectionView::show_colouring(const scene::Colouring& colouring) {
  colouring_ = colouring;
  soon_.start();
}

void SectionView::draw() {
  if (!settings_.plane || !isVisible()) return;
  const Plane plane = plane_of(settings_, forest_.soma_bounds().centre(), forest_.circuit().up);
  if (!centre_) centre_ = opening(plane);
  const scene::SlicePicture drawn = picture();
  const frame::Image image = scene::paint(
      scene::visible(scene::slice(forest_, plane, drawn.sheet()), colouring_), colouring_, drawn, places_);
  image_ = QImage(image.pixels.data(), int(image.width), int(image.height), QImage::Format_RGBX8888).copy();
  image_.setDevicePixelRatio(devicePixelRatioF());
  update();
}

Place SectionView::opening(const Plane& plane) const {
  const Vec3 middle = forest_.soma_bounds().centre();
  Place best(0., 0.);
  float least = INFINITY;
  for (const frame::Instance& i : forest_.instances()) {
    const Vec3 at = Vec3(i.x, i.y, i.z) - plane.origin;
    const float off = std::abs(at.dot(plane.normal)),
                cut = off - forest_.neurons()[i.morphology].soma_radius / 2.f;
    // One that is cut beats one that is not, however far from the middle.
    const float cost = (cut > 0.f ? 100.f * cut : 0.f) + (Vec3(i.x, i.y, i.z) - middle).norm();
    if (cost < least) least = cost, best = Place(at.dot(plane.right), at.dot(plane.up));
  }
  return best;
}

void SectionView::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  if (settings_.plane && !image_.isNull()) return painter.drawImage(0, 0, image_);
  painter.drawText(
      rect(), int(Qt::AlignCenter) | int(Qt::TextWordWrap),
      settings_.plane ? tr("cutting …") : tr("K shows the plane of intersection and what it cuts"));
}

void SectionView::resizeEvent(QResizeEvent*) { soon_.start(); }

void SectionView::mousePressEvent(QMouseEvent* event) { mouse_ = event->position(); }

void SectionView::mouseMoveEvent(QMouseEvent* event) {
  if (!event->buttons()) return;
  const QPointF moved = event->position() - mouse_;
  mouse_ = event->position();
  const double pixel = height_ / std::max(1, height());
  if (centre_) *centre_ += Place(-moved.x() * pixel, moved.y() * pixel);
  soon_.start();
}

void SectionView::wheelEvent(QWheelEvent* event) {
  const double before = height_ / std::max(1, height());
  height_ = std::clamp(height_ * std::pow(.85, event->angleDelta().y() / 120.), least_height, most_height);
  const double after = height_ / std::max(1, height());
  const QPointF off = event->position() - QPointF(.5 * width(), .5 * height());
  if (centre_)
    *centre_ += Place(off.x(), -off.y()) * (before - after);  // what is under the mouse stays there
  event->accept();
  soon_.start();
}

SectionPanel::SectionPanel(scene::Forest forest, const Settings& settings, const scene::Colouring& colouring,
                           Change change, QWidget* parent)
    : QWidget(parent), view_(new SectionView(forest, this)), slider_(new QSlider(Qt::Horizontal, this)) {
  setAccessibleName(tr("Section"));
  const Bounds bounds = forest.soma_bounds();
  const double far = bounds.empty() ? 100. : .5 * double(bounds.extent().norm()) + 200.;
  slider_->setRange(int(-far / slider_step), int(far / slider_step));
  slider_->setPageStep(int(10. / slider_step));
  slider_->setAccessibleName(tr("Place of the plane"));
  slider_->setToolTip(tr("Moves the plane along its normal"));
  connect(slider_, &QSlider::valueChanged, this, [this, change = std::move(change)](int value) {
    change([value](Settings& s) { s.plane_at = float(value * slider_step), s.plane = true; });
  });
  auto* column = new QVBoxLayout(this);
  column->setContentsMargins(4, 4, 4, 4);
  column->addWidget(view_, 1);
  column->addWidget(slider_);
  show_colouring(colouring);
  show_settings(settings);
}

void SectionPanel::show_colouring(const scene::Colouring& colouring) { view_->show_colouring(colouring); }

void SectionPanel::show_settings(const Settings& settings) {
  const QSignalBlocker quiet(slider_);
  slider_->setValue(int(std::lround(double(settings.plane_at) / slider_step)));
  view_->show_settings(settings);
}

}  // namespace forest::studio
