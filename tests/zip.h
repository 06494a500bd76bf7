// SPDX-License-Identifier: Apache-2.0
// ZIP archives of given parts, in memory: workbooks as no spreadsheet would write them.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>
#include <zlib.h>

namespace forest {

using Parts = std::vector<std::pair<std::string, std::string>>;  // name, bytes

/// Deflated when that is asked for, else stored.
inline std::string zip_of(const Parts& parts, bool deflated = false) {
  std::string archive, directory;
  const auto number = [](std::string& to, std::uint64_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) to += char(value >> 8 * i & 255);
  };
  for (const auto& [name, bytes] : parts) {
    std::string packed = bytes;
    if (deflated) {
      z_stream z{};
      deflateInit2(&z, 9, Z_DEFLATED, -MAX_WBITS, 9, Z_DEFAULT_STRATEGY);
      packed.resize(deflateBound(&z, uLong(bytes.size())));
      z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
      z.avail_in = uInt(bytes.size());
      z.next_out = reinterpret_cast<Bytef*>(packed.data());
      z.avail_out = uInt(packed.size());
      deflate(&z, Z_FINISH);
      packed.resize(z.total_out);
      deflateEnd(&z);
    }
    std::string common;  // of the local header and the directory
    number(common, 20, 2), number(common, 0, 2), number(common, deflated ? 8 : 0, 2), number(common, 0, 4);
    number(common, crc32(0, reinterpret_cast<const Bytef*>(bytes.data()), uInt(bytes.size())), 4);
    number(common, packed.size(), 4), number(common, bytes.size(), 4);
    number(common, name.size(), 2), number(common, 0, 2);
    number(directory, 0x02014b50, 4), number(directory, 20, 2);
    directory += common;
    number(directory, 0, 2), number(directory, 0, 2), number(directory, 0, 2), number(directory, 0, 4);
    number(directory, archive.size(), 4);
    directory += name;
    number(archive, 0x04034b50, 4);
    archive += common + name + packed;
  }
  const std::size_t begin = archive.size();
  archive += directory;
  number(archive, 0x06054b50, 4), number(archive, 0, 4), number(archive, parts.size(), 2);
  number(archive, parts.size(), 2), number(archive, directory.size(), 4), number(archive, begin, 4);
  number(archive, 0, 2);
  return archive;
}

/// The parts of a workbook with one sheet, `neurons`, of this XML and these shared texts.
inline Parts workbook_parts(std::string sheet, std::string texts = "<sst/>") {
  return {
      {"_rels/.rels",
       R"(<Relationships><Relationship Id="r" Type="http://x/officeDocument" Target="xl/workbook.xml"/></Relationships>)"},
      {"xl/workbook.xml",
       R"(<workbook xmlns:r="http://r"><sheets><sheet name="neurons" sheetId="1" r:id="a"/></sheets></workbook>)"},
      {"xl/_rels/workbook.xml.rels",
       R"(<Relationships><Relationship Id="a" Type="http://x/worksheet" Target="/xl/worksheets/one.xml"/><Relationship Id="b" Type="http://x/sharedStrings" Target="./texts.xml"/></Relationships>)"},
      {"xl/worksheets/one.xml", std::move(sheet)},
      {"xl/texts.xml", std::move(texts)}};
}

}  // namespace forest
