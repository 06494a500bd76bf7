// SPDX-License-Identifier: Apache-2.0
#include "forest/repository/repository.h"

#include <array>
#include <bit>
#include <cassert>
#include <numeric>
#include <utility>

#include <fmt/format.h>

#include "forest/core/hash.h"
#include "forest/morphology/packing.h"
#include "forest/repository/impl.h"
#include "forest/repository/names.h"
#include "forest/repository/schema.h"

namespace forest::repository {

namespace {

/// Two neurons of a population with the same fingerprint came from the same source. Those of a run are in its order, so that
/// the index of fingerprints grows at its end and not all over.
std::string fingerprint(const Provenance& provenance, std::uint64_t checksum) {
  if (const auto* grown = std::get_if<Grown>(&provenance)) {
    const std::string run = hash_of(fmt::format("{} {}", grown->grammar_hash, grown->seed));
    return fmt::format("{}-{:08x}-{:016x}", run.substr(0, 16), grown->index, checksum);
  }
  const std::string& hash = std::get<Traced>(provenance).hash;
  return hash.empty() ? hash_of(fmt::format("{}", checksum)) : hash;
}

/// That of a grown neuron before version 7.
std::string older_fingerprint(const Grown& grown, std::uint64_t checksum) {
  return hash_of(fmt::format("{} {} {} {}", grown.grammar_hash, grown.seed, grown.index, checksum));
}

}  // namespace

std::string hash_of(std::string_view text) { return hash_hex(std::as_bytes(std::span(text))); }

void check_name(std::string_view what, std::string_view name) {
  if (!is_name(name))
    throw Error(fmt::format("{} is no name for a {}; take 1 to {} bytes of UTF-8 without control characters",
                            shown(name), what, max_name));
}

// What a column of text, or of whole numbers, answered.
std::string text_of(const Answer::Value& value) {
  const auto* text = std::get_if<std::string>(&value);
  return text ? *text : "";
}
std::int64_t number_in(const Answer::Value& value) {
  const auto* number = std::get_if<std::int64_t>(&value);
  return number ? *number : 0;
}

Repository::Repository(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Repository::~Repository() = default;
Repository::Repository(Repository&&) noexcept = default;
Repository& Repository::operator=(Repository&&) noexcept = default;

Repository Repository::open(const std::string& place, Access access) {
  return Repository(std::make_unique<Impl>(place, connect(place, access == Access::write, Impl::refill)));
}

Prepared::Prepared(Morphology morphology) {
  Rows rows = rows_of(morphology);
  std::string points = pack_points(morphology.points(), runs_of(rows));
  const std::uint64_t sum = checksum(rows);
  data_ = std::unique_ptr<Data>(new Data{std::move(morphology), std::move(rows), std::move(points), sum});
}
Prepared::~Prepared() = default;
Prepared::Prepared(Prepared&&) noexcept = default;
Prepared& Prepared::operator=(Prepared&&) noexcept = default;

Added Repository::add(const Morphology& morphology, const NewNeuron& neuron) {
  check_name("neuron", neuron.name);  // before any work
  return add(Prepared(morphology), neuron);
}

Added Repository::add(Prepared prepared, const NewNeuron& neuron) {
  Impl& impl = *impl_;
  check_name("neuron", neuron.name);
  check_name("population", neuron.population);
  Prepared::Data& data = *prepared.data_;
  const std::uint64_t sum = data.sum;

  const auto store = [&]() -> Added {
    if (!impl.insert) impl.insert = std::make_unique<Statements>(*impl.database);
    Statements& insert = *impl.insert;
    insert.fingerprint = fingerprint(neuron.provenance, sum);
    insert.about = neuron;
    for (std::string* text :
         {&insert.about.species, &insert.about.region, &insert.about.layer, &insert.about.type})
      *text = escaped(*text);
    insert.rows = std::move(data.rows);
    insert.packed_points = std::move(data.packed_points);
    insert.checksum = std::bit_cast<long long>(sum);
    if (data.morphology.sections().size() >> section_bits)
      throw Error(fmt::format("{} has more than {} sections, which no repository holds", shown(neuron.name),
                              (1 << section_bits) - 1));
    const auto* grown = std::get_if<Grown>(&neuron.provenance);
    if (grown) {
      const auto grammar = impl.grammar(*grown);
      if (!grammar)
        throw Error(fmt::format(
            "the grammar {} of neuron {} is not in the repository; store it with add_grammar first",
            shown(grown->grammar), shown(neuron.name)));
      insert.grammar = *grammar;
    }
    insert.population = impl.population(neuron.population);
    const auto stored_as = [&](const std::string& fingerprint) -> std::optional<Added> {
      const std::string same = "from neurons where population = :population and fingerprint = :fingerprint";
      const auto id = impl.ask<int>("select id " + same, insert.population, fingerprint);
      if (!id) return std::nullopt;
      return Added{NeuronId(std::size_t(*id)),
                   *impl.ask<std::string>("select name " + same, insert.population, fingerprint), true};
    };
    if (grown && impl.holds_older_grown())
      if (const auto there = stored_as(older_fingerprint(*grown, sum))) return *there;
    insert.name = neuron.name;
    for (;;) {
      insert.id = impl.database->next_id("neurons");
      if (insert.run(data.morphology)) return Added{NeuronId(std::size_t(insert.id)), insert.name, false};
      if (const auto there = stored_as(insert.fingerprint)) return *there;
      const auto other =
          impl.ask<int>("select id from neurons where population = :population and name = :name",
                        insert.population, insert.name);
      if (!other) continue;  // it was removed since
      if (!neuron.number_if_taken)
        throw Error(
            fmt::format("another neuron of population {} is called {}; choose another name or population",
                        shown(neuron.population), shown(neuron.name)));
      insert.name = fmt::format("{}-{}", neuron.name, impl.next_number(insert.population, neuron.name));
    }
  };
  return impl.write(store, false);  // it asks for no metrics
}

Repository::Transaction Repository::begin() {
  if (impl_->writing) throw Error(impl_->place + ": a transaction is open already; commit it first");
  impl_->guarded([&] { impl_->begin_writing(); });
  return Transaction(*impl_);
}

Repository::Transaction::Transaction(Impl& impl) : impl_(&impl) {}
Repository::Transaction::Transaction(Transaction&& other) noexcept
    : impl_(std::exchange(other.impl_, nullptr)) {}

Repository::Transaction::~Transaction() {
  if (impl_) impl_->undo();
}

void Repository::Transaction::commit() {
  assert(impl_);
  Impl& impl = *impl_;
  impl.guarded([&] {
    if (impl.failed || impl.database->is_undone())
      throw Error(impl.place + ": the transaction has failed and is undone; begin another");
    impl.settle();
    impl.sql << "commit";  // when this throws, the destructor undoes
  });
  impl.writing = false;
  impl_ = nullptr;
}

void Repository::Impl::undo() noexcept {
  try {
    sql << "rollback";
  } catch (const std::exception&) {  // the database has done so already
  }
  insert.reset();  // a statement that failed is not used again
  known_population = {}, known_hash = {};
  writing = failed = false;
}

std::string Repository::Impl::bytes(const char* question, const char* column, int id) const {
  const bool text = database->as_text();
  const std::string query =
      fmt::format(fmt::runtime(question), text ? fmt::format("encode({}, 'hex')", column) : column);
  if (text) return from_hexadecimal(ask<std::string>(query, id).value_or(""));
  soci::blob blob(sql);
  soci::indicator filled = soci::i_null;
  sql << query, into(blob, filled), use(id);
  std::string result(filled == soci::i_ok ? blob.get_len() : 0, '\0');
  if (!result.empty()) blob.read(0, result.data(), result.size());
  return result;
}

int Repository::Impl::population(const std::string& name) {
  if (name == known_population.first) return known_population.second;
  const std::string find = "select id from populations where name = :name";
  auto number = ask<int>(find, name);
  if (!number) {
    const int id = database->next_id("populations");
    sql << "insert into populations (id, name) values (:id, :name) on conflict do nothing", use(id),
        use(name);
    number = ask<int>(find, name);  // another program may have been quicker
  }
  known_population = {name, *number};
  return *number;
}

int Repository::Impl::next_number(int population, const std::string& name) {
  int& last = last_numbers.try_emplace({population, name}, 1).first->second;
  last = *ask<int>(
      "with recursive taken (number) as (select cast(:next as integer) union all select number + 1 from "
      "taken where exists (select 1 from neurons where population = :population and name = cast(:name as "
      "text) || '-' || cast(number as text))) select max(number) from taken",
      last + 1, population, name);
  return last;
}

std::optional<int> Repository::Impl::grammar(const Grown& grown) {
  if (grown.grammar_hash == known_hash && grown.grammar == known_grammar.first) return known_grammar.second;
  const auto number = ask<int>("select id from grammars where hash = :hash and name = :name",
                               grown.grammar_hash, grown.grammar);
  if (number) known_hash = grown.grammar_hash, known_grammar = {grown.grammar, *number};
  return number;
}

bool Repository::Impl::holds_older_grown() {
  if (!older_grown)
    older_grown = ask<int>(
                      "select 1 from neurons n join provenance o on o.neuron = n.id where o.origin = "
                      "'grown' and n.fingerprint not like '%-%' limit 1")
                      .has_value();
  return *older_grown;
}

Rows Repository::Impl::stored(NeuronId id, const char* points, const std::string& from) const {
  const int neuron = number_of(id);
  const auto count = [&](const char* table) {
    return std::size_t(
        ask<int>(fmt::format("select count(*) from {} where neuron = :id", table), neuron).value_or(0));
  };
  Rows rows;
  const auto known =
      soma_kind(ask<std::string>("select kind from somata where neuron = :id", neuron).value_or(""));
  if (!known) throw Error("its soma is of no known kind");
  rows.soma_kind = *known;
  rows.soma_points = bytes("select {} from somata where neuron = :id", "points", neuron);
  rows.soma_links = bytes("select {} from somata where neuron = :id", "links", neuron);
  rows.points = bytes("select {} from points where neuron = :id", "data", neuron);

  if (const auto n = std::size_t(
          ask<int>("select coalesce(max(sections), 0) from neurons where id = :id", neuron).value_or(0))) {
    auto& s = rows.sections;
    for (auto* column : {&s.parent, &s.kind, &s.tag, &s.soma_point, &s.point_count}) column->resize(room(n));
    sql << fmt::format("select coalesce(parent, -1), kind, tag, soma_point, {} from {}", points, from),
        into(s.parent), into(s.kind), into(s.tag), into(s.soma_point), into(s.point_count);
    if (s.size() != n) throw Error("sections are missing");
    s.first_point.resize(n);
    std::exclusive_scan(s.point_count.begin(), s.point_count.end(), s.first_point.begin(), 0);
  }
  if (const int packing = ask<int>("select packing from points where neuron = :id", neuron).value_or(0)) {
    const auto whole = unpack_points(rows.points, packing < 2 ? PointRuns() : runs_of(rows));
    rows.points.assign(reinterpret_cast<const char*>(whole.data()), whole.size() * sizeof(Point));
  }
  if (const std::size_t n = count("spines")) {
    Ints section(room(n)), shape(room(n));
    std::array<Reals, 6> v;
    for (Reals& column : v) column.resize(room(n));
    sql << "select section, position, head_x, head_y, head_z, head_diameter, neck_diameter, shape from "
           "spines where neuron = :id "
           "order by number",
        into(section), into(v[0]), into(v[1]), into(v[2]), into(v[3]), into(v[4]), into(v[5]), into(shape),
        use(neuron);
    for (std::size_t i = 0; i < section.size(); ++i)
      rows.spines.push_back({.section = SectionId(std::size_t(section[i])),
                             .position = float(v[0][i]),
                             .head = {float(v[1][i]), float(v[2][i]), float(v[3][i])},
                             .head_diameter = float(v[4][i]),
                             .neck_diameter = float(v[5][i]),
                             .shape = SpineShape(shape[i])});
  }
  if (const std::size_t n = count("annotations")) {
    std::vector<std::string> name(room(n)), value(room(n));
    sql << "select name, value from annotations where neuron = :id order by number", into(name), into(value),
        use(neuron);
    for (std::size_t i = 0; i < name.size(); ++i)
      rows.annotations.emplace_back(unescaped(name[i]), unescaped(value[i]));
  }
  return rows;
}

Morphology Repository::morphology(NeuronId id) const {
  const int neuron = number_of(id);
  std::string name;
  const auto damaged = [&](std::string_view why) {
    return InputError(
        impl_->place, 0,
        fmt::format("neuron {} (id {}) is damaged ({}); take it out with 'brainforest remove' and "
                    "import or grow it again",
                    shown(name), neuron, why));
  };
  std::optional<long long> sum;
  const Rows rows = impl_->read([&] {
    sum = impl_->ask<long long>("select checksum from neurons where id = :id", neuron);
    if (!sum)
      throw Error(fmt::format("{}: there is no neuron {}; brainforest list shows those that are there",
                              impl_->place, neuron));
    name = impl_->ask<std::string>("select name from neurons where id = :id", neuron).value_or("");
    try {
      return impl_->stored(id, "points", of_sections(neuron) + " order by id");
    } catch (const InputError&) {
      throw;
    } catch (const Error& error) {
      throw damaged(error.what());
    }
  });
  if (std::bit_cast<std::uint64_t>(*sum) != checksum(rows))
    throw damaged("its checksum is not that of its points and sections");
  try {
    return morphology_of(rows);
  } catch (const Error& error) {
    throw damaged(error.what());
  }
}

bool Repository::remove(NeuronId id) {
  return impl_->write([&] {
    const int neuron = number_of(id);
    if (!impl_->ask<int>("select id from neurons where id = :id", neuron)) return false;
    for (const char* table : {"provenance", "somata", "arbors", "points", "spines", "annotations"})
      impl_->sql << fmt::format("delete from {} where neuron = :id", table), use(neuron);
    impl_->sql << "delete from " + of_sections(neuron);
    impl_->sql << "delete from " + of_metrics(neuron);
    impl_->sql << "delete from neurons where id = :id", use(neuron);
    impl_->last_numbers.clear();
    return true;
  });
}

}  // namespace forest::repository
