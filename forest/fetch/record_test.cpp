// SPDX-License-Identifier: Apache-2.0
#include "forest/fetch/record.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/fetch/service.h"

#include "tests/refused.h"

namespace forest::fetch {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::Pair;

const std::string one =
    R"({"neuron_id":7,"neuron_name":"pc-7","archive":"Hof","species":"rat","note":null,"strain":"",)"
    R"("brain_region":["neocortex","prefrontal","Layer 3"],"cell_type":["Local projecting","pyramidal"],)"
    R"("reference_doi":["10.1/a","10.2/b"],"soma_surface":"612.4","min_age":null,"license":"CC BY 4.0",)"
    R"("_links":{"self":{"href":"http://elsewhere/"}}})";

const std::string page = R"({"_embedded":{"neuronResources":[)" + one + R"(,{"neuron_id":8},7,)" + one +
                         R"(]},"page":{"size":50,"totalElements":131,"totalPages":3,"number":0}})";

TEST(Record, TellsWhatTheServiceSays) {
  const Record record = parse_record(one, "address");
  EXPECT_EQ(record.id, 7u);
  EXPECT_EQ(record.name, "pc-7");
  EXPECT_EQ(record.archive, "Hof");
  EXPECT_EQ(record.species, "rat");
  EXPECT_EQ(record.region, "neocortex, prefrontal");
  EXPECT_EQ(record.layer, "Layer 3");
  EXPECT_EQ(record.type, "Local projecting, pyramidal");
  EXPECT_THAT(record.facts, Contains(Pair("reference_doi", "10.1/a, 10.2/b")));
  EXPECT_THAT(record.facts, Contains(Pair("license", "CC BY 4.0")));
  EXPECT_THAT(record.facts, Contains(Pair("brain_region", "neocortex, prefrontal, Layer 3")));
  EXPECT_EQ(record.facts.size(), 9u);  // neither null, empty nor links
  EXPECT_EQ(parse_record(record.json, "again").json, record.json);
}

TEST(Record, PageIsRecordsAndCounts) {
  const Page read = parse_page(page, "address");
  ASSERT_EQ(read.records.size(), 3u);
  EXPECT_EQ(read.records[1].name, "");
  EXPECT_EQ(read.pages, 3u);
  EXPECT_EQ(read.total, 131u);
  EXPECT_TRUE(parse_page(R"({"page":{"totalPages":0}})", "address").records.empty());
  EXPECT_EQ(parse_page(R"({"_embedded":{"neuronResources":[]},"page":{"totalPages":-4}})", "address").pages,
            0u);
}

TEST(Record, EveryTruncationIsAnError) {
  for (std::size_t length = 0; length < page.size(); ++length)
    EXPECT_THROW(parse_page(page.substr(0, length), "address"), InputError) << length;
  for (std::size_t length = 0; length < one.size(); ++length)
    EXPECT_THROW(parse_record(one.substr(0, length), "address"), InputError) << length;
}

TEST(Record, EveryWrongByteIsAnErrorOrARecord) {
  for (std::size_t at = 0; at < page.size(); ++at)
    for (const char byte : {'\0', '"', '{', ']', '9', '\xff'}) {
      std::string changed = page;
      changed[at] = byte;
      try {
        (void)parse_page(changed, "address");
      } catch (const InputError& error) {
        EXPECT_EQ(error.file(), "address");
      }
    }
}

TEST(Record, StrangeAnswersAreSaid) {
  const auto error_of = [](const std::string& text) {
    return refused<InputError>([&] { (void)parse_record(text, "address"); });
  };
  EXPECT_THAT(error_of("<html>login</html>"),
              HasSubstr("address:1: is no JSON from column 1 on; check the service"));
  for (const char* text : {"[]", "null", "7", "{}", R"({"neuron_name":7})", R"({"neuron_name":""})"})
    EXPECT_THAT(error_of(text), HasSubstr("no neuron")) << text;
  EXPECT_THAT(error_of(std::string(100'000, '[')), HasSubstr("deep"));
  EXPECT_THAT(error_of(R"({"neuron_name":"a","x":)" + std::string(100, '[') + std::string(100, ']') + "}"),
              HasSubstr("deep"));
  EXPECT_THAT(error_of("{\"neuron_name\":\"\xff\xfe\"}"), HasSubstr("no JSON"));
  EXPECT_THROW(parse_page(R"({"_embedded":{"neuronResources":{}},"page":{}})", "address"), InputError);
  EXPECT_THROW(parse_page("[]", "address"), InputError);
}

TEST(WebPage, IsKnownByItsFirstSign) {
  EXPECT_TRUE(is_web_page("<!DOCTYPE html>"));
  EXPECT_TRUE(is_web_page("\xef\xbb\xbf \r\n<html>"));
  EXPECT_FALSE(is_web_page("# <b>\n1 1 0 0 0 1 -1\n"));
  EXPECT_FALSE(is_web_page(""));
}

}  // namespace
}  // namespace forest::fetch
