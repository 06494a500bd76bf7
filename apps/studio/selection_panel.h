// SPDX-License-Identifier: Apache-2.0
// What is known of the selected branch, one fact a row.
#pragma once

#include <QStackedWidget>
#include <vector>

#include "apps/studio/selection.h"

class QTableWidget;

namespace forest::studio {

class SelectionPanel final : public QStackedWidget {
 public:
  /// @param word  shown while nothing is selected: how something is, or why nothing can be
  explicit SelectionPanel(const QString& word, QWidget* parent = nullptr);
  /// None: shows that word.
  void show_facts(const std::vector<Fact>& facts);

 private:
  QTableWidget* table_;
};

}  // namespace forest::studio
