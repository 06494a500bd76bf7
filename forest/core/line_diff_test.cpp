// SPDX-License-Identifier: Apache-2.0
#include "forest/core/line_diff.h"

#include <algorithm>
#include <cstdio>
#include <sstream>
#include <vector>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

namespace forest {
namespace {

/// What `patch` would make of `before`; checks every line that should stand there.
std::string patched(const std::string& before, const std::string& diff) {
  std::vector<std::string> lines;
  for (std::size_t at = 0; at < before.size();) {
    const std::size_t end = std::min(before.find('\n', at), before.size() - 1) + 1;
    lines.push_back(before.substr(at, end - at));
    at = end;
  }
  std::string after, line;
  std::size_t at = 0;
  std::istringstream in(diff);
  std::getline(in, line), std::getline(in, line);
  std::vector<std::pair<char, std::string>> hunk;
  std::size_t first = 0;
  const auto apply = [&] {
    while (at < first) after += lines.at(at++);
    for (const auto& [sign, text] : hunk) {
      if (sign != '+') {
        EXPECT_EQ(lines.at(at++), text);
      }
      if (sign != '-') after += text;
    }
    hunk.clear();
  };
  while (std::getline(in, line)) {
    if (line[0] == '@') {
      apply();
      unsigned long number = 0, count = 1;
      EXPECT_GE(std::sscanf(line.c_str(), "@@ -%lu,%lu", &number, &count), 1);
      first = count ? number - 1 : number;
    } else if (line[0] == '\\') {
      hunk.back().second.pop_back();
    } else {
      hunk.emplace_back(line[0], line.substr(1) + "\n");
    }
  }
  apply();
  while (at < lines.size()) after += lines[at++];
  return after;
}

std::size_t changed(const std::string& diff) {
  std::size_t count = 0;
  std::istringstream in(diff);
  std::string line;
  std::getline(in, line), std::getline(in, line);
  while (std::getline(in, line)) count += line[0] == '+' || line[0] == '-';
  return count;
}

TEST(LineDiff, IsThatOfDiff) {
  const std::string a = "1\n2\n3\n4\n5\n6\n7\n8\n9\n10\n11\n12\n13\n14\n15\n16\n";
  EXPECT_EQ(unified_diff(a, a, "a", "b"), "");
  EXPECT_EQ(
      unified_diff(a, "1\n2\nthree\n4\n5\n6\n7\n8\n9\n10\n11\n12\n13\n14\n15\n16\n17", "a", "b"),
      "--- a\n+++ b\n@@ -1,6 +1,6 @@\n 1\n 2\n-3\n+three\n 4\n 5\n 6\n@@ -14,3 +14,4 @@\n 14\n 15\n 16\n+17\n"
      "\\ No newline at end of file\n");
  EXPECT_EQ(unified_diff("", "x\n", "a", "b"), "--- a\n+++ b\n@@ -0,0 +1 @@\n+x\n");
  EXPECT_EQ(unified_diff("x\n", "", "a", "b"), "--- a\n+++ b\n@@ -1 +0,0 @@\n-x\n");
  EXPECT_EQ(unified_diff("x", "x\n", "a", "b"),
            "--- a\n+++ b\n@@ -1 +1 @@\n-x\n\\ No newline at end of file\n+x\n");
}

RC_GTEST_PROP(LineDiff, LeadsFromOneTextToTheOther, ()) {
  const auto text = [] {
    std::string all;
    for (const int line : *rc::gen::container<std::vector<int>>(rc::gen::inRange(0, 5)))
      all += char('a' + line), all += '\n';
    if (!all.empty() && *rc::gen::arbitrary<bool>()) all.pop_back();
    return all;
  };
  const std::string before = text(), after = text();
  const std::string diff = unified_diff(before, after, "a", "b", *rc::gen::inRange<std::size_t>(0, 4));
  RC_ASSERT(before == after || patched(before, diff) == after);
}

TEST(LineDiff, ChangesAsFewLinesAsCan) {
  EXPECT_EQ(changed(unified_diff("a\nb\nc\na\nb\nb\na\n", "c\nb\na\nb\na\nc\n", "a", "b")),
            5u);  // Myers' own example
}

TEST(LineDiff, IsQuickForLongTextsThatShareNothing) {
  std::string before = "same\n", after = "same\n";
  for (int i = 0; i < 200'000; ++i)
    before += std::to_string(i) + "\n", after += std::to_string(-i - 1) + "\n";
  before += "same\n", after += "same\n";
  EXPECT_EQ(changed(unified_diff(before, after, "a", "b")), 400'000u);
  EXPECT_EQ(patched(before, unified_diff(before, after, "a", "b")), after);
}

}  // namespace
}  // namespace forest
