// SPDX-License-Identifier: Apache-2.0
// Correcting neurons that are stored.
#include <bit>
#include <unordered_map>
#include <utility>

#include <fmt/format.h>

#include "forest/repository/impl.h"
#include "forest/repository/names.h"

namespace forest::repository {

std::vector<std::string> Repository::versions(std::span<const NeuronId> ids) const {
  std::vector<std::string> versions(ids.size());
  if (ids.empty()) return versions;
  std::string list;
  for (const NeuronId id : ids) list += fmt::format("{}{}", list.empty() ? "" : ", ", id.value());
  const Answer found = impl_->read([&] {
    return impl_->database->ask(fmt::format(
        "select n.id, n.checksum, n.fingerprint, p.name, n.name, n.species, n.region, n.layer, n.type from "
        "neurons n join populations p on p.id = n.population where n.id in ({})",
        list));
  });
  std::unordered_map<std::int64_t, std::string> known;
  for (const auto& row : found.rows) {
    std::string all;
    for (const Answer::Value& value : row) {
      const std::string field =
          std::holds_alternative<std::string>(value) ? text_of(value) : fmt::format("{}", number_in(value));
      all += fmt::format("{} {}", field.size(), field);  // so that no two rows look alike
    }
    known[std::get<std::int64_t>(row[0])] = "v" + hash_of(all).substr(0, 16);  // no spreadsheet's number
  }
  for (std::size_t i = 0; i < ids.size(); ++i)
    if (const auto row = known.find(std::int64_t(ids[i].value())); row != known.end())
      versions[i] = row->second;
  return versions;
}

void Repository::revise(std::span<const Revision> revisions) {
  Impl& impl = *impl_;
  std::vector<NeuronId> ids;
  std::vector<std::optional<Prepared>> prepared(revisions.size());  // before the database is locked
  for (std::size_t i = 0; i < revisions.size(); ++i) {
    check_name("neuron", revisions[i].name);
    ids.push_back(revisions[i].id);
    if (revisions[i].morphology) prepared[i].emplace(*revisions[i].morphology);
  }
  const auto undone = [&](const std::string& why) {
    impl.failed = true;  // in a transaction of the caller's too
    return Error(fmt::format("{}: {}, so nothing is changed", impl.place, why));
  };
  impl.write([&] {
    const std::vector<std::string> now = versions(ids);
    for (std::size_t i = 0; i < revisions.size(); ++i)
      if (now[i].empty() || now[i] != revisions[i].version)
        throw undone(fmt::format("neuron {} has been {} since it was looked at", ids[i].value(),
                                 now[i].empty() ? "removed" : "changed"));
    impl.last_numbers.clear();
    for (const Revision& r : revisions) {  // none has its old name while they get the new ones
      const int id = number_of(r.id);
      const std::string none = fmt::format("\x01{}", id);
      impl.sql << "update neurons set name = :none where id = :id", use(none), use(id);
    }
    for (std::size_t i = 0; i < revisions.size(); ++i) {
      const Revision& r = revisions[i];
      const int id = number_of(r.id);
      const int population = *impl.ask<int>("select population from neurons where id = :id", id);
      if (impl.ask<int>("select id from neurons where population = :population and name = :name", population,
                        r.name))
        throw undone(fmt::format("another neuron of the population is called {}", shown(r.name)));
      NewNeuron about{.name = r.name,
                      .species = escaped(r.species),
                      .region = escaped(r.region),
                      .layer = escaped(r.layer),
                      .type = escaped(r.type)};
      if (prepared[i]) {
        const std::string fingerprint =
            *impl.ask<std::string>("select fingerprint from neurons where id = :id", id);
        const int grammar =
            impl.ask<int>("select grammar from provenance where neuron = :id", id).value_or(0);
        about.provenance = neuron(r.id)->provenance;
        remove(r.id);
        if (!impl.insert) impl.insert = std::make_unique<Statements>(*impl.database);
        Statements& insert = *impl.insert;
        Prepared::Data& data = *prepared[i]->data_;
        insert.id = id, insert.population = population, insert.grammar = grammar;
        insert.name = r.name, insert.fingerprint = fingerprint, insert.about = std::move(about);
        insert.rows = std::move(data.rows), insert.packed_points = std::move(data.packed_points);
        insert.checksum = std::bit_cast<long long>(data.sum);
        if (!insert.run(data.morphology)) throw undone(fmt::format("neuron {} cannot be stored again", id));
      } else {
        impl.sql << "update neurons set name = :name, species = :species, region = :region, layer = :layer, "
                    "type = :type where id = :id",
            use(about.name), use(about.species), use(about.region), use(about.layer), use(about.type),
            use(id);
      }
    }
    return true;
  });
}

}  // namespace forest::repository
