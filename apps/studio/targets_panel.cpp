// SPDX-License-Identifier: Apache-2.0
#include "apps/studio/targets_panel.h"

#include <QAction>
#include <QCheckBox>
#include <QColorDialog>
#include <QComboBox>
#include <QGridLayout>
#include <QHeaderView>
#include <QKeyEvent>
#include <QLabel>
#include <QLineEdit>
#include <QMouseEvent>
#include <QPainter>
#include <QShortcut>
#include <QSignalBlocker>
#include <QSpinBox>
#include <QTreeWidget>
#include <QVBoxLayout>
#include <algorithm>
#include <cmath>

#include "apps/studio/annotation.h"

namespace forest::studio {
namespace {

constexpr int rows_seen = 6;  // at least, without scrolling

// A dot, or of several colours a strip; of none an empty place, so that rows stay as they are.
QIcon swatch(const std::vector<QColor>& colours) {
  QPixmap picture(24, 24);
  picture.fill(Qt::transparent);
  QPainter painter(&picture);
  painter.setRenderHint(QPainter::Antialiasing);
  painter.setPen(Qt::NoPen);
  const qreal width = 20. / std::max(1., qreal(colours.size()));
  for (std::size_t i = 0; i < colours.size(); ++i) {
    painter.setBrush(colours[i]);
    if (colours.size() == 1)
      painter.drawEllipse(4, 4, 16, 16);
    else
      painter.drawRect(QRectF(2. + width * qreal(i), 6., width, 12.));
  }
  return QIcon(picture);
}
QIcon swatch(const std::vector<Vec3>& colours) {
  std::vector<QColor> seen;
  for (const Vec3& colour : colours) seen.push_back(to_screen(colour));
  return swatch(seen);
}

// Space ticks the box of a row, whatever else it does in the window.
class KeepsSpace final : public QObject {
 public:
  using QObject::QObject;
  bool eventFilter(QObject*, QEvent* event) override {
    if (event->type() != QEvent::ShortcutOverride || static_cast<QKeyEvent*>(event)->key() != Qt::Key_Space)
      return false;
    event->accept();
    return true;
  }
};

Qt::CheckState check_of(TargetRow::Seen seen) {
  return seen == TargetRow::Seen::all    ? Qt::Checked
         : seen == TargetRow::Seen::some ? Qt::PartiallyChecked
                                         : Qt::Unchecked;
}

// A control with its name, hint and key.
template <class Control>
Control* named(Control* control, const char* name, const char* hint, const char* key) {
  control->setAccessibleName(name);
  control->setAccessibleDescription(hint);
  control->setToolTip(QString("%1 (%2)").arg(hint, QKeySequence(key).toString(QKeySequence::NativeText)));
  QObject::connect(new QShortcut(QKeySequence(key), control), &QShortcut::activated, control,
                   [control] { control->setFocus(Qt::ShortcutFocusReason); });
  return control;
}

}  // namespace

TargetsPanel::TargetsPanel(Changes changes, QWidget* parent) : QWidget(parent), changes_(std::move(changes)) {
  setAccessibleName(tr("Targets"));
  auto* column = new QVBoxLayout(this);
  column->setContentsMargins(6, 6, 6, 8);
  column->setSpacing(4);

  list_ =
      named(new QTreeWidget(this), "Targets",
            "Sets of neurons: the box shows or hides one, Space does so too; Alt and a click shows one alone",
            "Alt+T");
  list_->installEventFilter(new KeepsSpace(list_));
  list_->setColumnCount(2);
  list_->setHeaderHidden(true);
  list_->setRootIsDecorated(false);
  list_->setIndentation(0);
  list_->setFrameShape(QFrame::NoFrame);
  list_->setUniformRowHeights(true);
  list_->setAlternatingRowColors(true);
  list_->setMinimumHeight(rows_seen * (fontMetrics().height() + 6));
  list_->header()->setStretchLastSection(false);
  list_->header()->setSectionResizeMode(0, QHeaderView::Stretch);
  list_->header()->setSectionResizeMode(1, QHeaderView::ResizeToContents);
  list_->viewport()->installEventFilter(this);
  list_->setContextMenuPolicy(Qt::ActionsContextMenu);
  const auto act = [this](const QString& name, const char* key, const std::function<void()>& run) {
    auto* action = new QAction(name, list_);
    action->setShortcut(QKeySequence(key));
    action->setShortcutContext(Qt::WidgetShortcut);
    connect(action, &QAction::triggered, this, run);
    list_->addAction(action);
  };
  act(tr("Only this"), "Ctrl+Return", [this] { show_only_chosen(); });
  act(tr("Show all again"), "Ctrl+Shift+Return", [this] { changes_.show_all(); });
  column->addWidget(list_, 1);
  connect(list_, &QTreeWidget::itemChanged, this, [this](QTreeWidgetItem* item, int) {
    if (quiet_) return;
    list_->setCurrentItem(item);
    scene::Appearance what;
    what.visible = item->checkState(0) == Qt::Checked;
    say(what);
  });
  connect(list_, &QTreeWidget::currentItemChanged, this, [this] {
    if (!quiet_) show_chosen();
  });

  expression_ = named(new QLineEdit(this), "Another target",
                      "Names joined by and, or, not: L5 and not inhibitory", "Alt+N");
  expression_->setPlaceholderText(tr("Another: L5 and not inhibitory"));
  expression_->setClearButtonEnabled(true);
  column->addWidget(expression_);
  problem_ = new QLabel(this);
  problem_->setObjectName("hint");
  problem_->setWordWrap(true);
  problem_->hide();
  column->addWidget(problem_);
  connect(expression_, &QLineEdit::returnPressed, this, [this] {
    const QString expression = expression_->text().trimmed(), problem = changes_.add(expression);
    problem_->setText(problem);
    problem_->setVisible(!problem.isEmpty());
    if (!problem.isEmpty()) return;
    expression_->clear();
    // What is said next, colour or kind, is meant of it.
    const auto row = std::ranges::find_if(rows_, [name = expression.toStdString()](const TargetRow& r) {
      return !r.who.branch && r.who.name == name;
    });
    if (row != rows_.end()) list_->setCurrentItem(list_->topLevelItem(int(row - rows_.begin())));
    list_->setFocus();
  });

  auto* form = new QGridLayout;
  form->setContentsMargins(4, 4, 4, 0);
  form->setSpacing(4);
  form->setColumnStretch(1, 1);
  colour_ = named(new QComboBox(this), "Colour of the target", "One colour, or what colours mean", "Alt+C");
  for (const TargetColour& colour : target_colours())
    colour_->addItem(colour.rgb ? swatch(std::vector{QColor::fromRgb(*colour.rgb)}) : QIcon(), colour.name);
  colour_->addItem(tr("Another…"));
  connect(colour_, &QComboBox::activated, this, [this](int index) {
    scene::Appearance what;
    if (std::size_t(index) < target_colours().size()) {
      what.colour = target_colours()[std::size_t(index)].rgb;
      what.colour_by = target_colours()[std::size_t(index)].by;
      return say(what, what.colour || what.colour_by);
    }
    const QColor chosen_colour = QColorDialog::getColor(Qt::white, this, tr("Colour of the target"),
                                                        QColorDialog::DontUseNativeDialog);
    if (!chosen_colour.isValid()) return;
    what.colour = chosen_colour.rgb() & 0xffffffu;
    say(what);
  });
  form->addWidget(new QLabel(tr("Colour"), this), 0, 0);
  form->addWidget(colour_, 0, 1);

  kind_ = named(new QComboBox(this), "Kind of the target", "What its neurons are drawn with", "Alt+K");
  for (const char* word : kind_words()) kind_->addItem(word);
  connect(kind_, &QComboBox::activated, this, [this](int index) {
    scene::Appearance what;
    what.kind = frame::Kind(index);
    say(what);
  });
  form->addWidget(new QLabel(tr("Drawn"), this), 1, 0);
  form->addWidget(kind_, 1, 1);

  opacity_ = named(new QSpinBox(this), "Opacity of the target (%)",
                   "100 hides what lies behind, 0 shows nothing of it", "Alt+Q");
  opacity_->setSingleStep(10);
  opacity_->setSuffix(" %");
  opacity_->setKeyboardTracking(false);
  connect(opacity_, &QSpinBox::valueChanged, this, [this](int percent) {
    scene::Appearance what;
    what.opacity = float(percent) / 100.f;
    say(what);
  });
  form->addWidget(new QLabel(tr("Opacity"), this), 1, 2);
  form->addWidget(opacity_, 1, 3);

  simulated_ = new QCheckBox(tr("Simulated"), this);
  QSizePolicy keeps_place = simulated_->sizePolicy();
  keeps_place.setRetainSizeWhenHidden(true);
  simulated_->setSizePolicy(keeps_place);
  simulated_->setToolTip(tr("Whether it shows the simulation, where one plays"));
  connect(simulated_, &QCheckBox::clicked, this, [this](bool on) {
    scene::Appearance what;
    what.simulated = on;
    say(what);
  });
  form->addWidget(simulated_, 0, 2, 1, 2);
  column->addLayout(form);
  show_chosen();
}

// Alt and a click: that row alone, whatever part of it is met.
bool TargetsPanel::eventFilter(QObject* of, QEvent* event) {
  const auto type = event->type();
  if (type != QEvent::MouseButtonPress && type != QEvent::MouseButtonRelease)
    return QWidget::eventFilter(of, event);
  const auto* mouse = static_cast<QMouseEvent*>(event);
  if (mouse->button() != Qt::LeftButton || !(mouse->modifiers() & Qt::AltModifier))
    return QWidget::eventFilter(of, event);
  if (QTreeWidgetItem* item = list_->itemAt(mouse->position().toPoint());
      item && type == QEvent::MouseButtonPress) {
    list_->setCurrentItem(item);
    show_only_chosen();
  }
  return true;
}

void TargetsPanel::show_only_chosen() {
  if (const TargetRow* row = chosen(); row && row->problem.empty() && row->count)
    changes_.only(rows_.back().who, scene::Appearance(row->who));  // the last row is that of all
}

const TargetRow* TargetsPanel::chosen() const {
  const int row = list_->indexOfTopLevelItem(list_->currentItem());
  return row >= 0 && std::size_t(row) < rows_.size() ? &rows_[std::size_t(row)] : nullptr;
}

void TargetsPanel::say(const scene::Appearance& what, bool own_colour) {
  if (const TargetRow* row = chosen(); row && row->problem.empty())
    changes_.change(scene::Appearance(row->who), what, own_colour);
}

void TargetsPanel::show_rows(std::vector<TargetRow> rows) {
  const std::optional<scene::Appearance> before = chosen() ? std::optional(chosen()->who) : std::nullopt;
  quiet_ = true;
  rows_ = std::move(rows);
  while (list_->topLevelItemCount() > int(rows_.size()))
    delete list_->takeTopLevelItem(list_->topLevelItemCount() - 1);
  while (list_->topLevelItemCount() < int(rows_.size())) list_->addTopLevelItem(new QTreeWidgetItem);
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const TargetRow& row = rows_[i];
    QTreeWidgetItem* item = list_->topLevelItem(int(i));
    item->setText(0, QString::fromStdString(row.title));
    item->setToolTip(
        0, QString::fromStdString(row.problem.empty() ? row.title + ": " + row.origin : row.problem));
    item->setText(1, row.problem.empty() ? QLocale().toString(qulonglong(row.count)) : "?");
    item->setTextAlignment(1, Qt::AlignRight | Qt::AlignVCenter);
    item->setForeground(1, QColor(140, 153, 172));
    item->setIcon(0, swatch(row.colours));
    item->setFlags(row.problem.empty() && row.count
                       ? Qt::ItemIsEnabled | Qt::ItemIsSelectable | Qt::ItemIsUserCheckable
                       : Qt::ItemIsSelectable);
    item->setCheckState(0, check_of(row.seen));
    if (before && row.who == *before) list_->setCurrentItem(item);
  }
  quiet_ = false;
  show_chosen();
}

void TargetsPanel::rest(const QString& word) {
  setEnabled(false);
  problem_->setText(word);
  problem_->show();
}

void TargetsPanel::show_chosen() {
  const TargetRow* row = chosen();
  const bool usable = row && row->problem.empty() && row->count;
  for (QWidget* control : {static_cast<QWidget*>(colour_), static_cast<QWidget*>(kind_),
                           static_cast<QWidget*>(opacity_), static_cast<QWidget*>(simulated_)})
    control->setEnabled(usable);
  const QSignalBlocker quiet_opacity(opacity_);
  // Of no target nothing is said: less than the least is shown as no number, and the box keeps its place.
  simulated_->setVisible(usable);
  opacity_->setRange(usable ? 0 : -1, 100);
  opacity_->setSpecialValueText(usable ? QString() : QString(" "));
  if (!usable) {
    opacity_->setValue(-1);
    colour_->setCurrentIndex(-1);
    kind_->setCurrentIndex(-1);
    return;
  }
  kind_->setCurrentIndex(int(row->kind));
  opacity_->setValue(int(std::lround(100.f * row->opacity)));
  simulated_->setChecked(row->simulated);
  const QColor seen = row->colours.size() == 1 ? to_screen(row->colours.front()) : QColor();
  int word = 0;
  for (std::size_t i = 0; i < target_colours().size(); ++i)
    if (const auto& rgb = target_colours()[i].rgb;
        rgb && seen.isValid() && QColor::fromRgb(*rgb).rgb() == seen.rgb())
      word = int(i);
  colour_->setCurrentIndex(word);
}

}  // namespace forest::studio
