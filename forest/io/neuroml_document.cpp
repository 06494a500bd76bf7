// SPDX-License-Identifier: Apache-2.0
#include "forest/io/neuroml_document.h"

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/lower.h"
#include "forest/io/format.h"

namespace forest::io::neuroml {

Document::Document(std::string_view bytes, const std::string& name) : name_(name) {
  const auto result = document_.load_buffer(bytes.data(), bytes.size(), pugi::parse_default);
  for (std::size_t at = bytes.find('\n'); at != bytes.npos; at = bytes.find('\n', at + 1))
    lines_.push_back(std::ptrdiff_t(at));
  if (!result)
    throw InputError(
        name, line_of(result.offset),
        fmt::format("is not XML ({}); write or copy the file again", lower(result.description())));
  root_ = document_.document_element();
  if (local(root_) != "neuroml")
    throw NotANeuron(name, line(root_),
                     fmt::format("is not NeuroML: its first element is <{}>, not <neuroml>",
                                 std::string_view(root_.name()).substr(0, 40)));
  if (root_.child("cells") ||
      std::string_view(root_.attribute("xmlns").value()).find("morphml.org") != std::string_view::npos)
    throw InputError(name, line(root_),
                     "is NeuroML 1; convert it to version 2 with the tools of neuroml.org");
}

}  // namespace forest::io::neuroml
