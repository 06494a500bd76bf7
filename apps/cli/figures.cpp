// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/figures.h"

#include <utility>

#include "apps/cli/console.h"

namespace forest::cli {

void print(std::vector<Figure> figures, Console& console) {
  nlohmann::ordered_json json;
  std::vector<std::vector<std::string>> rows;
  for (Figure& f : figures) {
    if (f.key) json[f.key] = std::move(f.value);
    if (f.label) rows.push_back({f.label, f.shown, f.what});
  }
  console.print(json);
  console.table({"measure", "value", "what it is"}, rows);
}

}  // namespace forest::cli
