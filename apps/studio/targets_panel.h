// SPDX-License-Identifier: Apache-2.0
// The targets of the forest: an eye for each, and below them how the chosen one is shown.
#pragma once

#include <QWidget>
#include <functional>
#include <vector>

#include "apps/studio/target_list.h"

class QCheckBox;
class QComboBox;
class QLabel;
class QLineEdit;
class QSpinBox;
class QTreeWidget;

namespace forest::studio {

class TargetsPanel final : public QWidget {
 public:
  struct Changes {
    /// A person wants a target shown so.
    std::function<void(const scene::Appearance& who, const scene::Appearance& what, bool own_colour)> change;
    /// A person names a new one; returns a sentence when there is none.
    std::function<QString(const QString& expression)> add;
    /// A person wants one alone, and nothing else of `all`.
    std::function<void(const scene::Appearance& all, const scene::Appearance& who)> only;
    /// A person wants to see everything again.
    std::function<void()> show_all;
  };
  explicit TargetsPanel(Changes changes, QWidget* parent = nullptr);
  /// Shows them, telling nobody. The row that is chosen stays so.
  void show_rows(std::vector<TargetRow> rows);
  /// There are no neurons: nothing can be done here, and the word says why.
  void rest(const QString& word);

 private:
  bool eventFilter(QObject* of, QEvent* event) override;
  const TargetRow* chosen() const;
  void show_only_chosen();
  void show_chosen();
  void say(const scene::Appearance& what, bool own_colour = true);

  Changes changes_;
  std::vector<TargetRow> rows_;
  bool quiet_ = false;  // while rows are shown
  QTreeWidget* list_;
  QLineEdit* expression_;
  QLabel* problem_;
  QComboBox *colour_, *kind_;
  QSpinBox* opacity_;
  QCheckBox* simulated_;
};

}  // namespace forest::studio
