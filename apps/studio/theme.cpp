// SPDX-License-Identifier: Apache-2.0
#include "apps/studio/theme.h"

#include <QApplication>
#include <QPainter>
#include <QPalette>
#include <QProxyStyle>
#include <QStyleOption>

namespace forest::studio {
namespace {

// Fusion, with check boxes that can be seen on dark ground.
class Style final : public QProxyStyle {
 public:
  Style() : QProxyStyle("Fusion") {}

  void drawPrimitive(PrimitiveElement element, const QStyleOption* option, QPainter* painter,
                     const QWidget* widget) const override {
    if (element != PE_IndicatorCheckBox && element != PE_IndicatorItemViewItemCheck)
      return QProxyStyle::drawPrimitive(element, option, painter, widget);
    const QPalette& palette = option->palette;
    const QRectF box = QRectF(option->rect).adjusted(.5, .5, -.5, -.5);
    const bool on = option->state & State_On, some = option->state & State_NoChange,
               bright = option->state & (State_MouseOver | State_HasFocus);
    painter->save();
    painter->setRenderHint(QPainter::Antialiasing);
    painter->setPen(bright || on ? palette.color(QPalette::Highlight) : QColor(0x45, 0x52, 0x64));
    painter->setBrush(on ? palette.color(QPalette::Highlight) : palette.color(QPalette::Base));
    painter->drawRoundedRect(box, 3, 3);
    if (on) {
      painter->setPen(
          QPen(palette.color(QPalette::HighlightedText), 1.8, Qt::SolidLine, Qt::RoundCap, Qt::RoundJoin));
      const auto at = [&](double x, double y) {
        return box.topLeft() + QPointF(x * box.width(), y * box.height());
      };
      painter->drawPolyline(QPolygonF{at(.24, .52), at(.43, .71), at(.77, .31)});
    }
    if (some) {
      painter->setPen(QPen(palette.color(QPalette::Highlight), 1.8, Qt::SolidLine, Qt::RoundCap));
      painter->drawLine(box.topLeft() + QPointF(.3 * box.width(), .5 * box.height()),
                        box.topLeft() + QPointF(.7 * box.width(), .5 * box.height()));
    }
    painter->restore();
  }
};

}  // namespace

void apply_theme(QApplication& application) {
  application.setStyle(new Style);
  const QColor window(0x12, 0x16, 0x1d), base(0x0d, 0x10, 0x16), raised(0x1e, 0x24, 0x2e),
      text(0xcf, 0xd7, 0xe2), quiet(0x6c, 0x78, 0x8a), accent(0x56, 0xb4, 0xe9);
  QPalette p;
  p.setColor(QPalette::Window, window);
  p.setColor(QPalette::WindowText, text);
  p.setColor(QPalette::Base, base);
  p.setColor(QPalette::AlternateBase, QColor(0x15, 0x1a, 0x22));
  p.setColor(QPalette::Text, text);
  p.setColor(QPalette::Button, raised);
  p.setColor(QPalette::ButtonText, text);
  p.setColor(QPalette::ToolTipBase, raised);
  p.setColor(QPalette::ToolTipText, text);
  p.setColor(QPalette::PlaceholderText, quiet);
  p.setColor(QPalette::Highlight, accent);
  p.setColor(QPalette::HighlightedText, base);
  p.setColor(QPalette::Link, accent);
  for (const auto role : {QPalette::WindowText, QPalette::Text, QPalette::ButtonText})
    p.setColor(QPalette::Disabled, role, quiet);
  application.setPalette(p);
  application.setStyleSheet(R"(
    QMainWindow::separator { background: #0b0e13; width: 3px; height: 3px; }
    QMenuBar, QStatusBar { background: #12161d; }
    QMenuBar::item:selected, QMenu::item:selected { background: #26303d; color: #e8eef6; }
    QMenu { background: #171c25; border: 1px solid #2a3341; padding: 4px; }
    QMenu::separator { height: 1px; background: #2a3341; margin: 4px 8px; }
    QStatusBar { color: #8c99ac; border-top: 1px solid #1d2430; }
    QStatusBar::item { border: none; }
    QStatusBar QLabel { color: #8c99ac; padding: 1px 8px; }
    QDockWidget { color: #cfd7e2; font-weight: 600; }
    QDockWidget::title { background: #171c25; padding: 6px 10px; }
    QScrollArea, QScrollArea > QWidget > QWidget { background: #12161d; border: none; }
    QLabel#group { color: #6c788a; font-size: 8pt; font-weight: 600; padding-top: 4px; }
    QLabel#hint { color: #6c788a; padding: 16px; }
    QDoubleSpinBox, QSpinBox, QLineEdit, QComboBox { background: #0d1016; border: 1px solid #252d39; border-radius: 3px;
                                padding: 2px 5px; min-height: 17px; selection-background-color: #56b4e9; }
    QDoubleSpinBox:focus, QSpinBox:focus, QLineEdit:focus, QComboBox:focus { border-color: #56b4e9; }
    QDoubleSpinBox:disabled { color: #4d5867; }
    QCheckBox { spacing: 8px; }
    QCheckBox:focus { color: #56b4e9; }
    QTableWidget, QTreeWidget { background: #12161d; alternate-background-color: #161b23; selection-background-color: #26303d;
                   selection-color: #e8eef6; }
    QTableWidget::item { padding: 0 6px; }
    QTreeWidget::item { padding: 2px 4px; }
    QScrollBar:vertical { background: transparent; width: 9px; margin: 0; }
    QScrollBar::handle:vertical { background: #2a3341; border-radius: 4px; min-height: 24px; }
    QScrollBar::add-line, QScrollBar::sub-line { height: 0; width: 0; }
    QToolTip { background: #1e242e; color: #cfd7e2; border: 1px solid #2a3341; padding: 4px; }
  )");
}

}  // namespace forest::studio
