// SPDX-License-Identifier: Apache-2.0
#include "apps/studio/view_panel.h"

#include <QAbstractItemView>
#include <QCheckBox>
#include <QComboBox>
#include <QDoubleSpinBox>
#include <QKeyEvent>
#include <QLabel>
#include <QLineEdit>
#include <QShortcut>
#include <QSignalBlocker>
#include <QStyleOptionSpinBox>
#include <QVBoxLayout>
#include <algorithm>
#include <cstring>

namespace forest::studio {
namespace {

QString with_shortcut(const char* hint, const char* shortcut) {
  return *shortcut ? QString("%1 (%2)").arg(hint, QKeySequence(shortcut).toString(QKeySequence::NativeText))
                   : QString(hint);
}

// A number field that shows no more digits than matter, and gives the keyboard back when Enter is pressed. It is as wide as
// the longest number that it has shown: what is far away has long coordinates.
class NumberField final : public QDoubleSpinBox {
 public:
  using QDoubleSpinBox::QDoubleSpinBox;
  void show_number(double value) {
    setValue(value);
    if (const int wanted = width_of(text()); wanted > widest_) {
      widest_ = wanted;
      updateGeometry();
    }
  }
  QString textFromValue(double value) const override {
    return locale()
        .toString(value, 'f', std::abs(value) < 1000. ? decimals() : 0)
        .remove(locale().groupSeparator());
  }
  QSize minimumSizeHint() const override {
    return {std::max(52, widest_), QDoubleSpinBox::minimumSizeHint().height()};
  }
  QSize sizeHint() const override { return {std::max(64, widest_), QDoubleSpinBox::sizeHint().height()}; }

 protected:
  void keyPressEvent(QKeyEvent* event) override {
    QDoubleSpinBox::keyPressEvent(event);
    if (event->key() == Qt::Key_Return || event->key() == Qt::Key_Enter || event->key() == Qt::Key_Escape)
      clearFocus();
  }

 private:
  int width_of(const QString& text) const {  // with what the style draws around it
    ensurePolished();                        // else the margins are not known yet
    QStyleOptionSpinBox option;
    initStyleOption(&option);
    option.rect = QRect(0, 0, 100, 20);
    const QRect inside =
        style()->subControlRect(QStyle::CC_SpinBox, &option, QStyle::SC_SpinBoxEditField, this);
    return fontMetrics().horizontalAdvance(text) + text_margin + 100 - inside.width();
  }

  static constexpr int text_margin = 6;  // of a line of text, on both sides, and its cursor
  int widest_ = 0;
};

}  // namespace

ViewPanel::ViewPanel(const Settings& settings, Change change, QWidget* parent)
    : QWidget(parent), settings_(settings), change_(std::move(change)) {
  setAccessibleName(tr("View"));
  auto* column = new QVBoxLayout(this);
  column->setContentsMargins(10, 6, 10, 10);
  column->setSpacing(2);
  for (const char* group : groups()) {
    auto* title = new QLabel(QString(group).toUpper(), this);
    title->setObjectName("group");
    column->addWidget(title);
    const auto here = [group](const auto& row) { return std::strcmp(row.group, group) == 0; };
    for (const Toggle& toggle : toggles())
      if (here(toggle)) column->addWidget(field(toggle));
    for (const Choice& choice : choices()) {
      if (!here(choice)) continue;
      auto* line = new QHBoxLayout;
      line->addWidget(new QLabel(choice.name, this));
      line->addWidget(field(choice), 1);
      column->addLayout(line);
    }
    QHBoxLayout* line = nullptr;
    const char* row = "";
    for (const Number& number : numbers()) {
      if (!here(number)) continue;
      if (std::strcmp(row, number.row) != 0) {
        row = number.row;
        line = new QHBoxLayout;
        line->setSpacing(4);
        auto* label = new QLabel(
            *number.unit ? QString("%1 <span style='color:#7d8a9c'>%2</span>").arg(number.row, number.unit)
                         : QString(number.row),
            this);
        label->setMinimumWidth(84);
        line->addWidget(label, 1);
        column->addLayout(line);
      }
      line->addWidget(field(number));
    }
    column->addSpacing(8);
  }
  column->addStretch();
  show_settings(settings);
}

template <class Row, class Value>
void ViewPanel::set(const Row& row, Value value) {
  change_([&](Settings& settings) { row.set(settings, value); });
}

QWidget* ViewPanel::field(const Number& number) {
  auto* box = new NumberField(this);
  const QString name = *number.name ? QString("%1 %2").arg(number.row, number.name) : QString(number.row);
  box->setAccessibleName(QString("%1 (%2)").arg(name, number.unit));
  box->setToolTip(with_shortcut(number.hint, number.shortcut));
  box->setAccessibleDescription(number.hint);
  box->setDecimals(number.decimals);
  box->setRange(number.low, number.high);
  box->setSingleStep(number.step);
  box->setButtonSymbols(QAbstractSpinBox::NoButtons);
  box->setAlignment(Qt::AlignRight);
  box->setKeyboardTracking(false);
  if (*number.name) box->setPrefix(QString("%1 ").arg(number.name));
  connect(box, &QDoubleSpinBox::valueChanged, this,
          [this, &number](double value) { set(number, float(value)); });
  if (*number.shortcut)
    connect(new QShortcut(QKeySequence(number.shortcut), this), &QShortcut::activated, box, [box] {
      box->setFocus(Qt::ShortcutFocusReason);
      box->selectAll();
    });
  refresh_.push_back([this, box, &number] {
    if (box->hasFocus() && box->findChild<QLineEdit*>()->isModified()) return;  // being typed
    const QSignalBlocker quiet(box);
    box->show_number(double(number.value(settings_)));
  });
  return box;
}

QWidget* ViewPanel::field(const Choice& choice) {
  auto* box = new QComboBox(this);
  box->setAccessibleName(choice.name);
  box->setAccessibleDescription(choice.hint);
  box->setToolTip(with_shortcut(choice.hint, choice.shortcut));
  box->setFocusPolicy(Qt::TabFocus);
  for (const char* word : choice.words) box->addItem(word);
  box->setSizeAdjustPolicy(QComboBox::AdjustToMinimumContentsLengthWithIcon);
  box->setMinimumContentsLength(8);  // the longest word would widen the panel; the list below shows it whole
  box->view()->setTextElideMode(Qt::ElideNone);
  connect(box, &QComboBox::activated, this, [this, &choice](int index) { set(choice, index); });
  refresh_.push_back([this, box, &choice] { box->setCurrentIndex(choice.value(settings_)); });
  return box;
}

QWidget* ViewPanel::field(const Toggle& toggle) {
  auto* box = new QCheckBox(toggle.name, this);
  box->setAccessibleDescription(toggle.hint);
  box->setToolTip(with_shortcut(toggle.hint, toggle.shortcut));
  box->setFocusPolicy(Qt::TabFocus);
  connect(box, &QCheckBox::clicked, this, [this, &toggle](bool on) { set(toggle, on); });
  refresh_.push_back([this, box, &toggle] {
    box->setChecked(toggle.value(settings_));
    box->setEnabled(toggle.usable(settings_));
  });
  return box;
}

void ViewPanel::show_settings(const Settings& settings) {
  settings_ = settings;
  for (const auto& refresh : refresh_) refresh();
}

}  // namespace forest::studio
