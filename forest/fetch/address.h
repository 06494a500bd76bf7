// SPDX-License-Identifier: Apache-2.0
// Where a service like NeuroMorpho.Org keeps what (neuromorpho.org/apiReference.html; the files after its page of
// questions, "How can I programmatically access"). Nothing here touches the network.
//
//   <base>/api/neuron/name/<name>                                     one record
//   <base>/api/neuron/id/<number>                                     the same, by number
//   <base>/api/neuron/select?q=<cond>&fq=<cond>…&page=<n>&size=<n>    a page of records
//   <base>/dableFiles/<archive, lower case>/CNG%20version/<name>.CNG.swc
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace forest::fetch {

/// One piece of a path or query: every byte but letters, digits and -._~ becomes %HH (RFC 3986, section 2.3).
std::string encoded(std::string_view text);

/// The conditions of "species:rat AND brain_region:neocortex": field:value each, all of which hold. Quotation marks keep
/// a value together; commas in a value mean "or". Throws Error when a part is no condition.
std::vector<std::string> conditions(std::string_view query);

class Addresses {
 public:
  /// @param base  "https://neuromorpho.org", with or without a path. Throws Error unless it is a plain address of http
  /// or https: no user, no password, no query.
  explicit Addresses(std::string_view base);

  const std::string& base() const { return base_; }
  /// @param name  a neuron's name, or its number as NMO_123. Throws Error for what no address can hold.
  std::string record(std::string_view name) const;
  std::string page(const std::vector<std::string>& conditions, std::size_t number, std::size_t size) const;
  /// Throws Error when archive or name is no single piece of a path: they come from a server.
  std::string swc(std::string_view archive, std::string_view name) const;

 private:
  std::string base_;
};

}  // namespace forest::fetch
