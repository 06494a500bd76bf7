// SPDX-License-Identifier: Apache-2.0
#pragma once

class QApplication;

namespace forest::studio {

/// A dark, calm instrument: nothing around the picture is brighter than it.
void apply_theme(QApplication& application);

}  // namespace forest::studio
