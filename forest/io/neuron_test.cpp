// SPDX-License-Identifier: Apache-2.0
// The text of exported cells; what NEURON makes of them is asked by tests/cli/neuron.sh.
#include "forest/io/neuron.h"

#include <algorithm>
#include <set>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/zoo.h"

namespace forest::io {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(Neuron, SectionsHaveTheNamesAndListsOfNeuronsOwnImporters) {
  MorphologyBuilder b;
  b.set_soma(zoo_parts::sphere(5));
  b.annotate("species", "rat");
  const auto stem =
      b.add_section({}, SectionKind::apical, zoo_parts::Points{{0, 5, 0, 2}, {0, 15, 0, 1}}, 4, 0);
  b.add_section(stem, SectionKind::apical, zoo_parts::Points{{3, 19, 0, 1}});
  b.add_section(stem, SectionKind::custom, zoo_parts::Points{{-3, 19, 0, 1}}, 9);
  const Morphology m = b.build();
  const std::string hoc = write_neuron_hoc(m);
  for (const char* part :
       {"// species rat\n", "create soma[1]\n", "create apic[2]\n", "create dend_9[1]\n", "public apic\n",
        "public all, somatic, axonal, basal, apical, geom_nseg, fill_diameters, init\n",
        "    pt3dadd(0, -5, 0, 10)\n", "  connect apic[0](0), soma[0](0.5)\n",
        "  connect apic[1](0), apic[0](1)\n", "    pt3dstyle(1, 0, 0, 0)\n",
        "  for i = 0, 1 apic[i] { all.append() apical.append() }\n",
        "  for i = 0, 0 dend_9[i] { all.append() }\n"})
    EXPECT_THAT(hoc, HasSubstr(part));
  EXPECT_THAT(hoc, Not(HasSubstr("axon[")));
  const std::string python = write_neuron_python(m);
  for (const char* part : {"# species rat\n", "    (\"apic\", \"apical\", 0, 0.5, (0, 0, 0), (\n",
                           "        self.dend_9 = []\n", "    (\"dend_9\", None, 1, 1, None, (\n"})
    EXPECT_THAT(python, HasSubstr(part));
}

TEST(Neuron, ProceduresStayShort) {
  for (const Specimen& specimen : zoo()) {
    SCOPED_TRACE(specimen.name);
    std::istringstream hoc(write_neuron_hoc(specimen.morphology));
    std::size_t lines = 0, most = 0;
    for (std::string line; std::getline(hoc, line); most = std::max(most, ++lines))
      if (line.starts_with("proc")) lines = 0;
    EXPECT_LT(most, 300u);
  }
}

TEST(Neuron, DifferentCellsAreDifferentTemplates) {
  std::set<std::string> names;
  for (const Specimen& specimen : zoo()) {
    const std::string hoc = write_neuron_hoc(specimen.morphology);
    const std::size_t begin = hoc.find("begintemplate ");
    names.insert(hoc.substr(begin, hoc.find('\n', begin) - begin));
  }
  EXPECT_EQ(names.size(), zoo().size());
}

}  // namespace
}  // namespace forest::io
