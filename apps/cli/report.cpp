// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/report.h"

#include <fmt/format.h>

namespace forest::cli {
namespace {

constexpr std::string_view style = R"(
:root { color-scheme: light dark; --page: #fbfaf7; --ink: #22262b; --soft: #6a7077; --line: #ddd8cd; --card: #fff; --yes: #00785a; --no: #c04f00; }
@media (prefers-color-scheme: dark) { :root { --page: #15181c; --ink: #e6e4df; --soft: #9aa0a6; --line: #333940; --card: #1c2026; --yes: #3fc79f; --no: #ff9a4d; } }
body { margin: 0; background: var(--page); color: var(--ink); font: 15px/1.55 "DejaVu Sans", Verdana, system-ui, sans-serif; }
main { max-width: 920px; margin: 0 auto; padding: 40px 24px 80px; }
h1 { font-size: 15px; font-weight: 600; letter-spacing: .06em; text-transform: uppercase; color: var(--soft); margin: 0 0 12px; }
.answer { font-size: 21px; line-height: 1.45; margin: 0 0 28px; }
h2 { font-size: 18px; margin: 44px 0 6px; }
p { margin: 6px 0 14px; max-width: 70ch; }
.figures { display: flex; flex-wrap: wrap; gap: 12px; margin: 0 0 12px; }
.figures div { background: var(--card); border: 1px solid var(--line); border-radius: 10px; padding: 10px 16px; min-width: 110px; }
.figures b { display: block; font-size: 22px; font-weight: 600; }
.figures span { color: var(--soft); font-size: 12.5px; }
figure { margin: 14px 0 26px; background: var(--card); border: 1px solid var(--line); border-radius: 10px; padding: 14px 14px 8px; }
figure svg { display: block; width: 100%; height: auto; }
figcaption { color: var(--soft); font-size: 13px; margin: 8px 4px 4px; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; font-size: 13px; font-variant-numeric: tabular-nums; }
th { text-align: left; color: var(--soft); font-weight: 600; border-bottom: 1px solid var(--line); padding: 6px 10px 6px 0; }
td { border-bottom: 1px solid var(--line); padding: 5px 10px 5px 0; vertical-align: top; }
.yes { color: var(--yes); font-weight: 600; } .no { color: var(--no); font-weight: 600; }
footer { color: var(--soft); font-size: 12.5px; margin-top: 50px; }
@media print { body { background: #fff; } figure { break-inside: avoid; } }
)";

}  // namespace

std::string escaped_html(std::string_view text) {
  std::string out;
  for (const char c : text) switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        if (static_cast<unsigned char>(c) >= ' ' || c == '\n')
          out += c;  // XML knows no other control characters
    }
  return out;
}

Report::Report(std::string_view title, std::string_view answer) : title_(title) {
  body_ = fmt::format("<h1>{}</h1>\n<p class=\"answer\">{}</p>\n", escaped_html(title), escaped_html(answer));
}

void Report::heading(std::string_view text) { body_ += fmt::format("<h2>{}</h2>\n", escaped_html(text)); }

void Report::text(std::string_view paragraph) {
  body_ += fmt::format("<p>{}</p>\n", escaped_html(paragraph));
}

void Report::folded(std::string_view title, std::string_view paragraph) {
  body_ += fmt::format("<details><summary>{}</summary><p>{}</p></details>\n", escaped_html(title),
                       escaped_html(paragraph));
}

void Report::figures(const std::vector<std::pair<std::string, std::string>>& values) {
  body_ += "<div class=\"figures\">";
  for (const auto& [name, value] : values)
    body_ += fmt::format("<div><b>{}</b><span>{}</span></div>", escaped_html(value), escaped_html(name));
  body_ += "</div>\n";
}

void Report::plot(std::string_view svg, std::string_view caption) {
  body_ += fmt::format("<figure>\n{}<figcaption>{}</figcaption></figure>\n", svg, escaped_html(caption));
}

void Report::table(const std::vector<std::string>& header,
                   const std::vector<std::vector<std::string>>& rows) {
  body_ += "<div class=\"wide\"><table><tr>";
  for (const std::string& cell : header) body_ += fmt::format("<th>{}</th>", escaped_html(cell));
  body_ += "</tr>\n";
  for (const auto& row : rows) {
    body_ += "<tr>";
    for (const std::string& cell : row) {
      const char* mark = cell == "✓" ? " class=\"yes\"" : cell == "✗" ? " class=\"no\"" : "";
      body_ += fmt::format("<td{}>{}</td>", mark, escaped_html(cell));
    }
    body_ += "</tr>\n";
  }
  body_ += "</table></div>\n";
}

std::string Report::html() const {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width, "
      "initial-scale=1\">\n<title>{}</title>\n<style>{}</style></head>\n<body><main>\n{}"
      "<footer>Brain Forest {}. This file is complete: it loads nothing.</footer>\n</main></body></html>\n",
      escaped_html(title_), style, body_, FOREST_VERSION);
}

}  // namespace forest::cli
