// SPDX-License-Identifier: Apache-2.0
// A report for people: one HTML file that needs no network, with its plots in it.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace forest::cli {

/// A text as HTML shows it.
std::string escaped_html(std::string_view text);

class Report {
 public:
  /// @param answer  the sentence that the report is about
  Report(std::string_view title, std::string_view answer);

  void heading(std::string_view text);
  void text(std::string_view paragraph);
  void folded(std::string_view title, std::string_view paragraph);  // seen when one asks for it
  /// Numbers to be read at a glance: {"AUC", "0.97"}.
  void figures(const std::vector<std::pair<std::string, std::string>>& values);
  void plot(std::string_view svg, std::string_view caption);
  /// @param rows  of words; a row of a checklist may begin with "✓" or "✗"
  void table(const std::vector<std::string>& header, const std::vector<std::vector<std::string>>& rows);

  std::string html() const;

 private:
  std::string title_, body_;
};

}  // namespace forest::cli
