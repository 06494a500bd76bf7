// SPDX-License-Identifier: Apache-2.0
// A simulation in the studio: time that runs, colours, the soma voltages of all neurons over time, and the histories of
// compartments that were clicked.
#pragma once

#include <QImage>
#include <QWidget>
#include <functional>
#include <vector>

#include "forest/reports/trace.h"

#include "apps/studio/viewport.h"

class QCheckBox;
class QPainter;
class QComboBox;
class QDoubleSpinBox;
class QLabel;
class QPushButton;
class QSlider;

namespace forest::studio {

/// Time to the right, neurons downwards, colour: the voltage of the soma. A click on a row selects its neuron.
class RasterView final : public QWidget {
 public:
  explicit RasterView(Viewport& viewport, QWidget* parent = nullptr);
  void forget();       // what was drawn: another simulation, other colours
  QRect plot() const;  // where the colours are, within the axes

 protected:
  void paintEvent(QPaintEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;
  QSize sizeHint() const override { return {420, 150}; }

 private:
  void draw();
  void paint_axes(QPainter& painter) const;
  Viewport& viewport_;
  QImage drawn_;
};

/// Histories of compartments, one colour each. A click goes to that time.
class TraceView final : public QWidget {
 public:
  TraceView(Viewport& viewport, const std::vector<reports::Trace>& traces, QWidget* parent = nullptr);
  void forget();

 protected:
  void paintEvent(QPaintEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;
  QSize sizeHint() const override { return {420, 150}; }

 private:
  // Where the names of the traces stand: in rows above the curves.
  std::vector<QRectF> names() const;
  QRectF plot() const;
  void draw();
  Viewport& viewport_;
  const std::vector<reports::Trace>& traces_;
  QImage drawn_;
};

class ActivityPanel final : public QWidget {
 public:
  /// @param clamped  called when other traces are shown, with how long the last one took to read, ms
  ActivityPanel(Viewport& viewport, std::function<void(double)> clamped, QWidget* parent = nullptr);

  void show_activity();   // another simulation is open
  void show_selection();  // clamps the compartment that was picked
  void follow();          // the moment has changed, or the look
  void step(int steps);
  void clear_traces();
  const std::vector<reports::Trace>& traces() const { return traces_; }
  QRect raster() const;  // where its colours are, on the screen

 private:
  QDoubleSpinBox* field(const char* name, const char* unit, const char* hint, double low, double high);
  void edit();        // the look, as the fields have it
  void paint_maps();  // in the colours that branches have on the background

  static constexpr std::size_t most = 8;  // traces; the oldest gives way
  Viewport& viewport_;
  std::function<void(double)> clamped_;
  std::vector<reports::Trace> traces_;
  scene::Background background_ = scene::Background::dark;
  QPushButton* play_;
  QSlider* slider_;
  QLabel* moment_;
  QDoubleSpinBox *rate_, *low_, *high_, *threshold_, *speed_;
  QCheckBox* has_threshold_;
  QComboBox* map_;
  RasterView* raster_;
  TraceView* plot_;
};

}  // namespace forest::studio
