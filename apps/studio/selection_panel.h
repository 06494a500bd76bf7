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
  explicit SelectionPanel(QWidget* parent = nullptr);
  /// None: says how to select something.
  void show_facts(const std::vector<Fact>& facts);

 private:
  QTableWidget* table_;
};

}  // namespace forest::studio
