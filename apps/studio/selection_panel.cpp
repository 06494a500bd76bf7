// SPDX-License-Identifier: Apache-2.0
#include "apps/studio/selection_panel.h"

#include <QHeaderView>
#include <QLabel>
#include <QTableWidget>

namespace forest::studio {

SelectionPanel::SelectionPanel(const QString& word, QWidget* parent)
    : QStackedWidget(parent), table_(new QTableWidget(this)) {
  auto* hint = new QLabel(word, this);
  hint->setObjectName("hint");
  hint->setAlignment(Qt::AlignCenter);
  hint->setWordWrap(true);
  addWidget(hint);

  table_->setColumnCount(3);
  table_->setAccessibleName(tr("Selection"));
  table_->setAccessibleDescription(tr("Facts of the selected branch: name, value and unit"));
  table_->horizontalHeader()->hide();
  table_->verticalHeader()->hide();
  table_->setShowGrid(false);
  table_->setAlternatingRowColors(true);
  table_->setEditTriggers(QAbstractItemView::NoEditTriggers);
  table_->setFocusPolicy(Qt::TabFocus);
  table_->setFrameShape(QFrame::NoFrame);
  table_->horizontalHeader()->setSectionResizeMode(0, QHeaderView::ResizeToContents);
  table_->horizontalHeader()->setSectionResizeMode(1, QHeaderView::Stretch);
  table_->horizontalHeader()->setSectionResizeMode(2, QHeaderView::ResizeToContents);
  table_->verticalHeader()->setDefaultSectionSize(21);
  addWidget(table_);
}

void SelectionPanel::show_facts(const std::vector<Fact>& facts) {
  table_->setRowCount(int(facts.size()));
  for (int row = 0; row < int(facts.size()); ++row) {
    const Fact& fact = facts[std::size_t(row)];
    const QString texts[] = {fact.name, QString::fromStdString(fact.value), fact.unit};
    for (int column = 0; column < 3; ++column) {
      auto* item = new QTableWidgetItem(texts[column]);
      item->setToolTip(fact.hint);
      if (column == 1) item->setTextAlignment(Qt::AlignRight | Qt::AlignVCenter);
      if (column != 1) item->setForeground(QColor(140, 153, 172));
      table_->setItem(row, column, item);
    }
  }
  setCurrentIndex(facts.empty() ? 0 : 1);
}

}  // namespace forest::studio
