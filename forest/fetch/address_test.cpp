// SPDX-License-Identifier: Apache-2.0
#include "forest/fetch/address.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "forest/core/error.h"

#include "tests/refused.h"

namespace forest::fetch {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

TEST(Address, IsAsTheServiceDocumentsIt) {
  const Addresses at("https://neuromorpho.org/");
  EXPECT_EQ(at.record("cnic_001"), "https://neuromorpho.org/api/neuron/name/cnic_001");
  EXPECT_EQ(at.record("NMO_00001"), "https://neuromorpho.org/api/neuron/id/1");
  EXPECT_EQ(at.record("NMO_x"), "https://neuromorpho.org/api/neuron/name/NMO_x");
  EXPECT_EQ(at.swc("Allen Cell Types", "a b"),
            "https://neuromorpho.org/dableFiles/allen%20cell%20types/CNG%20version/a%20b.CNG.swc");
  EXPECT_EQ(
      at.page({"species:rat", "brain_region:neocortex"}, 3, 50),
      "https://neuromorpho.org/api/neuron/select?q=species%3Arat&fq=brain_region%3Aneocortex&page=3&size=50");
}

TEST(Address, QueryIsConditionsThatAllHold) {
  EXPECT_THAT(conditions("species:rat"), ElementsAre("species:rat"));
  EXPECT_THAT(conditions("species:rat,mouse AND  cell_type:\"a AND b\" AND age_scale:Day"),
              ElementsAre("species:rat,mouse", "cell_type:\"a AND b\"", "age_scale:Day"));
  for (const char* wrong : {"", "rat", ":rat", "species:", "species:rat AND", "species:rat AND ", " AND a:b",
                            "species:\"rat", "spe cies:rat", "a/b:c"})
    EXPECT_THAT(refused([&] { conditions(wrong); }), HasSubstr("field:value")) << wrong;
}

TEST(Address, OfAServiceIsPlain) {
  for (const char* right : {"http://127.0.0.1:8000", "https://host/path/", "http://[::1]:80"})
    EXPECT_NO_THROW(Addresses{right}) << right;
  for (const char* wrong : {"", "neuromorpho.org", "file:///etc/passwd", "ftp://host", "http://",
                            "https:///x", "http://me:secret@host", "http://host/?q=1", "http://host#x",
                            "http://ho st", "http://host\r\nX: y", "http://host\\x"})
    EXPECT_NE(refused([&] { Addresses{wrong}; }), "") << wrong;
  EXPECT_THAT(refused([&] { Addresses{"http://me:secret@host"}; }), HasSubstr("without user"));
}

TEST(Address, NamesOfAServerStayInTheirFolder) {
  const Addresses at("http://host");
  for (const char* wrong :
       {"", ".", "..", "../x", "a/../b", "/etc/passwd", "a\\b", "a%2fb", "..%2F..", "a\nb"}) {
    EXPECT_NE(refused([&] { (void)at.swc("archive", wrong); }), "") << wrong;
    EXPECT_NE(refused([&] { (void)at.swc(wrong, "name"); }), "") << wrong;
    EXPECT_NE(refused([&] { (void)at.record(wrong); }), "") << wrong;
  }
  EXPECT_NE(refused([&] { (void)at.swc("archive", std::string(100'000, 'a')); }), "");
}

RC_GTEST_PROP(Address, AnyNameIsOnePieceOrRefused, (const std::string& name)) {
  try {
    const std::string address = Addresses("http://host").record(name);
    RC_ASSERT(std::count(address.begin(), address.end(), '/') == 6);
    RC_ASSERT(address.find_first_of(" ?#\\\r\n\"<>") == std::string::npos);
  } catch (const Error&) {
  }
}

}  // namespace
}  // namespace forest::fetch
