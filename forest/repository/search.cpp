// SPDX-License-Identifier: Apache-2.0
// Which neurons there are: lists, conditions, questions.
#include <algorithm>
#include <array>
#include <bit>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "forest/repository/impl.h"
#include "forest/repository/names.h"
#include "forest/statistics/metric.h"

namespace forest::repository {

std::vector<PopulationRow> Repository::populations() const {
  return impl_->read([&] {
    const std::size_t count = std::size_t(impl_->ask<int>("select count(*) from populations").value_or(0));
    std::vector<PopulationRow> populations;
    std::vector<std::string> name(room(count));
    std::vector<long long> neurons(room(count)), sections(room(count));
    Reals length(room(count));
    impl_->sql << "select p.name, count(n.id), coalesce(sum(n.sections), 0), coalesce(sum(n.length), 0) from "
                  "populations p left "
                  "join neurons n on n.population = p.id group by p.id, p.name order by p.name",
        into(name), into(neurons), into(sections), into(length);
    for (std::size_t i = 0; i < name.size(); ++i)
      populations.push_back(
          {std::move(name[i]), std::size_t(neurons[i]), std::size_t(sections[i]), length[i]});
    return populations;
  });
}

/// `where` may use :name and :population (texts) and :id, each of them once.
std::vector<NeuronRow> Repository::Impl::rows(const std::string& where, const std::string& text1,
                                              const std::string& text2, int id) const {
  return read([&] {
    const std::string from =
        " from neurons n join populations p on p.id = n.population left join provenance o on o.neuron = n.id "
        "left join grammars g on g.id = o.grammar where " +
        where;
    const std::size_t count = std::size_t(ask<int>("select count(*)" + from, text1, text2, id).value_or(0));
    Ints ids(room(count)), stems(room(count)), sections(room(count)), points(room(count)),
        spines(room(count));
    std::vector<long long> seed(room(count)), index(room(count));
    Reals length(room(count));
    std::array<std::vector<std::string>, 12> t;
    for (auto& column : t) column.resize(room(count));
    sql << "select n.id, n.name, p.name, n.species, n.region, n.layer, n.type, n.stems, n.sections, "
           "n.points, n.spines, n.length, "
           "coalesce(o.origin, ''), coalesce(o.source_file, ''), coalesce(o.source_hash, ''), "
           "coalesce(g.name, ''), "
           "coalesce(g.hash, ''), coalesce(o.seed, 0), coalesce(o.number, 0), coalesce(o.program, '')" +
               from + " order by n.id",
        into(ids), into(t[0]), into(t[1]), into(t[2]), into(t[3]), into(t[4]), into(t[5]), into(stems),
        into(sections), into(points), into(spines), into(length), into(t[6]), into(t[7]), into(t[8]),
        into(t[9]), into(t[10]), into(seed), into(index), into(t[11]), use(text1), use(text2), use(id);
    std::vector<NeuronRow> rows(ids.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      NeuronRow& row = rows[i];
      row = {.id = NeuronId(std::size_t(ids[i])),
             .name = std::move(t[0][i]),
             .population = std::move(t[1][i]),
             .species = unescaped(t[2][i]),
             .region = unescaped(t[3][i]),
             .layer = unescaped(t[4][i]),
             .type = unescaped(t[5][i]),
             .stems = std::size_t(stems[i]),
             .sections = std::size_t(sections[i]),
             .points = std::size_t(points[i]),
             .spines = std::size_t(spines[i]),
             .length = length[i],
             .provenance = {},
             .program = std::move(t[11][i])};
      if (t[6][i] == "grown")
        row.provenance = Grown{t[9][i], t[10][i], std::bit_cast<std::uint64_t>(seed[i]),
                               std::bit_cast<std::uint64_t>(index[i])};
      else
        row.provenance = Traced{unescaped(t[7][i]), unescaped(t[8][i])};
    }
    return rows;
  });
}

std::vector<NeuronRow> Repository::neurons(std::string_view population) const {
  const std::string name(population);
  return impl_->rows("(p.name = :population or :every = '') and :unused = 0", name, name, 0);
}

namespace {

/// A condition whose names of metrics have become columns of joined tables, and the joins.
struct Condition {
  std::string text, joins;
};

Condition condition_of(std::string_view text) {
  Condition condition;
  std::vector<int> joined;
  for (std::size_t at = 0; at < text.size();) {
    const char c = text[at];
    const auto word_char = [](char d) {
      return (d >= 'a' && d <= 'z') || (d >= 'A' && d <= 'Z') || (d >= '0' && d <= '9') || d == '_' || d < 0;
    };
    if (c == '\'' || c == '"') {  // a text or a quoted name stays as it is
      const std::size_t end = std::min(text.find(c, at + 1), text.size() - 1) + 1;
      condition.text += text.substr(at, end - at);
      at = end;
    } else if (word_char(c)) {
      std::size_t end = at;
      while (end < text.size() && word_char(text[end])) ++end;
      const std::string_view word = text.substr(at, end - at);
      if (const statistics::Metric* metric = statistics::find_metric(word)) {
        const int number = int(metric - statistics::metrics().data()) + 1;
        if (std::ranges::find(joined, number) == joined.end()) {
          joined.push_back(number);
          condition.joins += fmt::format(
              " left join neuron_metrics m{0} on m{0}.neuron = v.id and m{0}.metric = {0}", number);
        }
        condition.text += fmt::format("m{}.value", number);
      } else {
        condition.text += word;
      }
      at = end;
    } else {
      condition.text += c;
      ++at;
    }
  }
  return condition;
}

}  // namespace

std::vector<NeuronRow> Repository::neurons_where(const std::string& text, std::string_view population) const {
  const Condition condition = condition_of(text);
  // Asked alone first: what is wrong with it is the person's, not the database's.
  const std::string ids =
      fmt::format("select v.id from neuron v{} where ({})", condition.joins, condition.text);
  const Answer found = impl_->read([&] { return impl_->database->ask(ids); });
  std::vector<NeuronRow> rows;
  if (found.rows.empty()) return rows;
  std::vector<std::int64_t> chosen;
  for (const auto& row : found.rows) chosen.push_back(std::get<std::int64_t>(row[0]));
  std::ranges::sort(chosen);
  constexpr std::size_t many = 10'000;  // more are not asked for one by one
  const std::string in =
      chosen.size() < many ? fmt::format("n.id in ({})", fmt::join(chosen, ", ")) : "1 = 1";
  const std::string name(population);
  for (NeuronRow& row :
       impl_->rows("(p.name = :population or :every = '') and :unused = 0 and " + in, name, name, 0))
    if (std::ranges::binary_search(chosen, std::int64_t(row.id.value()))) rows.push_back(std::move(row));
  return rows;
}

Answer Repository::query(const std::string& question) {
  return impl_->guarded([&] {
    impl_->database->forbid_writing();
    return impl_->database->ask(question);
  });
}

std::vector<NeuronRow> Repository::find(std::string_view name, std::string_view population) const {
  const std::string where =
      population.empty() ? "n.name = :name and :population = ''" : "n.name = :name and p.name = :population";
  return impl_->rows(where + " and :unused = 0", std::string(name), std::string(population), 0);
}

std::optional<NeuronRow> Repository::neuron(NeuronId id) const {
  auto rows = impl_->rows(":one = '' and :two = '' and n.id = :id", "", "", number_of(id));
  return rows.empty() ? std::nullopt : std::optional(std::move(rows[0]));
}

std::vector<ArborRow> Repository::arbors(NeuronId id) const {
  return impl_->read([&] {
    const int neuron = number_of(id);
    const std::size_t count =
        std::size_t(impl_->ask<int>("select count(*) from arbors where neuron = :id", neuron).value_or(0));
    std::vector<ArborRow> arbors;
    Ints root(room(count)), kind(room(count)), sections(room(count)), terminals(room(count)),
        order(room(count));
    Reals length(room(count));
    impl_->sql << "select root, kind, sections, terminals, max_order, length from arbors where neuron = :id "
                  "order by number",
        into(root), into(kind), into(sections), into(terminals), into(order), into(length), use(neuron);
    for (std::size_t i = 0; i < root.size(); ++i)
      arbors.push_back({.root = SectionId(std::size_t(root[i])),
                        .kind = SectionKind(kind[i]),
                        .sections = std::size_t(sections[i]),
                        .terminals = std::size_t(terminals[i]),
                        .order = order[i],
                        .length = length[i]});
    return arbors;
  });
}

}  // namespace forest::repository
