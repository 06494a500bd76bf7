// SPDX-License-Identifier: Apache-2.0
// Everything that can be set, as a panel made from the tables of settings.h.
#pragma once

#include <QWidget>
#include <functional>
#include <vector>

#include "apps/studio/settings.h"

namespace forest::studio {

class ViewPanel final : public QWidget {
 public:
  ViewPanel(const Settings& settings, Change change, QWidget* parent = nullptr);
  /// Shows `settings`, telling nobody.
  void show_settings(const Settings& settings);

 private:
  QWidget* field(const Number& number);
  QWidget* field(const Choice& choice);
  QWidget* field(const Toggle& toggle);
  template <class Row, class Value>
  void set(const Row& row, Value value);

  Settings settings_;  // that are shown
  Change change_;
  std::vector<std::function<void()>> refresh_;  // one a control: shows its value
};

}  // namespace forest::studio
