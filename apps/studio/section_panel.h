// SPDX-License-Identifier: Apache-2.0
// The section: what the plane of intersection cuts, as a section of a series shows it, with a slider that moves the plane.
#pragma once

#include <QImage>
#include <QTimer>
#include <QWidget>
#include <functional>
#include <optional>

#include "forest/scene/slice_picture.h"

#include "apps/studio/settings.h"

class QSlider;

namespace forest::studio {

/// The picture alone. Wheel: larger or smaller; drag: across.
class SectionView final : public QWidget {
 public:
  explicit SectionView(scene::Forest forest, QWidget* parent = nullptr);
  /// Shows what `settings` say, soon.
  void show_settings(const Settings& settings);
  /// Neurons have these colours, and are hidden where these hide them.
  void show_colouring(const scene::Colouring& colouring);

 protected:
  void paintEvent(QPaintEvent* event) override;
  void resizeEvent(QResizeEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void wheelEvent(QWheelEvent* event) override;
  QSize sizeHint() const override { return {300, 300}; }

 private:
  void draw();
  /// Before the soma that lies nearest to the plane and to the middle of the forest: a person sees what a cell is there.
  Place opening(const Plane& plane) const;
  scene::SlicePicture picture() const;

  scene::Forest forest_;
  Settings settings_;
  scene::Colouring colouring_;
  std::optional<Place> centre_;  // along the plane's right and up; none: nothing was cut yet
  double height_ = 200.;         // µm
  scene::Arrangement places_;    // of the scale bar: it does not jump while the plane moves
  QPointF mouse_;
  QImage image_;
  QTimer soon_;
};

class SectionPanel final : public QWidget {
 public:
  SectionPanel(scene::Forest forest, const Settings& settings, const scene::Colouring& colouring,
               Change change, QWidget* parent = nullptr);
  /// Shows `settings`, telling nobody.
  void show_settings(const Settings& settings);
  void show_colouring(const scene::Colouring& colouring);

 private:
  SectionView* view_;
  QSlider* slider_;
};

}  // namespace forest::studio
