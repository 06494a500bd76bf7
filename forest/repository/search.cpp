// SPDX-License-Identifier: Apache-2.0
// Which neurons there are: lists, conditions, questions.
#include <algorithm>
#include <bit>
#include <functional>
#include <map>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "forest/core/lower.h"
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

std::vector<NeuronRow> Repository::Impl::rows(const std::string& where, const std::string& joins) const {
  std::vector<NeuronRow> rows;
  const auto keep = [&](std::span<Answer::Value> row) {
    std::size_t column = 0;
    const auto text = [&] {
      auto* value = std::get_if<std::string>(&row[column++]);
      return value ? std::move(*value) : std::string();
    };
    const auto number = [&] { return number_in(row[column++]); };
    const auto count = [&] { return std::size_t(number()); };
    const auto real = [&] {
      const double* value = std::get_if<double>(&row[column++]);
      return value ? *value : 0.;
    };
    // In the order in which they are asked for: members of a list in braces are worked out from first to last.
    NeuronRow& neuron = rows.emplace_back(NeuronRow{.id = NeuronId(count()),
                                                    .name = text(),
                                                    .population = text(),
                                                    .species = unescaped(text()),
                                                    .region = unescaped(text()),
                                                    .layer = unescaped(text()),
                                                    .type = unescaped(text()),
                                                    .stems = count(),
                                                    .sections = count(),
                                                    .points = count(),
                                                    .spines = count(),
                                                    .length = real(),
                                                    .provenance = {},
                                                    .program = text()});
    if (text() == "grown") {
      neuron.provenance = Grown{text(), text(), std::bit_cast<std::uint64_t>(number()),
                                std::bit_cast<std::uint64_t>(number())};
    } else {
      column += 4;
      neuron.provenance = Traced{unescaped(text()), unescaped(text())};
    }
  };
  read([&] {
    database->each(
        fmt::format(
            "select v.id, v.name, v.population, v.species, v.region, v.layer, v.type, v.stems, v.sections, "
            "v.points, v.spines, v.length, v.program, v.origin, v.grammar, (select g.hash from provenance o "
            "join grammars g on g.id = o.grammar where o.neuron = v.id), v.seed, v.number, v.source_file, "
            "v.source_hash from neuron v{} where {} order by v.id",
            joins, where),
        keep);
  });
  return rows;
}

namespace {

/// A column that is a name; nothing has one that is none.
std::string is_called(const char* column, std::string_view name) {
  if (!is_name(name)) return "1 = 0";
  std::string quoted;
  for (const char c : name) quoted.append(c == '\'' ? 2 : 1, c);
  return fmt::format("{} = '{}'", column, quoted);
}

std::string in_population(std::string_view population) {
  return population.empty() ? "1 = 1" : is_called("v.population", population);
}

}  // namespace

std::vector<NeuronRow> Repository::neurons(std::string_view population) const {
  return impl_->rows(in_population(population));
}

namespace {

/// A condition whose names of metrics have become columns of joined tables, and the joins.
struct Condition {
  std::string text, joins;
  std::vector<std::string> not_stored;  // words that name a metric, where no column has that name
};

/// @param numbers  of the metrics that are stored, by name
Condition condition_of(std::string_view text, const std::map<std::string, int, std::less<>>& numbers) {
  Condition condition;
  std::vector<int> joined;
  // It stands in brackets among others, of which its own may close none.
  constexpr std::string_view one =
      "the condition is not one expression; close every bracket that it opens, and leave comments out";
  std::size_t open = 0;
  for (std::size_t at = 0; at < text.size();) {
    const char c = text[at];
    const std::string_view two = text.substr(at, 2);
    if ((c == ')' && open == 0) || two == "--" || two == "/*") throw Error(std::string(one));
    open += c == '(', open -= c == ')';
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
      const statistics::Metric* metric = statistics::find_metric(word);
      if (const auto stored = numbers.find(metric ? metric->name : word); stored != numbers.end()) {
        const int number = stored->second;
        if (std::ranges::find(joined, number) == joined.end()) {
          joined.push_back(number);
          condition.joins += fmt::format(
              " left join neuron_metrics m{0} on m{0}.neuron = v.id and m{0}.metric = {0}", number);
        }
        condition.text += fmt::format("m{}.value", number);
      } else {
        condition.text += word;
        if (metric) condition.not_stored.emplace_back(word);
      }
      at = end;
    } else {
      condition.text += c;
      ++at;
    }
  }
  if (open) throw Error(std::string(one));
  return condition;
}

}  // namespace

std::vector<NeuronRow> Repository::neurons_where(const std::string& text, std::string_view population) const {
  const Answer known = impl_->guarded([&] { return impl_->database->ask("select name, id from metrics"); });
  std::map<std::string, int, std::less<>> numbers;
  for (const auto& row : known.rows) numbers[text_of(row[0])] = int(number_in(row[1]));
  const Condition condition = condition_of(text, numbers);
  try {
    return impl_->rows(fmt::format("({}) and {}", condition.text, in_population(population)),
                       condition.joins);
  } catch (const Error& error) {
    const std::string why = lower(error.what());
    for (const std::string& word : condition.not_stored)
      if (why.find(lower(word)) != why.npos)
        throw Error(
            fmt::format("the metric {0} is not stored with the neurons; store it with 'brainforest measure "
                        "--repo {1} --metric {0} --store'",
                        statistics::find_metric(word)->name, impl_->place));
    throw;
  }
}

Answer Repository::query(const std::string& question) {
  return impl_->guarded([&] {
    impl_->database->forbid_writing();
    return impl_->database->ask(question);
  });
}

std::vector<NeuronRow> Repository::find(std::string_view name, std::string_view population) const {
  return impl_->rows(is_called("v.name", name) + " and " + in_population(population));
}

std::optional<NeuronRow> Repository::neuron(NeuronId id) const {
  auto rows = impl_->rows(fmt::format("v.id = {}", id.value()));
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
