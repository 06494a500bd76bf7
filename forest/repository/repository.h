// SPDX-License-Identifier: Apache-2.0
// Neurons in a SQL database: who they are, what they look like, where they come from. The database is one
// SQLite file or lies on a PostgreSQL server; docs/repository/schema.md draws its tables, for people who want to ask it in SQL.
//
//   auto repository = Repository::open("cells.db", Access::write);
//   repository.add(morphology, {.name = "cell7", .population = "L5", .provenance = Traced{"cell7.swc",
//   hash}}); for (const NeuronRow& row : repository.neurons("L5")) use(repository.morphology(row.id));
//
// A neuron is stored whole or not at all, whatever happens to the program, and read back exactly as it was
// stored. The same calls in the same order give the same bytes of the file; storing what is already there
// changes none of them. An object belongs to one thread at a time. Several programs may have the same file
// open: who writes waits for the other.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "forest/core/progress.h"
#include "forest/morphology/morphology.h"
#include "forest/repository/answer.h"

namespace forest::statistics {
struct Metric;
}

namespace forest::repository {

using NeuronId = Id<struct NeuronTag>;  // counted from 1, in the order of storing

/// Read out of a file somebody traced.
struct Traced {
  std::string file;  // as the person named it; any bytes
  std::string hash;  // of the file's bytes: hash_hex, core/hash.h; empty when there was no file

  bool operator==(const Traced&) const = default;
};

/// Grown from a grammar: the same grammar, seed and index grow the same neuron again; what grew in an environment, where it asks what
/// is around, in the same one at the same place, which its annotations name (lsystem/grow.h).
struct Grown {
  std::string grammar;       // its name
  std::string grammar_hash;  // what Repository::add_grammar returned
  std::uint64_t seed = 0, index = 0;

  bool operator==(const Grown&) const = default;
};

using Provenance = std::variant<Traced, Grown>;

struct NewNeuron {
  std::string name = {};                                         // unique in its population; see names.h
  std::string population = "default";                            // made on first use; see names.h
  std::string species = {}, region = {}, layer = {}, type = {};  // empty: not known
  Provenance provenance = {};
  /// When another neuron has the name: call this one "name-2", "name-3", … instead of throwing.
  bool number_if_taken = false;
};

struct Added {
  NeuronId id;
  std::string name;
  /// The same source is in the population, perhaps under another name: nothing was changed.
  bool already_there = false;
};

/// One neuron without its points: what `list` shows.
struct NeuronRow {
  NeuronId id;
  std::string name, population, species, region, layer, type;
  std::size_t stems = 0, sections = 0, points = 0, spines = 0;
  double length = 0.;  // µm, of all sections
  Provenance provenance;
  std::string program;  // version of Brain Forest that stored it
};

struct PopulationRow {
  std::string name;
  std::size_t neurons = 0, sections = 0;
  double length = 0.;  // µm
};

/// What is known of a population, in the notation of grammars: declarations that end on `distribution NAME…`.
struct DistributionRow {
  std::string name, population;  // population empty: of none in particular
  std::string text;
  int version = 0;  // of this name and population, counted from 1; an earlier one is never changed

  bool operator==(const DistributionRow&) const = default;
};

using TextsByName = std::vector<std::pair<std::string, std::string>>;

/// A text that grows neurons, to be stored as the next version of its name.
struct NewModel {
  std::string name;             // see names.h
  std::string text;             // a grammar, whole: it is not looked into
  std::string population = {};  // that it describes; empty: that of the version before, or none in particular
  std::string origin = {};      // how it came to be, in words for people: "from pyramidal.lsys"
  /// Its distributions, each a text that stands alone. They are kept as distributions of its population, by the names
  /// "MODEL.NAME" and with versions of their own: those that did not change stay the same.
  TextsByName distributions = {};
};

/// A version of a model as it was stored.
struct ModelRow {
  std::string name, population, origin, hash, text;
  std::string program;                                     // version of Brain Forest that stored it
  int version = 0;                                         // counted from 1; an earlier one is never changed
  std::size_t neurons = 0;                                 // grown from it, in this repository
  std::vector<std::pair<std::string, int>> distributions;  // name ("MODEL.NAME") and version of each, by name
};

/// One tree of a neuron: a root section and everything below it.
struct ArborRow {
  SectionId root;
  SectionKind kind = SectionKind::undefined;
  std::size_t sections = 0, terminals = 0;
  int order = 0;       // the highest centrifugal order in it
  double length = 0.;  // µm
};

/// What a neuron is to be from now on.
struct Revision {
  NeuronId id;
  std::string version;                                           // what Repository::versions() said of it
  std::string name = {};                                         // see names.h
  std::string species = {}, region = {}, layer = {}, type = {};  // empty: not known
  std::optional<Morphology> morphology = {};                     // none: as it is
};

/// Whether store_metrics() takes it: all but `type`, which is a column of neurons anyway.
bool can_store(const statistics::Metric& metric);

enum class Access : std::uint8_t { read, write };

/// A neuron made ready to be stored: its rows, metrics, packed points and checksum. Most of the work of storing one, and
/// it needs no database, so many threads can do it.
class Prepared {
 public:
  explicit Prepared(Morphology morphology);
  ~Prepared();
  Prepared(Prepared&&) noexcept;
  Prepared& operator=(Prepared&&) noexcept;

 private:
  friend class Repository;
  struct Data;
  std::unique_ptr<Data> data_;
};

class Repository {
 public:
  /// Opens the repository at `place`: a path, or a `postgresql://…` address. With Access::write it is
  /// made on first use. Throws InputError when there is none, when the file is something else, newer than
  /// this program, cut off or damaged.
  static Repository open(const std::string& place, Access access);
  ~Repository();
  Repository(Repository&&) noexcept;
  Repository& operator=(Repository&&) noexcept;

  /// Stores one neuron, in a transaction of its own unless one is open. Throws Error when the name is taken
  /// by another neuron, is no name, or the disk is full; then nothing has changed.
  Added add(Prepared prepared, const NewNeuron& neuron);
  Added add(const Morphology& morphology, const NewNeuron& neuron);

  // ── What is known ──

  /// Stores a model as the next version of its name, unless the newest version has this text and population. Returns the
  /// version, and whether it was there. Throws Error when a name is none.
  std::pair<int, bool> add_model(const NewModel& model);
  std::vector<ModelRow> models() const;  // by name and version
  /// Version 0: the newest.
  std::optional<ModelRow> model(std::string_view name, int version = 0) const;
  /// Takes one version out, with its text where no neuron was grown from it and no other version has it, and with the
  /// distributions that were its alone. Other versions keep their numbers; that of the newest is given again. Returns
  /// false when there was none.
  bool remove_model(std::string_view name, int version);

  /// Keeps the text that neurons are grown from and returns the hash Grown::grammar_hash asks for. When no version of the
  /// model has the text it is the next one.
  std::string add_grammar(std::string_view name, std::string_view text,
                          const TextsByName& distributions = {});  // as of a model
  std::optional<std::string> grammar(std::string_view hash) const;

  /// Keeps the text of a distribution as the next version of its name, unless the newest one has just that text; returns
  /// the version. The population is made on first use; "": of none in particular. The text is not looked into.
  int add_distribution(std::string_view name, std::string_view population, std::string_view text);
  std::vector<DistributionRow> distributions() const;  // by population, name and version
  /// Version 0: the newest.
  std::optional<DistributionRow> distribution(std::string_view name, std::string_view population,
                                              int version = 0) const;

  /// Many calls as one transaction, which is what makes thousands of neurons a second:
  ///   auto transaction = repository.begin(); …add…; transaction.commit();
  /// What was not committed when the object goes is undone. Throws Error when another program writes for over
  /// a minute.
  class Transaction;
  [[nodiscard]] Transaction begin();

  std::vector<PopulationRow> populations() const;  // by name
  std::vector<NeuronRow> neurons(
      std::string_view population = "") const;  // in the order of storing; "": of all populations
  /// Those for which a condition in SQL holds, on the columns of the view `neuron` and the names of metrics that are stored:
  ///   "type = 'L5 pyramidal' and total_length > 5000"
  /// Throws Error that says what is not understood.
  std::vector<NeuronRow> neurons_where(const std::string& condition, std::string_view population = "") const;
  std::vector<NeuronRow> find(std::string_view name,
                              std::string_view population = "") const;  // every neuron of that name
  std::optional<NeuronRow> neuron(NeuronId id) const;
  std::vector<ArborRow> arbors(NeuronId id) const;

  /// Equal, bit for bit and with its annotations, to what was stored. Throws Error when there is no such
  /// neuron or its checksum says that it was damaged.
  Morphology morphology(NeuronId id) const;

  /// Keeps metrics of a neuron so that it is found by them: those that are stored with every neuron anew, others besides, until
  /// its points are revised. One value each, of a metric of sections and the like their mean; NaN: none. Throws Error when there
  /// is no such neuron, or the metric is none that can_store().
  void store_metrics(NeuronId id, std::span<const std::pair<const statistics::Metric*, double>> values);

  bool remove(NeuronId id);  // false when there was none

  // ── Correcting ──

  /// A word for each neuron that is another one after anything of it has changed; empty when there is none of that id.
  std::vector<std::string> versions(std::span<const NeuronId> ids) const;

  /// Makes neurons what these say, all or none. They keep id, population and where they come from, so that the same
  /// source is still known to be there; metrics and rows follow the new points. Names may be exchanged. Throws Error when
  /// a neuron is not of that version any more, or a name is none or taken.
  void revise(std::span<const Revision> revisions);

  /// One question in SQL, on the views neuron, section, junction, metric, model, distribution and the tables (docs/repository/schema.md).
  /// From then on this object can only read. Throws Error that says what is not understood.
  Answer query(const std::string& question);

  /// Looks at every byte that matters: the database's own structure, the checksum of every neuron, the hash of every
  /// grammar, and the numbers that follow from it (of its sections, arbors, metrics …), on all cores. Returns one sentence for each thing found; empty
  /// when all is well.
  std::vector<std::string> check(Progress& progress = Progress::none()) const;

 private:
  struct Impl;
  explicit Repository(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

class Repository::Transaction {
 public:
  ~Transaction();
  Transaction(Transaction&& other) noexcept;
  Transaction& operator=(Transaction&&) = delete;
  /// Throws Error when the disk is full, or something in it has failed so that the database undoes it; then nothing of it is
  /// stored.
  void commit();

 private:
  friend class Repository;
  explicit Transaction(Impl& impl);
  Impl* impl_;
};

}  // namespace forest::repository
