// SPDX-License-Identifier: Apache-2.0
#include "forest/repository/repository.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <map>
#include <numeric>
#include <span>
#include <tuple>
#include <unordered_map>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <soci/soci.h>

#include "forest/core/error.h"
#include "forest/core/hash.h"
#include "forest/core/parallel.h"
#include "forest/repository/database.h"
#include "forest/repository/insert.h"
#include "forest/repository/names.h"
#include "forest/repository/packing.h"
#include "forest/repository/rows.h"
#include "forest/repository/schema.h"
#include "forest/statistics/metric.h"

namespace forest::repository {
namespace {

using soci::into;
using soci::use;

/// How long the vectors must be that receive `count` rows. SOCI 4.0 leaves a vector of length 1 unfilled when
/// the question has a parameter; it shortens longer ones to the number of rows that came.
std::size_t room(std::size_t count) { return count + 2; }

int number_of(NeuronId id) { return int(id.value()); }

/// Sections of a neuron are those from its first to before the next one's.
long long first_section(long long neuron) { return neuron << section_bits; }
std::string of_sections(long long neuron) {
  return fmt::format("sections where id >= {} and id < {}", first_section(neuron), first_section(neuron + 1));
}

/// One look-up a metric: the table is in the order of metrics.
std::string of_metrics(long long neuron) {
  return fmt::format("neuron_metrics where metric in (select id from metrics) and neuron = {}", neuron);
}

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

/// Two neurons of a population with the same fingerprint came from the same source.
std::string fingerprint(const Provenance& provenance, std::uint64_t checksum) {
  if (const auto* grown = std::get_if<Grown>(&provenance))
    return hash_of(fmt::format("{} {} {} {}", grown->grammar_hash, grown->seed, grown->index, checksum));
  const std::string& hash = std::get<Traced>(provenance).hash;
  return hash.empty() ? hash_of(fmt::format("{}", checksum)) : hash;
}

/// The statements that store one neuron, prepared once, with the variables they are bound to.
class Statements {
 public:
  explicit Statements(Database& database)
      : neuron_(database, "neurons"),
        provenance_(database, "provenance"),
        soma_(database, "somata"),
        points_(database, "points"),
        arbors_(database, "arbors"),
        sections_(database, "sections"),
        metrics_(database, "neuron_metrics"),
        spines_(database, "spines"),
        annotations_(database, "annotations") {
    neuron_.with("id", id).with("population", population).with("name", name).with("fingerprint", fingerprint);
    neuron_.with("species", about.species).with("region", about.region).with("layer", about.layer);
    neuron_.with("type", about.type).with("stems", stems_).with("sections", section_count_);
    neuron_.with("points", point_count_).with("spines", spine_count_).with("length", length_);
    neuron_.with("checksum", checksum);
    const auto unless_traced = [this](std::size_t) {
      return !std::holds_alternative<Traced>(about.provenance);
    };
    const auto unless_grown = [this](std::size_t) {
      return !std::holds_alternative<Grown>(about.provenance);
    };
    provenance_.with("neuron", id).with("origin", origin_).with("source_file", file_, unless_traced);
    provenance_.with("source_hash", hash_, unless_traced).with("grammar", grammar, unless_grown);
    provenance_.with("seed", seed_, unless_grown).with("number", index_, unless_grown);
    provenance_.with("program", program_);
    soma_.with("neuron", id).with("kind", soma_kind_).with("x", sphere_[0]).with("y", sphere_[1]);
    soma_.with("z", sphere_[2]).with("radius", sphere_[3]).with("area", area_);
    soma_.with_bytes("points", rows.soma_points).with_bytes("links", rows.soma_links);
    points_.with("neuron", id).with_bytes("data", data_).with("packing", packing_);
    const auto& a = rows.arbors;
    arbors_.with("neuron", id).with("number", numbers_).with("root", a.root).with("kind", a.kind);
    arbors_.with("sections", a.sections).with("terminals", a.terminals).with("max_order", a.order);
    arbors_.with("length", a.length);
    const auto& s = rows.sections;
    sections_.with("id", section_ids_);
    sections_.with("parent", s.parent, [&s](std::size_t row) { return s.parent[row] < 0; });
    sections_.with("arbor", s.arbor).with("branch_order", s.order).with("kind", s.kind).with("tag", s.tag);
    sections_.with("soma_point", s.soma_point).with("points", s.point_count).with("daughters", s.daughters);
    sections_.with("length", s.length).with("area", s.area).with("start_diameter", s.start_diameter);
    sections_.with("end_diameter", s.end_diameter).with("end_x", s.end_x).with("end_y", s.end_y);
    sections_.with("end_z", s.end_z);
    metrics_.with("neuron", id).with("metric", rows.metric).with("value", rows.metric_value);
    spines_.with("neuron", id).with("number", numbers_).with("section", spine_section_);
    constexpr const char* spine_columns[] = {"position", "head_x",        "head_y",
                                             "head_z",   "head_diameter", "neck_diameter"};
    for (std::size_t i = 0; i < spine_.size(); ++i) spines_.with(spine_columns[i], spine_[i]);
    spines_.with("shape", spine_shape_);
    annotations_.with("neuron", id).with("number", numbers_).with("name", key_).with("value", value_);
  }
  Statements(const Statements&) = delete;  // its parts point at one another

  // What the caller sets before run().
  int id = 0, population = 0, grammar = 0;
  std::string name, fingerprint;
  NewNeuron about;
  Rows rows;
  std::string packed_points;  // empty: as in rows
  long long checksum = 0;

  /// False when the population has the name or the fingerprint by now, from another program.
  bool run(const Morphology& m) {
    fill(m);
    if (!neuron_.run()) return false;
    provenance_.run();
    soma_.run();
    run_shape();
    run(spines_, rows.spines.size());
    run(annotations_, rows.annotations.size());
    return true;
  }

  /// What the tables hold otherwise than this neuron, of all that follows from its points: "length of sections is 1 in row 2,
  /// not 14.5", and how much more there is. Empty when nothing is.
  std::string deviation(Database& database, const Morphology& m) {
    fill(m), fill_shape();
    number(std::max(rows.arbors.size(), rows.spines.size()));
    struct Part {
      const Insert& insert;
      std::size_t rows;
      std::string from;
      std::string_view columns = {};  // all when empty, the others are no numbers of the shape
    };
    const auto of = [&](const char* table, const char* order) {
      return fmt::format("{} where neuron = {}{}", table, id, order);
    };
    std::string first;
    std::size_t more = 0;
    for (const Part& part :
         {Part{neuron_, 1, fmt::format("neurons where id = {}", id), " stems sections points spines length "},
          Part{soma_, 1, of("somata", "")},
          Part{arbors_, rows.arbors.size(), of("arbors", " order by number")},
          Part{sections_, rows.sections.size(), of_sections(id) + " order by id"},
          Part{metrics_, rows.metric.size(), of_metrics(id) + " order by metric"},
          Part{spines_, rows.spines.size(), of("spines", " order by number")}}) {
      std::vector<const InsertColumn*> columns;
      std::vector<std::string_view> names;
      for (const InsertColumn& c : part.insert.columns())
        if (!c.bytes &&
            (part.columns.empty() || part.columns.find(fmt::format(" {} ", c.name)) != part.columns.npos))
          columns.push_back(&c), names.emplace_back(c.name);
      const Answer answer = database.ask(fmt::format("select {} from {}", fmt::join(names, ", "), part.from));
      if (answer.rows.size() != part.rows) {
        if (first.empty())
          first = fmt::format("{} has {} rows, not {}", part.insert.table(), answer.rows.size(), part.rows);
        ++more;
        continue;
      }
      for (std::size_t row = 0; row < part.rows; ++row)
        for (std::size_t c = 0; c < columns.size(); ++c) {
          const Answer::Value &stored = answer.rows[row][c], expected = value_of(*columns[c], row);
          if (same(stored, expected)) continue;
          if (first.empty())
            first = fmt::format("{} of {} is {} in row {}, not {}", names[c], part.insert.table(),
                                shown(stored), row, shown(expected));
          ++more;
        }
    }
    return more > 1 ? fmt::format("{}, and {} more values", first, more - 1) : first;
  }

  /// What version 2 of the tables keeps otherwise than version 1: points, sections, metrics.
  void run_shape() {
    fill_shape();
    if (!data_.empty()) points_.run();
    run(arbors_, rows.arbors.size());
    sections_.run(rows.sections.size());
    metrics_.run(rows.metric.size());
  }

 private:
  /// A table with `count` rows of this neuron.
  void run(Insert& insert, std::size_t count) {
    number(count);
    insert.run(count);
  }
  void number(std::size_t count) {
    for (std::size_t i = numbers_.size(); i < count; ++i) numbers_.push_back(int(i));
  }

  static Answer::Value value_of(const InsertColumn& column, std::size_t row) {
    if (column.is_null && column.is_null(row)) return {};
    const auto value = []<class T>(const T& v) -> Answer::Value {
      if constexpr (std::is_integral_v<T>)
        return std::int64_t(v);
      else
        return v;
    };
    return std::visit(
        [&]<class T>(const T* v) {
          if constexpr (requires { typename T::allocator_type; } && !std::is_same_v<T, std::string>)
            return value((*v)[row]);
          else
            return value(*v);
        },
        column.values);
  }
  /// Sums of another compiler's order may differ in their last digits.
  static bool same(const Answer::Value& a, const Answer::Value& b) {
    const double *x = std::get_if<double>(&a), *y = std::get_if<double>(&b);
    if (!x || !y) return a == b;
    return *x == *y || std::abs(*x - *y) <= 1e-9 * std::max({1., std::abs(*x), std::abs(*y)});
  }
  static std::string shown(const Answer::Value& value) {
    return std::visit(
        []<class T>(const T& v) -> std::string {
          if constexpr (std::is_same_v<T, std::monostate>)
            return "nothing";
          else
            return fmt::format("{}", v);
        },
        value);
  }

  void fill(const Morphology& m) {
    stems_ = int(m.roots().size());
    section_count_ = int(m.sections().size());
    point_count_ = int(m.points().size());
    spine_count_ = int(m.spines().size());
    length_ = 0.;
    for (const double length : rows.arbors.length) length_ += length;

    const auto* traced = std::get_if<Traced>(&about.provenance);
    const auto* grown = std::get_if<Grown>(&about.provenance);
    origin_ = traced ? "traced" : "grown";
    if (traced) file_ = escaped(traced->file), hash_ = escaped(traced->hash);
    if (grown) seed_ = std::bit_cast<long long>(grown->seed), index_ = std::bit_cast<long long>(grown->index);

    const Point sphere = m.soma().sphere();
    soma_kind_ = name_of(rows.soma_kind);
    sphere_ = {sphere.x, sphere.y, sphere.z, sphere.radius};
    area_ = m.soma().area();

    spine_section_.clear(), spine_shape_.clear();
    for (Reals& column : spine_) column.clear();
    for (const Spine& s : rows.spines) {
      const std::array<float, 6> numbers{s.position, s.head.x(),      s.head.y(),
                                         s.head.z(), s.head_diameter, s.neck_diameter};
      for (std::size_t i = 0; i < 6; ++i) spine_[i].push_back(numbers[i]);
      spine_section_.push_back(int(s.section.value()));
      spine_shape_.push_back(int(s.shape));
    }

    key_.clear(), value_.clear();
    for (const auto& [key, value] : rows.annotations)
      key_.push_back(escaped(key)), value_.push_back(escaped(value));
  }

  void fill_shape() {
    packing_ = packed_points.empty() ? 0 : 1;
    data_ = packing_ ? packed_points : rows.points;
    section_ids_.resize(rows.sections.size());
    std::iota(section_ids_.begin(), section_ids_.end(), first_section(id));
  }

  int stems_ = 0, section_count_ = 0, point_count_ = 0, spine_count_ = 0, packing_ = 0;
  double length_ = 0., area_ = 0.;
  std::string origin_, file_, hash_, program_ = FOREST_VERSION, soma_kind_, data_;
  long long seed_ = 0, index_ = 0;
  std::array<double, 4> sphere_{};
  Ints numbers_, spine_section_, spine_shape_;
  Longs section_ids_;
  std::array<Reals, 6> spine_;
  Texts key_, value_;
  Insert neuron_, provenance_, soma_, points_, arbors_, sections_, metrics_, spines_, annotations_;
};

}  // namespace

struct Repository::Impl {
  std::string place;
  std::shared_ptr<Database> database;
  soci::session& sql;
  std::unique_ptr<Statements> insert;  // prepared on first use
  bool writing = false;                // a transaction is open
  bool failed = false;                 // and cannot be committed any more
  // Those last stored under: thousands of neurons have the same.
  std::pair<std::string, int> known_population, known_grammar;
  std::string known_hash;

  Impl(const std::string& at, std::shared_ptr<Database> open)
      : place(at), database(std::move(open)), sql(database->sql()) {}

  /// What an earlier version stored, with what this one knows of it besides.
  static void refill(Database& database, int from) {
    Impl impl("", std::shared_ptr<Database>(std::shared_ptr<void>(), &database));
    if (from < 3) impl.refill_shapes();
    impl.refill_grammars();
  }

  /// Before version 3 a section was named by two numbers, before version 2 points were not packed.
  void refill_shapes() {
    Statements all(*database);
    std::vector<int> ids(room(std::size_t(ask<int>("select count(*) from neurons").value_or(0))));
    sql << "select id from neurons order by id", into(ids);
    for (const int id : ids) {
      const Morphology m =
          morphology_of(stored(NeuronId(std::size_t(id)), "point_count",
                               fmt::format("old_sections where neuron = {} order by number", id)));
      for (const char* table : {"points", "arbors"})
        sql << fmt::format("delete from {} where neuron = {}", table, id);
      sql << "delete from " + of_metrics(id);
      all.id = id;
      all.rows = rows_of(m);
      all.packed_points = packed(m.points());
      all.run_shape();
    }
    sql << "drop table old_sections";
  }

  /// Before version 4 the text of a grammar was one line.
  void refill_grammars() {
    std::vector<int> ids(room(std::size_t(ask<int>("select count(*) from grammars").value_or(0))));
    sql << "select id from grammars order by id", into(ids);
    for (const int id : ids) {
      const std::string text = escaped_lines(
          unescaped(ask<std::string>("select text from grammars where id = :id", id).value_or("")));
      sql << "update grammars set text = :text where id = :id", use(text), use(id);
    }
  }

  /// Calls `body`; errors of the database become sentences.
  template <class Body>
  auto guarded(Body&& body) const {
    try {
      return body();
    } catch (...) {
      database->rethrow(place);
      throw;  // not reached: compilers do not believe it of a virtual function
    }
  }

  void undo() noexcept {
    try {
      sql << "rollback";
    } catch (const std::exception&) {  // the database has done so already
    }
    insert.reset();  // a statement that failed is not used again
    known_population = {}, known_hash = {};
    writing = failed = false;
  }

  /// Calls `body` in the open transaction or one of its own; one of its own is committed, or undone when
  /// `body` throws.
  template <class Body>
  auto write(Body&& body) {
    return guarded([&] {
      if (writing) {
        if (failed) throw Error(place + ": the open transaction has failed before; begin another");
        try {
          return body();
        } catch (const soci::soci_error&) {
          failed = true;
          throw;
        }
      }
      database->begin_writing();
      writing = true;
      try {
        auto result = body();
        sql << "commit";
        writing = false;
        return result;
      } catch (...) {
        undo();
        throw;
      }
    });
  }

  /// Calls `body`, whose questions all see the same state of the database.
  template <class Body>
  auto read(Body&& body) const {
    return guarded([&] {
      struct End {
        soci::session* sql;
        ~End() {
          try {
            if (sql) *sql << "commit";
          } catch (const std::exception&) {
          }
        }
      };
      if (!writing) database->begin_reading();
      const End end{writing ? nullptr : &sql};
      return body();
    });
  }

  template <class T, class... Values>
  std::optional<T> ask(const std::string& query, const Values&... values) const {
    T result{};
    soci::indicator filled = soci::i_ok;
    soci::statement statement(sql);
    statement.exchange(into(result, filled));
    (statement.exchange(use(values)), ...);
    statement.alloc();
    statement.prepare(query);
    statement.define_and_bind();
    if (!statement.execute(true) || filled == soci::i_null) return std::nullopt;
    return result;
  }

  /// Bytes in a column, by a question with one {} for it and one parameter.
  std::string bytes(const char* question, const char* column, int id) const {
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

  /// The number of a population, which is made when there is none.
  int population(const std::string& name) {
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

  std::optional<int> grammar(const Grown& grown) {
    if (grown.grammar_hash == known_hash && grown.grammar == known_grammar.first) return known_grammar.second;
    const auto number = ask<int>("select id from grammars where hash = :hash and name = :name",
                                 grown.grammar_hash, grown.grammar);
    if (number) known_hash = grown.grammar_hash, known_grammar = {grown.grammar, *number};
    return number;
  }

  int keep_grammar(const std::string& name, std::string_view text);  // its id
  /// The id and version of a distribution of a population, by its id or 0.
  std::pair<int, int> keep_distribution(const std::string& name, int population, std::string_view text);
  struct Version {
    int id, number;
    bool already_there;
  };
  /// A new version, unless the newest (with `anew`) or any has this grammar.
  Version keep_model(const std::string& name, int grammar, int population, const std::string& origin,
                     bool anew);
  /// Links a version to its distributions, if it has none yet.
  void keep_distributions(int model, const std::string& name, const TextsByName& distributions);

  std::vector<NeuronRow> rows(const std::string& where, const std::string& text1, const std::string& text2,
                              int id) const;
  /// The rows of one neuron; `points` and `from` tell where its sections stand, which differs between versions.
  Rows stored(NeuronId id, const char* points, const std::string& from) const;
  /// What is wrong with these neurons, at most a sentence each.
  std::vector<std::string> findings(const Repository& repository, std::span<const NeuronRow> neurons) const;
};

Repository::Repository(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Repository::~Repository() = default;
Repository::Repository(Repository&&) noexcept = default;
Repository& Repository::operator=(Repository&&) noexcept = default;

Repository Repository::open(const std::string& place, Access access) {
  return Repository(std::make_unique<Impl>(place, connect(place, access == Access::write, Impl::refill)));
}

struct Prepared::Data {
  Morphology morphology;
  Rows rows;
  std::string packed_points;
  std::uint64_t sum;
};

Prepared::Prepared(Morphology morphology) {
  Rows rows = rows_of(morphology);
  std::string points = packed(morphology.points());
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

  return impl.write([&] {
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
    insert.population = impl.population(neuron.population);
    if (const auto* grown = std::get_if<Grown>(&neuron.provenance)) {
      const auto grammar = impl.grammar(*grown);
      if (!grammar)
        throw Error(fmt::format(
            "the grammar {} of neuron {} is not in the repository; store it with add_grammar first",
            shown(grown->grammar), shown(neuron.name)));
      insert.grammar = *grammar;
    }
    insert.name = neuron.name;
    for (int number = 2;;) {
      insert.id = impl.database->next_id("neurons");
      if (insert.run(data.morphology)) return Added{NeuronId(std::size_t(insert.id)), insert.name, false};
      const std::string same = "from neurons where population = :population and fingerprint = :fingerprint";
      if (const auto there = impl.ask<int>("select id " + same, insert.population, insert.fingerprint))
        return Added{NeuronId(std::size_t(*there)),
                     *impl.ask<std::string>("select name " + same, insert.population, insert.fingerprint),
                     true};
      const auto other =
          impl.ask<int>("select id from neurons where population = :population and name = :name",
                        insert.population, insert.name);
      if (!other) continue;  // it was removed since
      if (!neuron.number_if_taken)
        throw Error(
            fmt::format("another neuron of population {} is called {}; choose another name or population",
                        shown(neuron.population), shown(neuron.name)));
      insert.name = fmt::format("{}-{}", neuron.name, number++);
    }
  });
}

// ── What is known ──

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

Repository::Transaction Repository::begin() {
  if (impl_->writing) throw Error(impl_->place + ": a transaction is open already; commit it first");
  impl_->guarded([&] { impl_->database->begin_writing(); });
  impl_->writing = true;
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
    if (impl.failed) throw Error(impl.place + ": the transaction has failed and is undone; begin another");
    impl.sql << "commit";  // when this throws, the destructor undoes
  });
  impl.writing = false;
  impl_ = nullptr;
}

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
  if (ask<int>("select packing from points where neuron = :id", neuron).value_or(0)) {
    const std::vector<Point> unpacked_points = unpacked(rows.points);
    rows.points.assign(reinterpret_cast<const char*>(unpacked_points.data()),
                       unpacked_points.size() * sizeof(Point));
  }

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
    return true;
  });
}

// ── Correcting ──

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

std::vector<std::string> Repository::Impl::findings(const Repository& repository,
                                                    std::span<const NeuronRow> neurons) const {
  std::vector<std::string> findings(neurons.size());
  std::vector<std::optional<Morphology>> whole(neurons.size());
  for (std::size_t i = 0; i < neurons.size(); ++i) try {
      whole[i] = repository.morphology(neurons[i].id);
    } catch (const Error& error) {
      findings[i] = error.what();
    }
  std::vector<Rows> expected(neurons.size());
  parallel_for(neurons.size(), 1, [&](std::size_t i) {
    if (whole[i]) expected[i] = rows_of(*whole[i]);
  });
  const auto known = read([&] { return ask<int>("select count(*) from metrics").value_or(0); });
  Statements statements(*database);
  for (std::size_t i = 0; i < neurons.size(); ++i) {
    if (!whole[i]) continue;
    Rows& rows = statements.rows = std::move(expected[i]);
    for (; !rows.metric.empty() && rows.metric.back() > known;
         rows.metric.pop_back())  // this program knows more
      rows.metric_value.pop_back();
    statements.id = number_of(neurons[i].id);
    if (const std::string why = read([&] { return statements.deviation(*database, *whole[i]); });
        !why.empty())
      findings[i] = fmt::format(
          "{}: neuron {} (id {}) is not what its points say ({}); take it out with 'brainforest remove' and "
          "import or "
          "grow it again",
          place, shown(neurons[i].name), statements.id, why);
  }
  std::erase(findings, "");
  return findings;
}

std::vector<std::string> Repository::check(Progress& progress) const {
  std::vector<std::string> findings;
  try {
    impl_->guarded([&] {
      for (const std::string& finding : impl_->database->examine_structure())
        findings.push_back(fmt::format("{}: {}", impl_->place, finding));
    });
    for (const ModelRow& model : models())
      if (hash_of(model.text) != model.hash)
        findings.push_back(fmt::format(
            "{}: the text of model {} (version {}) is damaged; restore the repository from a backup",
            impl_->place, shown(model.name), model.version));
    const auto rows = neurons();
    progress.begin("checking", rows.size());
    constexpr std::size_t together = 64;  // on all cores
    for (std::size_t first = 0; first < rows.size(); first += together) {
      const auto some = std::span(rows).subspan(first, std::min(together, rows.size() - first));
      for (std::string& finding : impl_->findings(*this, some)) findings.push_back(std::move(finding));
      progress.advance(some.size());
    }
    progress.end();
  } catch (const Error& error) {
    findings.emplace_back(error.what());
  }
  return findings;
}

}  // namespace forest::repository
