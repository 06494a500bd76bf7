// SPDX-License-Identifier: Apache-2.0
// Any bytes are a workbook, a sheet in one, its texts, or a CSV file; or an error with a sentence.
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "forest/core/error.h"
#include "forest/io/workbook.h"

#include "tests/zip.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace forest;
  if (size == 0) return 0;
  const std::string bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  const std::string row = R"(<worksheet><row><c t="s"><v>0</v></c></row></worksheet>)";
  try {
    io::ReadWorkbook book;
    switch (data[0] % 4) {  // a checksum in the archive would keep nearly all changes out
      case 0:
        book = io::read_workbook(bytes, "input");
        break;
      case 1:
        book = io::read_workbook(zip_of(workbook_parts(bytes, "<sst><si><t>id</t></si></sst>")), "input");
        break;
      case 2:
        book = io::read_workbook(zip_of(workbook_parts(row, bytes)), "input");
        break;
      default:
        io::read_csv(book, "neurons", bytes, "input");
    }
    for (const io::ReadSheet& sheet : book.sheets)
      if (sheet.cells.size() != sheet.rows.size() * sheet.header.size()) std::abort();
  } catch (const InputError& error) {
    if (error.file() != "input") std::abort();
  }
  return 0;
}
