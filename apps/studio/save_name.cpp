// SPDX-License-Identifier: Apache-2.0
#include "apps/studio/save_name.h"

#include <QFileDialog>
#include <QFileInfo>
#include <QMessageBox>

namespace forest::studio {

std::optional<QString> save_name(QWidget* parent, const Saved& what) {
  QFileDialog dialog(parent, what.title, {}, what.filter);
  dialog.setOption(QFileDialog::DontUseNativeDialog);
  dialog.setAcceptMode(QFileDialog::AcceptSave);
  dialog.setDefaultSuffix(what.ending);  // before the dialog asks whether a file shall be replaced
  dialog.selectFile(what.suggestion);
  while (dialog.exec() == QDialog::Accepted && !dialog.selectedFiles().isEmpty()) {
    QString name = dialog.selectedFiles().constFirst();
    if (name.endsWith("." + what.ending, Qt::CaseInsensitive)) return name;
    // A name with another ending, or in a folder with a dot: the dialog leaves it alone, and asked of another file.
    name += "." + what.ending;
    if (!QFileInfo::exists(name) ||
        QMessageBox::warning(
            parent, QObject::tr("Replace the file?"),
            QObject::tr("%1 already exists.\nDo you want to replace it?").arg(QFileInfo(name).fileName()),
            QMessageBox::Yes | QMessageBox::No, QMessageBox::No) == QMessageBox::Yes)
      return name;
  }
  return std::nullopt;
}

}  // namespace forest::studio
