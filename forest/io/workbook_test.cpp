// SPDX-License-Identifier: Apache-2.0
#include "forest/io/workbook.h"

#include <cmath>
#include <csignal>
#include <filesystem>
#include <unistd.h>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include "forest/core/error.h"
#include "forest/core/file.h"

#include "tests/zip.h"

namespace forest::io {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using Kind = ReadCell::Kind;
namespace fs = std::filesystem;

std::string sheet_xml(const std::string& rows) {
  return "<?xml version=\"1.0\"?>\n<worksheet xmlns=\"http://x\"><sheetData>" + rows +
         "</sheetData><rowBreaks count=\"0\"/></worksheet>\n";
}

ReadWorkbook read_sheet(const std::string& rows, const std::string& texts = "<sst/>") {
  return read_workbook(zip_of(workbook_parts(sheet_xml(rows), texts)), "book.xlsx");
}

std::string message(const std::string& bytes) {
  try {
    read_workbook(bytes, "book.xlsx");
  } catch (const InputError& error) {
    EXPECT_EQ(error.file(), "book.xlsx");
    return error.what();
  }
  return "no error";
}

std::string refused(const std::string& rows, const std::string& texts = "<sst/>") {
  return message(zip_of(workbook_parts(sheet_xml(rows), texts)));
}

const std::string header = R"(<row r="1"><c r="A1" t="inlineStr"><is><t>id</t></is></c></row>)";

TEST(Workbook, WhatIsWrittenIsRead) {
  const std::string long_text(40000, 'x'), odd = "α, \"<&>\" _x0041_ \x01 \t end ";
  Workbook book;
  book.sheets.push_back({"neurons", {{"id", ""}, {"name", "", true}, {"x", "µm", true}}, {}});
  book.sheets[0].rows = {{std::int64_t(7), odd, 0.1},
                         {std::int64_t(-3), std::string(), std::nan("")},
                         {{}, {}, {}},
                         {std::int64_t(8), long_text, -1.25e-30}};
  const fs::path file = fs::temp_directory_path() / fmt::format("forest-workbook-test-{}.xlsx", ::getpid());
  write_workbook(file, book);
  const ReadWorkbook read = read_workbook(MappedFile(file).text(), file.string());
  fs::remove(file);
  ASSERT_EQ(read.sheets.size(), 1u);
  const ReadSheet& sheet = *read.find("neurons");
  EXPECT_THAT(sheet.header, ElementsAre("id", "name", "x (µm)"));
  EXPECT_THAT(sheet.rows, ElementsAre(2u, 3u, 5u));
  EXPECT_EQ(sheet.cell(0, 0).number, 7.);
  EXPECT_EQ(sheet.cell(0, 1).text, odd);
  EXPECT_EQ(sheet.cell(0, 2).number, 0.1);
  EXPECT_EQ(sheet.cell(1, 1).kind, Kind::empty);
  EXPECT_EQ(sheet.cell(1, 2).kind, Kind::empty);
  EXPECT_EQ(sheet.cell(2, 1).text, cell_text(long_text));
  EXPECT_EQ(sheet.cell(2, 2).number, -1.25e-30);
  EXPECT_EQ(sheet.place(2, 2), "neurons!C5");
  EXPECT_EQ(read.find("points"), nullptr);
}

TEST(Workbook, OddTextsAreReadAsTheyWereWrittenOrAsTheirBeginning) {
  using namespace std::string_literals;
  std::string codes;
  while (codes.size() < 30000) codes += "_x0041_";
  Workbook book;
  book.sheets.push_back({"texts", {{"text", ""}}, {}});
  const std::vector<std::string> texts{"<r>no markup</r>", "<r>", "before\0after"s, codes,
                                       "a\r\nb\tc",        " \n "};
  for (const std::string& text : texts) book.sheets[0].rows.push_back({text});
  const fs::path file = fs::temp_directory_path() / fmt::format("forest-workbook-odd-{}.xlsx", ::getpid());
  write_workbook(file, book);
  const ReadWorkbook read = read_workbook(MappedFile(file).text(), file.string());
  fs::remove(file);
  ASSERT_EQ(read.sheets.at(0).rows.size(), texts.size());
  for (std::size_t i = 0; i < texts.size(); ++i) {
    const std::string_view is = read.sheets[0].cell(i, 0).text;
    EXPECT_EQ(is, cell_text(texts[i])) << i;
    EXPECT_TRUE(!is.empty() && texts[i].starts_with(is)) << i;
  }
}

/// However far each file can grow on the way, the workbook is whole or it is not there and a sentence says so.
TEST(Workbook, OnAFullDiskItIsRefusedAndNotCut) {
  Workbook book;
  book.sheets.push_back({"points", {{"x", "µm"}, {"note", ""}}, {}});
  for (int i = 0; i < 4000; ++i) book.sheets[0].rows.push_back({i / 7., fmt::format("point {}", i)});
  book.charts.push_back({.title = "x", .x_title = "", .y_title = "", .sheet = 0, .x_column = 0, .count = 4});
  const fs::path file = fs::temp_directory_path() / fmt::format("forest-workbook-full-{}.xlsx", ::getpid());
  write_workbook(file, book);
  const std::uintmax_t whole = fs::file_size(file);
  const auto with_room = [&](std::uintmax_t bytes) {
    const pid_t child = ::fork();
    if (child == 0) {
      std::signal(SIGXFSZ, SIG_IGN);
      const rlimit limit{bytes, bytes};
      ::setrlimit(RLIMIT_FSIZE, &limit);
      try {
        write_workbook(file, book);
      } catch (const Error& error) {
        ::_exit(std::string_view(error.what()).find("room") == std::string_view::npos ? 2 : 1);
      }
      ::_exit(0);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  };
  std::size_t refused = 0, written = 0;
  for (std::uintmax_t room = 0; room < 16 * whole; room += whole / 4) {
    fs::remove(file);
    const int status = with_room(room);
    ASSERT_TRUE(status == 0 || status == 1) << room << ": " << status;
    ASSERT_EQ(fs::exists(file), status == 0) << room;
    if (status == 0) {
      EXPECT_EQ(fs::file_size(file), whole) << room;
    }
    ++(status ? refused : written);
  }
  EXPECT_GT(refused, 8u) << "else this has tested nothing: a sheet takes more room than the packed workbook";
  EXPECT_GT(written, 0u);
  fs::remove(file);
}

TEST(Workbook, EveryFloatComesBackExactly) {
  Workbook book;
  book.sheets.push_back({"points", {{"x", "µm"}}, {}});
  std::vector<float> values;
  for (std::uint32_t i = 1; i < 2000; ++i)
    values.push_back(std::ldexp(float(i * 2654435761u), int(i % 200) - 130));
  for (const float v : values) book.sheets[0].rows.push_back({double(v)});
  const fs::path file = fs::temp_directory_path() / fmt::format("forest-workbook-floats-{}.xlsx", ::getpid());
  write_workbook(file, book);
  const ReadWorkbook read = read_workbook(MappedFile(file).text(), file.string());
  fs::remove(file);
  for (std::size_t i = 0; i < values.size(); ++i)
    ASSERT_EQ(float(read.sheets[0].cell(i, 0).number), values[i]) << i;
}

TEST(Workbook, ReadsWhatEachProgramWrites) {
  const ReadWorkbook book = read_sheet(
      R"(<row><c t="s"><v>0</v></c><c t="s"><v>1</v></c></row>)"  // no references, as in some libraries
      R"(<row r="3" spans="1:2"><c r="A3" s="1"><v> 1.5E+1 </v></c><c r="B3" t="b"><v>1</v></c><c r="C3"><v>9</v></c></row>)"
      R"(<row r="4"><c r="A4"><f>1+1</f><v>2</v></c><c r="B4" t="str"><f>A4</f><v>two</v></c></row>)"
      R"(<row r="5"><c r="A5"><f>SUM(A3)</f><v></v></c><c r="B5" t="e"><v>#DIV/0!</v></c></row>)"
      R"(<row r="6"><c r="A6" t="inlineStr"><is><t xml:space="preserve"> in </t></is></c><c r="B6"><v>1e999</v></c></row>)"
      R"(<row r="7"/><row r="8"><c r="A8" s="3"/></row><row r="9"><c r="B9"><v>nan</v></c></row>)"
      R"(<row r="10"><c r="A10" t="s"><v>2</v></c><c r="B10" t="str"><f>B6</f><v/></c></row>)",
      R"(<x:sst xmlns:x="y" count="3"><x:si><x:t> id </x:t></x:si><x:si><x:r><x:rPr/><x:t>na</x:t></x:r><x:r><x:t>me</x:t></x:r><x:rPh><x:t>no</x:t></x:rPh></x:si><x:si><x:t>_x00E9__x005F_x0041_</x:t></x:si></x:sst>)");
  const ReadSheet& s = book.sheets.at(0);
  EXPECT_THAT(s.header, ElementsAre("id", "name"));
  EXPECT_THAT(s.rows, ElementsAre(3u, 4u, 5u, 6u, 9u, 10u));
  const auto is = [&](std::size_t row, std::size_t column, Kind kind, double number, std::string_view text) {
    const ReadCell& cell = s.cell(row, column);
    EXPECT_EQ(cell.kind, kind) << row << " " << column;
    EXPECT_EQ(cell.number, number) << row << " " << column;
    EXPECT_EQ(cell.text, text) << row << " " << column;
  };
  is(0, 0, Kind::number, 15., "");
  is(0, 1, Kind::boolean, 0., "TRUE");
  is(1, 0, Kind::number, 2., "");
  is(1, 1, Kind::text, 0., "two");
  is(2, 0, Kind::formula, 0., "=SUM(A3)");
  is(2, 1, Kind::error, 0., "#DIV/0!");
  is(3, 0, Kind::text, 0., " in ");
  is(3, 1, Kind::error, 0., "1e999");
  is(4, 1, Kind::error, 0., "nan");
  is(5, 0, Kind::text, 0., "é_x0041_");
  is(5, 1, Kind::empty, 0., "");
}

TEST(Workbook, PrefixesQuotesAndPiecesDoNotMatter) {
  std::string rows = header;
  for (int i = 2; i < 20000; ++i)
    rows += fmt::format("<row r=\"{}\" note='a > \"b\"'><c r=\"A{}\"><v>{}</v></c></row>", i, i, i);
  Parts parts = workbook_parts(sheet_xml(rows));
  const ReadWorkbook stored = read_workbook(zip_of(parts), "book.xlsx"),
                     packed = read_workbook(zip_of(parts, true), "book.xlsx");
  for (const ReadWorkbook* book : {&stored, &packed}) {
    ASSERT_EQ(book->sheets.at(0).rows.size(), 19998u);
    for (std::size_t r = 0; r < 19998; ++r) ASSERT_EQ(book->sheets[0].cell(r, 0).number, double(r + 2));
  }
  std::string prefixed = R"(<x:worksheet><x:row r="1"><x:c><x:v>1</x:v></x:c></x:row></x:worksheet>)";
  EXPECT_THAT(read_workbook(zip_of(workbook_parts(prefixed)), "b").sheets.at(0).header, ElementsAre("1"));
  EXPECT_TRUE(read_workbook(zip_of(workbook_parts("<worksheet/>")), "b").sheets.at(0).header.empty());
}

TEST(Workbook, WhatIsNoneIsASentence) {
  EXPECT_THAT(message(""), HasSubstr("is no workbook"));
  EXPECT_THAT(message("id,name\n"), HasSubstr("is no workbook"));
  EXPECT_THAT(message("\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"), HasSubstr("password"));
  EXPECT_THAT(message("PK\x03\x04"), HasSubstr("cut off or damaged"));
  EXPECT_THAT(message(zip_of({{"content.xml", "<a/>"}})), HasSubstr(".ods"));
  EXPECT_THAT(message(zip_of({{"_rels/.rels", "<a>"}})), HasSubstr("no XML"));
  Parts parts = workbook_parts(sheet_xml(header));
  parts[1].second = "<document/>";
  EXPECT_THAT(message(zip_of(parts)), HasSubstr("no workbook"));
  for (std::size_t missing = 0; missing < 4; ++missing) {
    parts = workbook_parts(sheet_xml(header));
    parts.erase(parts.begin() + std::ptrdiff_t(missing));
    EXPECT_NE(message(zip_of(parts)), "no error") << missing;
  }
  parts = workbook_parts(sheet_xml(header));
  parts[1].second =
      R"(<workbook xmlns:r="r"><sheets><sheet name="a" r:id="a"/><sheet name="a" r:id="a"/></sheets></workbook>)";
  EXPECT_THAT(message(zip_of(parts)), HasSubstr("two sheets a"));
  EXPECT_THAT(message(zip_of(workbook_parts("\xff\xfe<\0w"))), HasSubstr("UTF-16"));
  EXPECT_THAT(message(zip_of(workbook_parts("<worksheet><row r=\"1\">"))), HasSubstr("cut off"));
  EXPECT_THAT(message(zip_of(workbook_parts("nothing"))), HasSubstr("cut off"));
}

TEST(Workbook, RowsAndCellsThatAreNotInOrderAreRefused) {
  EXPECT_THAT(refused(header + header), HasSubstr("numbered '1' after row 1"));
  EXPECT_THAT(refused(header + "<row r=\"1048577\"/>"), HasSubstr("numbered '1048577'"));
  EXPECT_THAT(refused(header + "<row r=\"x\"/>"), HasSubstr("numbered 'x'"));
  EXPECT_THAT(refused("<row r=\"1\"><c r=\"B1\"/><c r=\"B1\"/></row>"), HasSubstr("'B1' out of its order"));
  EXPECT_THAT(refused("<row r=\"1\"><c r=\"XFE1\"/></row>"), HasSubstr("'XFE1'"));
  EXPECT_THAT(refused("<row r=\"1\"><c r=\"1\"/></row>"), HasSubstr("'1' out of"));
  EXPECT_THAT(refused(header + "<row r=\"2\"><c r=\"A2\" t=\"s\"><v>0</v></c></row>"),
              HasSubstr("neurons!A2 shows text 0"));
  EXPECT_THAT(refused(header + "<row r=\"2\"><c r=\"A2\" t=\"s\"><v>-1</v></c></row>", "<sst><si/></sst>"),
              HasSubstr("text -1"));
  EXPECT_THAT(refused(header + "<row r=\"2\"><c></row>"), HasSubstr("no XML"));
  EXPECT_THAT(refused(header, "<sst><si>"), HasSubstr("cut off"));
}

TEST(Workbook, CutOffAnywhereOrWithAnyByteChangedItIsReadOrRefused) {
  const std::string whole =
      zip_of(workbook_parts(sheet_xml(header + R"(<row r="2"><c r="A2"><v>3</v></c></row>)")), true);
  ASSERT_EQ(message(whole), "no error");
  for (std::size_t end = 0; end < whole.size(); ++end)
    EXPECT_NE(message(whole.substr(0, end)), "no error") << end;
  for (std::size_t at = 0; at < whole.size(); ++at)
    for (const int change : {1, 64, 255}) {
      std::string bytes = whole;
      bytes[at] = char(bytes[at] ^ change);
      (void)message(bytes);
    }
}

TEST(Workbook, BombsEndAtAStatedLimit) {
  EXPECT_THAT(message(zip_of(workbook_parts(sheet_xml("<row r=\"1\">" + std::string(80u << 20, ' '))), true)),
              HasSubstr("element of over 64 MiB"));
  Parts parts = workbook_parts(sheet_xml(header));
  parts[1].second = std::string(70u << 20, ' ');
  EXPECT_THAT(message(zip_of(parts, true)), HasSubstr("over 64 MiB"));
  std::string wide = R"(<row r="1"><c r="XFD1"><v>1</v></c></row>)";
  for (int i = 2; i < 3000; ++i) wide += fmt::format("<row r=\"{}\"><c><v>1</v></c></row>", i);
  EXPECT_THAT(refused(wide), HasSubstr("million cells"));
  std::string many = "<sst>";
  for (std::uint64_t i = 0; i <= most_texts; ++i) many += "<si/>";
  EXPECT_THAT(refused(header, many + "</sst>"), HasSubstr("million texts"));
}

TEST(Csv, FieldsAreAsInTheRfcAndAsSpreadsheetsWriteThem) {
  ReadWorkbook book;
  read_csv(book, "neurons", "\xef\xbb\xbfid, name \r\n1,\"a \"\"b\"\"\nc\"\r\n\r\n,\r\n2\n3,last",
           "neurons.csv");
  const ReadSheet& s = book.sheets.at(0);
  EXPECT_THAT(s.header, ElementsAre("id", "name"));
  EXPECT_THAT(s.rows, ElementsAre(2u, 5u, 6u));
  EXPECT_EQ(s.cell(0, 1).text, "a \"b\"\nc");
  EXPECT_EQ(s.cell(0, 0).kind, Kind::word);
  EXPECT_EQ(s.cell(1, 1).kind, Kind::empty);
  EXPECT_EQ(s.cell(2, 1).text, "last");
  read_csv(book, "points", "neuron;x (µm)\n1;2.5\n", "points.csv");
  EXPECT_EQ(book.sheets.at(1).cell(0, 1).text, "2.5");
  EXPECT_THROW(read_csv(book, "a", "id\n1,2\n", "a.csv"), InputError);
  try {
    read_csv(book, "a", "id\n\n\"1\n", "a.csv");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_EQ(error.line(), 3u);
  }
}

TEST(Csv, WhatIsWrittenIsRead) {
  const TableSheet sheet{"a", {{"id", ""}, {"text", ""}}, {{0.1, "a,\"b\"\r\nc;d"}, {std::int64_t(3), "é"}}};
  ReadWorkbook book;
  read_csv(book, "a", csv_of(sheet), "a.csv");
  EXPECT_EQ(book.sheets.at(0).cell(0, 0).text, "0.1");
  EXPECT_EQ(book.sheets.at(0).cell(0, 1).text, "a,\"b\"\r\nc;d");
  EXPECT_EQ(book.sheets.at(0).cell(1, 1).text, "é");
}

}  // namespace
}  // namespace forest::io
