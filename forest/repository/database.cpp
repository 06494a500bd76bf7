// SPDX-License-Identifier: Apache-2.0
#include "forest/repository/database.h"

#include <iterator>

#include "forest/core/error.h"
#include "forest/morphology/morphology.h"
#include "forest/repository/schema.h"
#include "forest/repository/stored_metrics.h"
#include "forest/statistics/metric.h"

namespace forest::repository {
namespace {

void run_script(Database& database, std::string_view script) {
  for (std::size_t end; (end = script.find(";\n")) != std::string_view::npos; script.remove_prefix(end + 2))
    if (const std::string sql = database.dialect(script.substr(0, end)); !sql.empty()) database.sql() << sql;
}

void fill_section_kinds(soci::session& sql) {
  for (int kind = 0; kind < 256; ++kind) {
    const std::string name(forest::name_of(SectionKind(kind)));
    if (forest::section_kind(name) == SectionKind(kind))
      sql << "insert into section_kinds (id, name) values (:kind, :name)", soci::use(kind), soci::use(name);
  }
}

void fill_metrics(soci::session& sql) {
  int id = 0;
  for (const statistics::Metric* m : stored_metrics()) {
    const std::string name(m->name), level(statistics::name_of(m->level)), unit(m->unit),
        definition(m->definition);
    sql << "insert into metrics (id, name, level, unit, definition) values (:id, :name, :level, :unit, "
           ":definition)",
        soci::use(++id), soci::use(name), soci::use(level), soci::use(unit), soci::use(definition);
  }
}

}  // namespace

Answer Database::ask(const std::string& question) {
  Answer answer;
  answer.columns = each(question, [&](std::span<Answer::Value> row) {
    answer.rows.emplace_back(std::make_move_iterator(row.begin()), std::make_move_iterator(row.end()));
  });
  return answer;
}

bool is_postgresql(std::string_view place) {
  return place.starts_with("postgresql://") || place.starts_with("postgres://");
}

std::unique_ptr<Database> connect(const std::string& place, bool write, Refill refill) {
  if (is_postgresql(place)) return connect_postgresql(place, write, refill);
  if (is_meant_for_a_server(place))
    throw Error(
        "the repository is neither a file nor the address of a server; write "
        "postgresql://role@host:port/database, with "
        "the password in PGPASSWORD or ~/.pgpass, or ./ before the name of a file that looks like an "
        "address");
  return connect_sqlite(place, write, refill);
}

void migrate(Database& database, int from, Refill refill) {
  for (const Migration& step : migrations) {
    if (step.to <= from) continue;
    run_script(database, step.sql);
    if (step.to == 1) fill_section_kinds(database.sql());
    if (step.to == 8) fill_metrics(database.sql());
  }
  if (from > 0)
    refill(database, from);
  else
    database.sql() << "drop table old_sections";
}

}  // namespace forest::repository
