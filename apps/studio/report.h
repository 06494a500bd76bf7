// SPDX-License-Identifier: Apache-2.0
// --report: what happens in the window as lines of JSON on standard output, for scripts that listen.
#pragma once

namespace forest::studio {

class Window;

/// {"event": "selected" | "clamped" | "settled", …}; docs/studio/studio.md has the keys of each.
void report(Window& window);

}  // namespace forest::studio
