// SPDX-License-Identifier: Apache-2.0
#include "forest/repository/names.h"

#include <set>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

namespace forest::repository {
namespace {

using namespace std::string_literals;

RC_GTEST_PROP(Names, EscapingLosesNothing, (const std::string& bytes)) {
  RC_ASSERT(unescaped(escaped(bytes)) == bytes);
}

RC_GTEST_PROP(Names, EscapingLinesLosesNothing, ()) {
  const auto bytes = *rc::gen::container<std::string>(rc::gen::oneOf(
      rc::gen::arbitrary<char>(), rc::gen::element('\\', 'x', '4', 'A', '\n', '\t', '(', '\xc3', '\xa9')));
  const std::string text = escaped_lines(bytes);
  RC_ASSERT(unescaped(text) == bytes);
  std::string line = text;
  for (char& c : line)
    if (c == '\n' || c == '\r' || c == '\t') c = ' ';
  RC_ASSERT(line.empty() || line.size() > max_name || is_name(line));
}

RC_GTEST_PROP(Names, EscapedBytesAreAName, (const std::string& bytes)) {
  RC_PRE(!bytes.empty());
  RC_ASSERT(is_name(escaped(bytes)));
}

RC_GTEST_PROP(Names, DifferentNamesAreDifferentFiles, (const std::string& a, const std::string& b)) {
  RC_PRE(a != b);
  RC_ASSERT(file_name(a) != file_name(b));
}

RC_GTEST_PROP(Names, AFileNameStaysInItsFolder, (const std::string& name)) {
  const std::string file = file_name(name);
  RC_ASSERT(!file.empty() && file.size() <= 200u && file.find('/') == file.npos && file[0] != '.' &&
            file[0] != '-');
  RC_ASSERT(is_name(file));
}

TEST(Names, Utf8IsWellFormedOrRefused) {
  for (const auto& good :
       {"a"s, "μ"s, "神"s, "\U0001f333"s, "\xf4\x8f\xbf\xbf"s, "\xed\x9f\xbf"s, "\xef\xbf\xbf"s})
    EXPECT_TRUE(is_name(good)) << good;
  for (const auto& bad : {"\x80"s, "\xc0\xaf"s, "\xc1\xbf"s, "\xe0\x9f\xbf"s, "\xed\xa0\x80"s,
                          "\xf0\x8f\xbf\xbf"s, "\xf4\x90\x80\x80"s, "\xf5\x80\x80\x80"s, "\xff"s, "\xe7\xa5"s,
                          "a\xe7"s, "\xc2\x85"s, "\x7f"s, "\t"s, ""s})
    EXPECT_FALSE(is_name(bad)) << escaped(bad);
}

TEST(Names, APersonCanReadWhatIsEscaped) {
  EXPECT_EQ(escaped("caf\xe9"), "caf\\xE9");
  EXPECT_EQ(escaped("naïve"), "naïve");
  EXPECT_EQ(escaped("a\\b\n"), "a\\\\b\\x0A");
  EXPECT_EQ(escaped_lines("F(1) \\(90)\n\tμ: \xb5\r\n"), "F(1) \\(90)\n\tμ: \\xB5\r\n");
  EXPECT_EQ(file_name("a/b"), "a%2Fb");
  EXPECT_EQ(file_name("cell 7 (left)"), "cell 7 (left)");
  EXPECT_EQ(file_name(".."), "%2E.");
}

TEST(Names, LongNamesMakeDifferentShortFiles) {
  std::set<std::string> files;
  for (std::size_t n = 190; n <= 1000; ++n) files.insert(file_name(std::string(n, 'x')));
  for (std::size_t n = 60; n <= 330; ++n) {
    std::string name;
    for (std::size_t i = 0; i < n; ++i) name += "神";
    files.insert(file_name(name));
    EXPECT_TRUE(is_name(file_name(name)));
  }
  EXPECT_EQ(files.size(), 811u + 271u);
}

}  // namespace
}  // namespace forest::repository
