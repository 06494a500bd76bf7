// SPDX-License-Identifier: Apache-2.0
// Where a person wants something saved.
#pragma once

#include <QString>
#include <optional>

class QWidget;

namespace forest::studio {

/// What is saved: the title of the dialog, a name to begin with, the ending that every such file has.
struct Saved {
  QString title, suggestion, ending, filter;  // "Save picture", "forest.png", "png", "Pictures (*.png)"
};

/// Asks for the name of a file, which has the ending when it comes back: whatever lies under that very name is replaced only
/// when the person says so. None: nothing shall be saved.
std::optional<QString> save_name(QWidget* parent, const Saved& what);

}  // namespace forest::studio
