// SPDX-License-Identifier: Apache-2.0
// Repositories of earlier versions, brought up to date where SQL alone does not do it (schema.h).
#include <algorithm>
#include <optional>
#include <span>

#include <fmt/format.h>

#include "forest/core/parallel.h"
#include "forest/morphology/packing.h"
#include "forest/repository/impl.h"
#include "forest/repository/names.h"

namespace forest::repository {

void Repository::Impl::refill(Database& database, int from) {
  Impl impl("", std::shared_ptr<Database>(std::shared_ptr<void>(), &database));
  if (from < 3) impl.refill_shapes();
  if (from < 4) impl.refill_grammars();
  if (from >= 3 && from < 8) impl.refill_metrics();
}

/// Before version 3 a section was named by two numbers, before version 2 points were not packed.
void Repository::Impl::refill_shapes() {
  Statements all(*database);
  std::vector<int> ids(room(std::size_t(ask<int>("select count(*) from neurons").value_or(0))));
  sql << "select id from neurons order by id", into(ids);
  for (const int id : ids) {
    const Morphology m =
        morphology_of(stored(NeuronId(std::size_t(id)), "point_count",
                             fmt::format("old_sections where neuron = {} order by number", id)));
    for (const char* table : {"points", "arbors"})
      sql << fmt::format("delete from {} where neuron = {}", table, id);
    all.id = id;
    all.rows = rows_of(m);
    all.packed_points = pack_points(m.points(), runs_of(all.rows));
    all.run_shape();
  }
  all.finish();
  sql << "drop table old_sections";
}

/// Before version 8 fewer metrics were stored. (Before version 3 the shapes that were stored anew brought theirs.)
void Repository::Impl::refill_metrics() {
  Statements all(*database);
  std::vector<int> ids(room(std::size_t(ask<int>("select count(*) from neurons").value_or(0))));
  sql << "select id from neurons order by id", into(ids);
  constexpr std::size_t together = 64;  // on all cores
  for (std::size_t first = 0; first < ids.size(); first += together) {
    const auto some = std::span(ids).subspan(first, std::min(together, ids.size() - first));
    std::vector<std::optional<Rows>> rows(some.size());
    for (std::size_t i = 0; i < some.size(); ++i) try {
        rows[i] = stored(NeuronId(std::size_t(some[i])), "points", of_sections(some[i]) + " order by id");
      } catch (const Error&) {  // damaged: it stays as it is, without metrics, and who reads it is told
      }
    parallel_for(some.size(), 1, [&](std::size_t i) {
      if (rows[i]) try {
          rows[i] = rows_of(morphology_of(*rows[i]));
        } catch (const Error&) {
          rows[i].reset();
        }
    });
    for (std::size_t i = 0; i < some.size(); ++i) {
      if (!rows[i]) continue;
      all.id = some[i];
      all.rows = std::move(*rows[i]);
      all.run_metrics();
    }
  }
  all.finish();
}

/// Before version 4 the text of a grammar was one line.
void Repository::Impl::refill_grammars() {
  std::vector<int> ids(room(std::size_t(ask<int>("select count(*) from grammars").value_or(0))));
  sql << "select id from grammars order by id", into(ids);
  for (const int id : ids) {
    const std::string text = escaped_lines(
        unescaped(ask<std::string>("select text from grammars where id = :id", id).value_or("")));
    sql << "update grammars set text = :text where id = :id", use(text), use(id);
  }
}

}  // namespace forest::repository
