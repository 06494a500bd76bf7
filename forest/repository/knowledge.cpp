// SPDX-License-Identifier: Apache-2.0
// What is known: grammars, models, distributions.
#include <algorithm>
#include <map>
#include <tuple>
#include <utility>

#include "forest/repository/impl.h"
#include "forest/repository/names.h"

namespace forest::repository {

int Repository::Impl::keep_grammar(const std::string& name, std::string_view text) {
  const std::string hash = hash_of(text),
                    find = "select id from grammars where hash = :hash and name = :name";
  if (const auto there = ask<int>(find, hash, name)) return *there;
  const std::string kept = escaped_lines(text);
  const int id = database->next_id("grammars");
  sql << "insert into grammars (id, name, hash, text) values (:id, :name, :hash, :text) on conflict do "
         "nothing",
      use(id), use(name), use(hash), use(kept);
  return *ask<int>(find, hash, name);  // another program may have been quicker
}

std::pair<int, int> Repository::Impl::keep_distribution(const std::string& name, int population,
                                                        std::string_view text) {
  const std::string kept = escaped_lines(text);
  const std::string same = " from distributions where name = :name and coalesce(population, 0) = :population";
  for (;;) {
    const int newest = ask<int>("select max(version)" + same, name, population).value_or(0);
    const std::string of_newest = same + " and version = :version";
    if (newest && ask<std::string>("select text" + of_newest, name, population, newest) == kept)
      return {*ask<int>("select id" + of_newest, name, population, newest), newest};
    const int id = database->next_id("distributions"), next = newest + 1;
    sql << "insert into distributions (id, population, name, version, text) values "
           "(:id, nullif(:population, 0), :name, :version, :text) on conflict do nothing",
        use(id), use(population), use(name), use(next), use(kept);
    if (ask<int>("select id from distributions where id = :id", id)) return {id, next};
  }  // else another program was quicker, and this is the version after its
}

Repository::Impl::Version Repository::Impl::keep_model(const std::string& name, int grammar, int population,
                                                       const std::string& origin, bool anew) {
  for (;;) {
    const int newest = ask<int>("select max(version) from models where name = :name", name).value_or(0);
    const std::string of_newest = " from models where name = :name and version = :version";
    const int before = ask<int>("select population" + of_newest, name, newest).value_or(0);
    const int of = population ? population : before;
    if (anew && newest && of == before &&
        ask<int>("select grammar" + of_newest, name, newest).value_or(0) == grammar)
      return {*ask<int>("select id" + of_newest, name, newest), newest, true};
    const std::string any = "select max(id) from models where name = :name and grammar = :grammar";
    if (const auto id = ask<int>(any, name, grammar); id && !anew)
      return {*id, *ask<int>("select version from models where id = :id", *id), true};
    const int id = database->next_id("models"), next = newest + 1;
    const std::string program = FOREST_VERSION, words = escaped(origin);
    sql << "insert into models (id, name, version, grammar, population, origin, program) values "
           "(:id, :name, :version, :grammar, nullif(:population, 0), :origin, :program) on conflict do "
           "nothing",
        use(id), use(name), use(next), use(grammar), use(of), use(words), use(program);
    if (ask<int>("select id from models where id = :id", id)) return {id, next, false};
  }  // else another program was quicker
}

void Repository::Impl::keep_distributions(int model, const std::string& name,
                                          const TextsByName& distributions) {
  if (ask<int>("select count(*) from model_distributions where model = :id", model).value_or(0)) return;
  const int of = ask<int>("select population from models where id = :id", model).value_or(0);
  for (const auto& [part, text] : distributions) {
    const int distribution = keep_distribution(name + "." + part, of, text).first;
    sql << "insert into model_distributions (model, distribution) values (:id, :distribution) on conflict do "
           "nothing",
        use(model), use(distribution);
  }
}

std::pair<int, bool> Repository::add_model(const NewModel& model) {
  Impl& impl = *impl_;
  check_name("model", model.name);
  if (model.name.find('@') != std::string::npos)
    throw Error(
        fmt::format("'{}' is no name for a model: what follows '@' is a version; leave it out", model.name));
  if (!model.population.empty()) check_name("population", model.population);
  for (const auto& [name, text] : model.distributions) check_name("distribution", model.name + "." + name);
  return impl.write([&] {
    const int population = model.population.empty() ? 0 : impl.population(model.population);
    const int grammar = impl.keep_grammar(model.name, model.text);
    const auto kept = impl.keep_model(model.name, grammar, population, model.origin, true);
    impl.keep_distributions(kept.id, model.name, model.distributions);
    return std::pair(kept.number, kept.already_there);
  });
}

bool Repository::remove_model(std::string_view name, int version) {
  Impl& impl = *impl_;
  return impl.write([&] {
    const auto id = impl.ask<int>("select id from models where name = :name and version = :version",
                                  std::string(name), version);
    if (!id) return false;
    const int grammar = impl.ask<int>("select grammar from models where id = :id", *id).value();
    const Answer parts =
        impl.database->ask(fmt::format("select distribution from model_distributions where model = {}", *id));
    impl.sql << "delete from model_distributions where model = :id", use(*id);
    for (const auto& row : parts.rows) {
      const int part = int(number_in(row[0]));
      impl.sql
          << "delete from distributions where id = :id and not exists (select 1 from model_distributions "
             "d where d.distribution = distributions.id)",
          use(part);
    }
    impl.sql << "delete from models where id = :id", use(*id);
    impl.sql
        << "delete from grammars where id = :id and not exists (select 1 from models m where m.grammar = "
           "grammars.id) and not exists (select 1 from provenance o where o.grammar = grammars.id)",
        use(grammar);
    impl.known_grammar = {}, impl.known_hash.clear();
    return true;
  });
}

std::vector<ModelRow> Repository::models() const {
  const auto [found, parts] = impl_->read([&] {
    return std::pair(
        impl_->database->ask("select id, name, version, coalesce(population, ''), origin, program, hash, "
                             "text, neurons from model"),
        impl_->database->ask("select m.model, d.name, d.version from model_distributions m join "
                             "distributions d on d.id = m.distribution"));
  });
  std::map<std::int64_t, ModelRow> by_id;
  for (const auto& row : found.rows)
    by_id[number_in(row[0])] = {.name = text_of(row[1]),
                                .population = text_of(row[3]),
                                .origin = unescaped(text_of(row[4])),
                                .hash = text_of(row[6]),
                                .text = unescaped(text_of(row[7])),
                                .program = text_of(row[5]),
                                .version = int(number_in(row[2])),
                                .neurons = std::size_t(number_in(row[8])),
                                .distributions = {}};
  for (const auto& row : parts.rows)
    by_id[number_in(row[0])].distributions.emplace_back(text_of(row[1]), int(number_in(row[2])));
  std::vector<ModelRow> models;
  for (auto& [id, model] : by_id) {
    std::ranges::sort(model.distributions);
    models.push_back(std::move(model));
  }
  std::ranges::sort(models, {}, [](const ModelRow& m) { return std::tie(m.name, m.version); });
  return models;
}

std::optional<ModelRow> Repository::model(std::string_view name, int version) const {
  std::optional<ModelRow> found;
  for (ModelRow& row : models())
    if (row.name == name && (!version || row.version == version))
      found = std::move(row);  // the newest comes last
  return found;
}

std::string Repository::add_grammar(std::string_view name, std::string_view text,
                                    const TextsByName& distributions) {
  check_name("grammar", name);
  for (const auto& [part, unused] : distributions)
    check_name("distribution", fmt::format("{}.{}", name, part));
  return impl_->write([&] {
    const std::string model(name);
    const int grammar = impl_->keep_grammar(model, text);
    const auto kept = impl_->keep_model(model, grammar, 0, "neurons were grown from it", false);
    impl_->keep_distributions(kept.id, model, distributions);
    return hash_of(text);
  });
}

std::optional<std::string> Repository::grammar(std::string_view hash) const {
  return impl_->guarded([&] {
    auto text = impl_->ask<std::string>("select text from grammars where hash = :hash order by id",
                                        std::string(hash));
    return text ? std::optional(unescaped(*text)) : std::nullopt;
  });
}

int Repository::add_distribution(std::string_view name, std::string_view population, std::string_view text) {
  check_name("distribution", name);
  if (!population.empty()) check_name("population", population);
  return impl_->write([&] {
    const int of = population.empty() ? 0 : impl_->population(std::string(population));
    return impl_->keep_distribution(std::string(name), of, text).second;
  });
}

std::vector<DistributionRow> Repository::distributions() const {
  const Answer found = impl_->read([&] {
    return impl_->database->ask("select name, coalesce(population, ''), text, version from distribution");
  });
  std::vector<DistributionRow> distributions;
  for (const auto& row : found.rows)
    distributions.push_back({.name = text_of(row[0]),
                             .population = text_of(row[1]),
                             .text = unescaped(text_of(row[2])),
                             .version = int(number_in(row[3]))});
  std::ranges::sort(distributions, {},
                    [](const DistributionRow& d) { return std::tie(d.population, d.name, d.version); });
  return distributions;
}

std::optional<DistributionRow> Repository::distribution(std::string_view name, std::string_view population,
                                                        int version) const {
  std::optional<DistributionRow> found;
  for (DistributionRow& row : distributions())
    if (row.name == name && row.population == population && (!version || row.version == version))
      found = std::move(row);  // the newest comes last
  return found;
}

}  // namespace forest::repository
